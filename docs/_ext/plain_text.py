# SPDX-License-Identifier: Apache-2.0
"""Converts the plain text of docstrings, help texts and header comments to reStructuredText."""

import re
from collections.abc import Iterator

FIELD = re.compile(r"(?:Returns|Raises|[a-z_]\w*(?:, [a-z_]\w*)*):\s")
ITEM = re.compile(r"([a-z_][\w.]*(?:, [a-z_]\w*)*):\s+(.*)")


def escape(text: str) -> str:
    """Text with `code` as literals and all other markup escaped."""
    parts = re.split(r"`([^`]+)`", text)
    plain = [re.sub(r"([\\*|`])|(?<=\w)_(?=\W|$)|(?<!\w)_(?=\w)", r"\\\g<0>", part) for part in parts[::2]]
    merged = [plain[0]]
    for code, after in zip(parts[1::2], plain[1:]):
        merged.append(f"``{code.strip()}``" if not merged[-1][-1:].isalnum() else f"\\ ``{code.strip()}``")
        merged.append(after if not after[:1].isalnum() else "\\ " + after)
    return "".join(merged)


def literal(lines: list[str]) -> Iterator[str]:
    """Block that is shown as it is."""
    yield from ("::", "", *("   " + line for line in lines), "")


def paragraph(lines: list[str]) -> Iterator[str]:
    """Paragraphs and lists of lines without a blank line between."""
    if lines[0].startswith(">>> "):
        yield from (*lines, "")
        return
    if lines[0].startswith("- "):
        yield from ("- " + escape(line[2:]) if line.startswith("- ") else "  " + escape(line.strip()) for line in lines)
        yield ""
        return
    if all(line.startswith("  ") for line in lines):
        yield from literal([line[2:] for line in lines])
        return
    text: list[str] = []
    for number, line in enumerate(lines):
        if line.startswith("  ") and text and text[-1].endswith(":") and len(text[-1]) < 80:
            yield from ("".join(map(escape, [" ".join(text)])), "")
            yield from items([each for each in lines[number:]])
            return
        if text and FIELD.match(line):
            yield from (escape(" ".join(text)), "")
            text = []
        text.append(line.strip())
    yield from (escape(" ".join(text)), "")


def items(lines: list[str]) -> Iterator[str]:
    """Indented lines `name: meaning` as a list; lines of any other form are shown as they are."""
    if not all(ITEM.match(line.strip()) or line.startswith("    ") for line in lines):
        yield from literal([line[2:] for line in lines])
        return
    for line in lines:
        found = None if line.startswith("    ") else ITEM.match(line.strip())
        yield f"- ``{found[1]}``: {escape(found[2])}" if found else "  " + escape(line.strip())
    yield ""


def with_equations(lines: list[str]) -> Iterator[str]:
    """Lines of a comment whose indented lines are equations or tables."""
    previous = False
    for line in lines:
        indented = line.startswith("  ") and bool(line.strip())
        if indented != previous:
            yield ""
        yield line
        previous = indented


def to_rst(lines: list[str]) -> list[str]:
    """Lines of plain text as lines of reStructuredText; `\\b` marks a block that is shown as it is."""
    out: list[str] = []
    block: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line.rstrip())
            continue
        if not block:
            continue
        if block[0].strip() == "\b":
            out += literal(block[1:])
        elif any(each.startswith(">>> ") for each in block[1:]) and not block[0].startswith(">>> "):
            start = next(i for i, each in enumerate(block) if each.startswith(">>> "))
            out += [*paragraph(block[:start]), *paragraph(block[start:])]
        else:
            out += paragraph(block)
        block = []
    return out
