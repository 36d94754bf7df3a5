# SPDX-License-Identifier: Apache-2.0
"""Tables of networks: separators, decimal commas, byte order marks, encodings, blank lines, duplicates."""

from pathlib import Path

import pytest

from libocc.network.tables import read_table

COLUMNS = ("name", "x_m", "y_m")


def table(tmp_path: Path, content: str | bytes) -> Path:
    path = tmp_path / "points.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def rows(path: Path) -> list[tuple[str, float, float]]:
    return [(row.text("name"), row.number("x_m"), row.number("y_m"))
            for row in read_table(path, COLUMNS, ("fixed",))]


EXPECTED = [("Tür 1", 1.5, -2.0), ("b", 1e-3, 0.25)]
READABLE = {
    "comma": "name,x_m,y_m\nTür 1,1.5,-2\nb,1e-3,.25\n",
    "semicolon": "name;x_m;y_m\nTür 1;1.5;-2\nb;1e-3;0.25\n",
    "decimal commas": "name;x_m;y_m\nTür 1;1,5;-2\nb;1e-3;,25\n",
    "tabs and decimal commas": "name\tx_m\ty_m\nTür 1\t1,5\t-2,0\nb\t1,0e-3\t0,25\n",
    "byte order mark": "\ufeffname,x_m,y_m\nTür 1,1.5,-2\nb,1e-3,.25\n",
    "line ends of Windows": "name,x_m,y_m\r\nTür 1,1.5,-2\r\nb,1e-3,.25\r\n",
    "blank lines": "name;x_m;y_m\n\nTür 1;1,5;-2\n;;\n  \nb;1e-3;0,25\n\n",
    "empty columns": "name;x_m;y_m;;\nTür 1;1,5;-2;;\nb;1e-3;0,25;;\n",
    "quotes": '"name";"x_m";"y_m"\n"Tür 1";"1,5";"-2"\n"b";"1e-3";"0,25"\n',
}


@pytest.mark.parametrize("content", READABLE.values(), ids=READABLE)
def test_tables_of_spreadsheets_are_read(tmp_path: Path, content: str) -> None:
    assert rows(table(tmp_path, content)) == EXPECTED


WRONG: dict[str, tuple[str | bytes, str]] = {
    "decimal commas between commas": ("name,x_m,y_m\na,1,5,-2\n", ":2: must have 3 cells, got 4; decimal commas need"),
    "both styles": ("name;x_m;y_m\na;1,5;2\nb;1.5;2\n", ":3: column `x_m`: must be in one style of numbers; the table "
                    "mixes decimal commas (line 2) and decimal points (line 3), got '1.5'"),
    "thousands": ("name;x_m;y_m\na;1.234,5;2\n", ":2: column `x_m`: must be a number, got '1.234,5'"),
    "digit groups": ("name,x_m,y_m\na,1_000,2\n", ":2: column `x_m`: must be a number, got '1_000'"),
    "Latin-1": ("name,x_m,y_m\nb,1,2\nTür,1,2\n".encode("latin-1"), ":3: is not UTF-8 (byte 0xfc)"),
    "UTF-16": ("name,x_m,y_m\na,1,2\n".encode("utf-16"), ":1: is encoded as UTF-16; save it as UTF-8"),
    "UTF-16 without a mark": ("name,x_m,y_m\na,1,2\n".encode("utf-16-le"), ":1: has a zero byte"),
    "column twice": ("name,x_m,x_m,y_m\na,1,2,3\n", ":1: column `x_m` occurs twice"),
    "too many cells": ("name;x_m;y_m\na;1;2;3\n", ":2: must have 3 cells, got 4"),
    "open quote": ('name,x_m,y_m\n"a,1,2\n', ":2: is not a table: unexpected end of data"),
    "empty": ("", ":1: has no column `name`"),
    "not a number": ("name,x_m,y_m\na,nan,2\n", ":2: column `x_m`: must be finite, got 'nan'"),
}


@pytest.mark.parametrize(("content", "complaint"), WRONG.values(), ids=WRONG)
def test_other_tables_are_refused_with_the_line(tmp_path: Path, content: str | bytes, complaint: str) -> None:
    path = table(tmp_path, content)
    with pytest.raises(ValueError) as raised:
        rows(path)
    assert f"{path}{complaint}" in str(raised.value)
