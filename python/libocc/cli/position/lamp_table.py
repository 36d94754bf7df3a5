# SPDX-License-Identifier: Apache-2.0
"""Where lamps hang by the ids that they say, as a table: what a building's management hands out.

    id,x,y,z
    1,1.0,1.0,3.0
    2,3.0,1.0,3.0

Metres. A column `radius` may follow; without it lamps are as large as the scene's of the same id, or
as all of the scene's are.
"""

import csv
import math
from pathlib import Path

from ..._core import Code, Lamp, LampCode, Scene

COLUMNS = ("id", "x", "y", "z")


def lamps_of_table(path: str, scene: Scene, code: Code) -> Scene:
    """The scene's camera with the table's lamps, each of which says its id by the code.

    Raises: OSError; ValueError naming file and line.
    """
    with Path(path).open(newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        header = [name.strip() for name in next(rows, [])]
        if tuple(header[:4]) != COLUMNS or header[4:] not in ([], ["radius"]):
            raise ValueError(f"{path}:1: columns must be id,x,y,z or id,x,y,z,radius, got {','.join(header)!r}")
        lamps: dict[int, Lamp] = {}
        for row in rows:
            if not row or row[0].lstrip().startswith("#"):
                continue
            try:
                lamp = _lamp(dict(zip(header, row, strict=True)), scene, code)
                if lamp.id in lamps:
                    raise ValueError(f"id {lamp.id} is there already")
            except ValueError as error:
                said = str(error) if "zip()" not in str(error) else f"must have {len(header)} values, got {len(row)}"
                raise ValueError(f"{path}:{rows.line_num}: {said}") from error
            lamps[lamp.id] = lamp
    if not lamps:
        raise ValueError(f"{path}: has no lamps")
    return scene.replace(lamps=list(lamps.values()))


def _lamp(row: dict[str, str], scene: Scene, code: Code) -> Lamp:
    if not row["id"].strip().isdecimal():
        raise ValueError(f"id must be a whole number, got {row['id']!r}")
    id = int(row["id"])
    centre_m = [_number(row[axis], axis) for axis in COLUMNS[1:]]
    likes = {lamp.id: lamp for lamp in scene.lamps}
    like = likes.get(id)
    if "radius" in row:
        radius_m = _number(row["radius"], "radius")
        if radius_m <= 0:
            raise ValueError(f"radius must be positive, got {row['radius']!r}")
        like = like or Lamp(id=id, centre_m=centre_m, radius_m=radius_m)
        like = like.replace(radius_m=radius_m)
    elif like is None:
        if len({lamp.radius_m for lamp in scene.lamps}) != 1:
            raise ValueError(f"id {id}: how large is the lamp? Give a column radius")
        like = scene.lamps[0]
    said = LampCode(code=code, id=id)  # which sets how it blinks
    return like.replace(id=id, centre_m=centre_m, code=said, frequency_hz=None, waveform=[])


def _number(text: str, name: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise ValueError(f"{name} must be a number [m], got {text!r}") from error
    if not math.isfinite(value):
        raise ValueError(f"{name} must be finite, got {text!r}")
    return value
