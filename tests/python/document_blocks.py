# SPDX-License-Identifier: Apache-2.0
"""Examples of the documentation: finds them in Markdown files, runs them, and compares what they print.

- A block `python` or `cpp` is followed by a sentence `prints ...` with the output in backquotes, or by `prints` and a
  block `text`.
- A block `console` holds lines `$ libocc ...`, each followed by its output, in which `...` stands for anything. The
  exit code is shown as `[exit code N]` if it is not 0.
- All blocks of a page run in order, in one folder that contains `data`.
- A comment `<!-- not run: REASON -->` before a block excludes it. Blocks of other languages are not run.
"""

import contextlib
import doctest
import glob
import io
import re
import shlex
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from click.testing import CliRunner

from libocc.cli import main

FENCE = re.compile(
    r"(?P<skip><!-- not run: [^\n]+ -->\n+)?^(?P<fence>```+)(?P<language>[\w-]+)?\n(?P<code>.*?)^(?P=fence)$",
    re.DOTALL | re.MULTILINE,
)
PRINTS = re.compile(
    r"\s*prints (`+)(?P<inline>.*?)\1[.:]|\s*prints\n+```text\n(?P<block>.*?)^```$", re.DOTALL | re.MULTILINE
)
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@dataclass
class Example:
    """A block of code with the output that the page claims; line: of its first line in the file."""

    language: str
    code: str
    printed: str
    line: int


def blocks(path: Path) -> Iterator[Example]:
    """All blocks to run, in order. Raises: ValueError for a block without its output."""
    text = path.read_text()
    for found in FENCE.finditer(text):
        language = found["language"] or ""
        if found["skip"] or language not in ("python", "cpp", "console"):
            continue
        line = text.count("\n", 0, found.start("code")) + 1
        printed = ""
        if language != "console":
            output = PRINTS.match(text, found.end())
            if output is None:
                raise ValueError(f"{path.name}:{line}: no sentence `prints ...` follows the example")
            printed = output["inline"] if output["inline"] is not None else output["block"]
        yield Example(language, found["code"], printed, line)


def commands(code: str) -> Iterator[tuple[str, str]]:
    """Each command of a console block, without the prompt, and its output."""
    for part in re.split(r"^\$ ", code.replace("\\\n", " "), flags=re.MULTILINE)[1:]:
        command, _, printed = part.partition("\n")
        yield command.strip(), printed


def same(wanted: str, got: str) -> bool:
    return doctest.OutputChecker().check_output(wanted.strip() + "\n", got.strip() + "\n", FLAGS)


def run_python(example: Example) -> None:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), warnings.catch_warnings():
        warnings.filterwarnings("error", message=".* (has moved to|is now) libocc")
        exec(compile(example.code, f"line {example.line}", "exec"), {"__name__": "__main__"})
    assert same(example.printed, printed.getvalue()), f"line {example.line}: printed\n{printed.getvalue()}"


def run_command(command: str) -> str:
    """Output of a command `libocc ...`, with its exit code if it is not 0."""
    program, *arguments = shlex.split(command, comments=True)
    assert program == "libocc", f"only libocc is run in console blocks, got {command!r}"
    expanded = [name for a in arguments for name in (sorted(glob.glob(a)) if "*" in a and glob.glob(a) else [a])]
    ran = CliRunner().invoke(main, expanded, prog_name="libocc")
    if ran.exception is not None and not isinstance(ran.exception, SystemExit):
        raise ran.exception
    return ran.output + (f"[exit code {ran.exit_code}]\n" if ran.exit_code else "")


def run_console(example: Example) -> None:
    for command, wanted in commands(example.code):
        got = run_command(command)
        assert same(wanted, got), f"line {example.line}: $ {command}\n{got}"
