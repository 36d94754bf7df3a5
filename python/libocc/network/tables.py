# SPDX-License-Identifier: Apache-2.0
"""CSV tables; errors name file, line, column and value.

Read are comma, semicolon and tab as separators, with or without a byte order mark, and decimal commas where the
separator is another character. Written are commas and decimal points.
"""

import codecs
import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

SEPARATORS = (";", "\t")  # a header with one of these is not separated by commas: names have neither
DECIMAL_COMMA = re.compile(r"[-+]?(\d+,\d*|,\d+)([eE][-+]?\d+)?")
OTHER_ENCODINGS = (
    (codecs.BOM_UTF32_LE, "UTF-32"), (codecs.BOM_UTF32_BE, "UTF-32"),  # before UTF-16, whose mark begins UTF-32's
    (codecs.BOM_UTF16_LE, "UTF-16"), (codecs.BOM_UTF16_BE, "UTF-16"),
)


class NumberStyle:
    """The decimal character of a table's numbers: a comma or a point, not both."""

    def __init__(self, separator: str):
        self.separator = separator
        self.first_line: dict[str, int] = {}

    def parse(self, text: str, line: int) -> float:
        """Value of a number. Raises: ValueError, with a message if the table mixes commas and points."""
        has_comma = self.separator != "," and DECIMAL_COMMA.fullmatch(text) is not None
        if "_" in text:  # Python's digit groups
            raise ValueError("")
        value = float(text.replace(",", ".") if has_comma else text)
        if has_comma or "." in text:
            self.first_line.setdefault("comma" if has_comma else "point", line)
        if len(self.first_line) == 2:
            lines = " and ".join(f"decimal {kind}s (line {first})" for kind, first in sorted(self.first_line.items()))
            raise ValueError(f"must be in one style of numbers; the table mixes {lines}")
        return value


class Row:
    """One line of a table."""

    def __init__(self, path: Path, line: int, cells: dict[str, str], style: NumberStyle | None = None):
        self.path, self.line, self.cells = path, line, cells
        self.style = style or NumberStyle(",")

    @property
    def where(self) -> str:
        return f"{self.path}:{self.line}"

    def fail(self, column: str, rule: str) -> ValueError:
        return ValueError(f"{self.where}: column `{column}`: must be {rule}, got {self.cells.get(column, '')!r}")

    def has(self, column: str) -> bool:
        return self.cells.get(column, "") != ""

    def text(self, column: str) -> str:
        if not self.has(column):
            raise self.fail(column, "given")
        return self.cells[column]

    def number(self, column: str, default: float | None = None) -> float:
        if default is not None and not self.has(column):
            return default
        text = self.text(column)
        try:
            value = self.style.parse(text, self.line)
        except ValueError as error:
            if "mixes" in str(error):
                raise ValueError(f"{self.where}: column `{column}`: {error}, got {text!r}") from None
            raise self.fail(column, "a number") from None
        if not math.isfinite(value):
            raise self.fail(column, "finite")
        return value

    def flag(self, column: str) -> bool:
        if not self.has(column):
            return False
        if self.cells[column] not in ("0", "1"):
            raise self.fail(column, "0 or 1")
        return self.cells[column] == "1"


def decoded(path: Path, content: bytes) -> str:
    """Text of a file in UTF-8, without a byte order mark. Raises: ValueError naming line and byte."""
    for mark, encoding in OTHER_ENCODINGS:
        if content.startswith(mark):
            raise ValueError(f"{path}:1: is encoded as {encoding}; save it as UTF-8")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        byte = content[error.start]
        raise ValueError(
            f"{path}:{line}: is not UTF-8 (byte 0x{byte:02x}), perhaps Windows-1252 or Latin-1; save it as UTF-8"
        ) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ValueError(f"{path}:{line}: has a zero byte; it is not a text file in UTF-8")
    return text


def read_table(path: Path, needed: Sequence[str], optional: Sequence[str] = ()) -> Iterator[Row]:
    """Reads rows with the column names of the first line; blank lines are skipped.

    Raises: OSError; ValueError naming file and line.
    """
    text = decoded(path, Path(path).read_bytes())
    first = text.split("\n", 1)[0]
    separator = next((character for character in SEPARATORS if character in first), ",")
    style = NumberStyle(separator)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    try:
        head = [name.strip() for name in next(reader, [])]
        while head and not head[-1]:  # empty columns at the end, as spreadsheets write them
            head.pop()
        for name in needed:
            if name not in head:
                raise ValueError(f"{path}:1: has no column `{name}`; required: {', '.join(needed)}")
        for k, name in enumerate(head):
            if name not in (*needed, *optional):
                raise ValueError(
                    f"{path}:1: column `{name}` is unknown; allowed: {', '.join((*needed, *optional))}"
                )
            if name in head[:k]:
                raise ValueError(f"{path}:1: column `{name}` occurs twice")
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            while len(cells) > len(head) and not cells[-1].strip():
                cells.pop()
            if len(cells) != len(head):
                hint = "; decimal commas need semicolons or tabs between the cells" if separator == "," else ""
                raise ValueError(f"{path}:{reader.line_num}: must have {len(head)} cells, got {len(cells)}{hint}")
            yield Row(path, reader.line_num, dict(zip(head, (cell.strip() for cell in cells))), style)
    except csv.Error as error:
        raise ValueError(f"{path}:{reader.line_num}: is not a table: {error}") from None


def table_bytes(head: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    """Encodes a table; numbers have all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([repr(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)
    return text.getvalue().encode()
