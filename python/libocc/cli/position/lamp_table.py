# SPDX-License-Identifier: Apache-2.0
"""Table of lamp positions by id, as a building's management may provide it.

    id,x,y,z
    1,1.0,1.0,3.0
    2,3.0,1.0,3.0

Units are metres. The column `radius` is optional; without it a lamp has the size of the scene's lamp with the same id,
or the common size of all lamps in the scene.
"""

import csv
import math
from pathlib import Path

from ..._core import Code, Lamp, LampCode, Scene

COLUMNS = ("id", "x", "y", "z")


def lamps_of_table(path: str, scene: Scene, code: Code) -> Scene:
    """Scene with the lamps of the table, each of which transmits its id with `code`.

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
                    raise ValueError(f"id {lamp.id} occurs twice")
            except ValueError as error:
                reason = str(error) if "zip()" not in str(error) else f"must have {len(header)} values, got {len(row)}"
                raise ValueError(f"{path}:{rows.line_num}: {reason}") from error
            lamps[lamp.id] = lamp
    if not lamps:
        raise ValueError(f"{path}: has no lamps")
    return scene.replace(lamps=list(lamps.values()))


def _lamp(row: dict[str, str], scene: Scene, code: Code) -> Lamp:
    if not row["id"].strip().isdecimal():
        raise ValueError(f"id must be a whole number, got {row['id']!r}")
    id = int(row["id"])
    centre_m = [_number(row[axis], axis) for axis in COLUMNS[1:]]
    templates = {lamp.id: lamp for lamp in scene.lamps}
    template = templates.get(id)
    if "radius" in row:
        radius_m = _number(row["radius"], "radius")
        if radius_m <= 0:
            raise ValueError(f"radius must be positive, got {row['radius']!r}")
        template = template or Lamp(id=id, centre_m=centre_m, radius_m=radius_m)
        template = template.replace(radius_m=radius_m)
    elif template is None:
        if len({lamp.radius_m for lamp in scene.lamps}) != 1:
            raise ValueError(f"id {id}: the size of the lamp is unknown; add a column radius")
        template = scene.lamps[0]
    return template.replace(
        id=id, centre_m=centre_m, code=LampCode(code=code, id=id), frequency_hz=None, waveform=[],
    )


def _number(text: str, name: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise ValueError(f"{name} must be a number [m], got {text!r}") from error
    if not math.isfinite(value):
        raise ValueError(f"{name} must be finite, got {text!r}")
    return value
