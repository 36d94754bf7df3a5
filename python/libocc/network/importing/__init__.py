# SPDX-License-Identifier: Apache-2.0
"""Networks of other programs: AICON 3D Studio, PhotoModeler and DBAT, COLMAP, BAL, Kalibr."""

import math
from collections.abc import Callable
from pathlib import Path

from .aicon import is_aicon, read_aicon
from .bal import is_bal, read_bal
from .colmap import is_colmap, read_colmap
from .dbat import is_dbat, read_dbat
from .fields import Imported
from .kalibr import is_kalibr, read_kalibr
from .photomodeler import is_photomodeler, read_photomodeler

__all__ = ["FORMATS", "Imported", "format_of", "import_network", "read_aicon", "read_bal", "read_colmap", "read_dbat",
           "read_kalibr", "read_photomodeler"]

# In the order in which format_of() tries them.
FORMATS: dict[str, tuple[Callable[[Path], bool], Callable[..., Imported]]] = {
    "aicon": (is_aicon, read_aicon),
    "colmap": (is_colmap, read_colmap),
    "kalibr": (is_kalibr, read_kalibr),
    "dbat": (is_dbat, read_dbat),
    "photomodeler": (is_photomodeler, read_photomodeler),
    "bal": (is_bal, read_bal),
}


def source_of(path: str | Path) -> tuple[Path, str | None]:
    """The path, or the one file of a folder, that is in one of the formats, and the format's name or None.

    Raises: OSError; ValueError if several files of the folder are.
    """
    path = Path(path)
    for name, (detects, _) in FORMATS.items():
        if detects(path):
            return path, name
    if not path.is_dir():
        return path, None
    found = [
        (file, name) for file in sorted(path.iterdir()) if file.is_file()
        for name in ("kalibr", "dbat", "photomodeler", "bal") if FORMATS[name][0](file)
    ]
    if len(found) > 1:
        names = ", ".join(f"{file.name} ({name})" for file, name in found)
        raise ValueError(f"{path}: has several networks: {names}; give one of them")
    return found[0] if found else (path, None)


def format_of(path: str | Path) -> str | None:
    """Name of the other program's format, or None; of a folder, that of its one network. Raises: as source_of()."""
    return source_of(path)[1]


def import_network(
    path: str | Path, *, control: str | Path | None = None, target: str | Path | None = None,
    sigma_px: float | None = None,
) -> Imported:
    """Reads a network of another program; the format follows from names and first lines.

    path: one of AICON's files or their folder, PhotoModeler's text export, DBAT's script, COLMAP's folder, BAL's
    problem, Kalibr's camchain.yaml, or a folder with one of them.
    control: control points for PhotoModeler's export (DBAT's table: id, label, x, y, z and sigmas).
    target: file of a target for Kalibr's camchain.yaml; it becomes a fixed body.
    sigma_px: standard deviation of all image points, in place of those of the files.
    Raises: OSError; ValueError naming file, line, field and value.
    """
    path, name = source_of(path)
    if name is None:
        raise ValueError(f"{path}: is in none of the formats {', '.join(FORMATS)}")
    options: dict[str, object] = {}
    for key, value, wanted in (("control", control, "photomodeler"), ("target", target, "kalibr")):
        if value is not None:
            if name != wanted:
                raise ValueError(f"{key}: must be omitted for the format {name}, got {value}")
            options[key] = value
    if sigma_px is not None:
        if name == "kalibr":
            raise ValueError(f"sigma_px: must be omitted for the format {name}, got {sigma_px:g}")
        if not 0 < sigma_px < math.inf:
            raise ValueError(f"sigma_px must be positive and finite, got {sigma_px:g}")
        options["sigma_px"] = sigma_px
    found = FORMATS[name][1](path, **options)
    try:
        found.network.check()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return found
