# SPDX-License-Identifier: Apache-2.0
"""Pictures with EXIF data for tests."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

FOCAL_35MM, FOCAL, PLANE_X, PLANE_UNIT, ZOOM = 0xA405, 0x920A, 0xA20E, 0xA210, 0xA404
EXPOSURE_TIME, F_NUMBER = 0x829A, 0x829D
ORIENTATION = 0x0112
HEIC_HEAD = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic"


def save_with_exif(path: Path, pixels: Any, tags: dict[int, Any] | None = None, orientation: int | None = None) -> Path:
    """Writes pixels with EXIF tags; orientation: 1 to 8, of the display."""
    exif = Image.Exif()
    if orientation is not None:
        exif[ORIENTATION] = orientation
    exif.get_ifd(0x8769).update(tags or {})
    options = {"quality": 95} if path.suffix == ".jpg" else {}
    Image.fromarray(np.asarray(pixels)).save(path, exif=exif, **options)
    return path
