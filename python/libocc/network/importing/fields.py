# SPDX-License-Identifier: Apache-2.0
"""Text files with fields between separators; errors name file, line, field and value."""

import codecs
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._core import Datum, Network
from ..tables import decoded


@dataclass
class Imported:
    """A network of another program with what its files say beside the network.

    notes: what was dropped or assumed, one sentence each. check_points: known positions [m] by the point's name, which
    are not used in the adjustment.
    """

    network: Network
    datum: Datum = field(default_factory=Datum)
    check_points: dict[str, list[float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


class Fields:
    """Fields of one line."""

    def __init__(self, path: Path, line: int, cells: Sequence[str]):
        self.path, self.line, self.cells = path, line, cells

    @property
    def where(self) -> str:
        return f"{self.path}:{self.line}"

    def __len__(self) -> int:
        return len(self.cells)

    def fail(self, name: str, rule: str, value: object) -> ValueError:
        return ValueError(f"{self.where}: field `{name}`: must be {rule}, got {value!r}")

    def require(self, names: Sequence[str], *, more: bool = False) -> None:
        """Raises ValueError unless the line has these fields; more: further ones may follow."""
        if len(self.cells) < len(names) or (len(self.cells) > len(names) and not more):
            rule = f"at least {len(names)}" if more else str(len(names))
            raise ValueError(f"{self.where}: must have {rule} fields ({', '.join(names)}), got {len(self.cells)}")

    def text(self, index: int, name: str) -> str:
        if index >= len(self.cells):
            raise ValueError(f"{self.where}: field `{name}`: is missing; the line has {len(self.cells)} fields")
        return self.cells[index]

    def number(self, index: int, name: str) -> float:
        text = self.text(index, name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or "_" in text:
            raise self.fail(name, "a finite number", text)
        return value

    def positive(self, index: int, name: str) -> float:
        value = self.number(index, name)
        if not value > 0:
            raise self.fail(name, "positive", self.cells[index])
        return value

    def integer(self, index: int, name: str, minimum: int | None = None) -> int:
        text = self.text(index, name)
        try:
            value = int(text)
        except ValueError:
            raise self.fail(name, "a whole number", text) from None
        if minimum is not None and value < minimum:
            raise self.fail(name, f"at least {minimum}", text)
        return value

    def vector(self, first: int, names: Sequence[str]) -> NDArray[np.float64]:
        return np.array([self.number(first + k, name) for k, name in enumerate(names)])


def text_of(path: Path) -> str:
    """Text of another program's file: UTF-8, or Windows' encoding of Western Europe, which only names need.

    Raises: OSError; ValueError for UTF-16, UTF-32 and files that are no text.
    """
    content = path.read_bytes()
    try:
        content.decode("utf-8-sig")
    except UnicodeDecodeError:
        if not content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, codecs.BOM_UTF32_BE)):
            content = content.decode("cp1252", errors="replace").encode()
    return decoded(path, content)


def lines_of(path: Path, separator: str | None = None, comment: str = "#") -> Iterator[Fields]:
    """Lines of a text file as fields, without blank lines and comments. separator: None for white space.

    Raises: OSError; ValueError naming file and line.
    """
    for number, line in enumerate(text_of(path).splitlines(), 1):
        text = line.strip()
        if text and not text.startswith(comment):
            yield Fields(path, number, [cell.strip() for cell in text.split(separator)])
