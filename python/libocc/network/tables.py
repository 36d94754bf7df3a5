# SPDX-License-Identifier: Apache-2.0
"""CSV tables; errors name file, line, column and value."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path


class Row:
    """One line of a table."""

    def __init__(self, path: Path, line: int, cells: dict[str, str]):
        self.path, self.line, self.cells = path, line, cells

    def fail(self, column: str, rule: str) -> ValueError:
        return ValueError(
            f"{self.path}:{self.line}: column `{column}`: must be {rule}, got {self.cells.get(column, '')!r}"
        )

    def has(self, column: str) -> bool:
        return self.cells.get(column, "") != ""

    def text(self, column: str) -> str:
        if not self.has(column):
            raise self.fail(column, "given")
        return self.cells[column]

    def number(self, column: str, default: float | None = None) -> float:
        if default is not None and not self.has(column):
            return default
        try:
            value = float(self.text(column))
        except ValueError:
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


def read_table(path: Path, needed: Sequence[str], optional: Sequence[str] = ()) -> Iterator[Row]:
    """Reads rows with the column names of the first line. Raises: OSError; ValueError naming file and line."""
    with open(path, newline="", encoding="utf-8") as file:
        reader = csv.reader(file)
        head = [name.strip() for name in next(reader, [])]
        for name in needed:
            if name not in head:
                raise ValueError(f"{path}:1: has no column `{name}`; required: {', '.join(needed)}")
        for name in head:
            if name not in (*needed, *optional):
                raise ValueError(
                    f"{path}:1: column `{name}` is unknown; allowed: {', '.join((*needed, *optional))}"
                )
        for cells in reader:
            if not cells:
                continue
            if len(cells) != len(head):
                raise ValueError(f"{path}:{reader.line_num}: must have {len(head)} cells, got {len(cells)}")
            yield Row(path, reader.line_num, dict(zip(head, (cell.strip() for cell in cells))))


def table_bytes(head: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    """Encodes a table; numbers have all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([repr(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)
    return text.getvalue().encode()
