# SPDX-License-Identifier: Apache-2.0
"""What a camera wrote into its pictures about how it took them."""

import math
from collections.abc import Sequence
from typing import Any

from PIL import ExifTags, Image

EXPOSURE_TIME = ExifTags.Base.ExposureTime
HELD = {"f-number": ExifTags.Base.FNumber, "ISO speed": ExifTags.Base.ISOSpeedRatings}  # of a series


def camera_tags(path: str) -> dict[int, Any]:
    """Raises: OSError when it is no image file."""
    with Image.open(path) as image:
        return dict(image.getexif().get_ifd(ExifTags.IFD.Exif))


def exposure_s(path: str, tags: dict[int, Any]) -> float:
    """Raises: ValueError naming the file."""
    said = tags.get(EXPOSURE_TIME)
    if said is None:
        raise ValueError(f"{path}: has no ExposureTime in its EXIF; give --exposures")
    try:
        time_s = float(said)
    except (TypeError, ValueError, ZeroDivisionError):
        time_s = math.nan
    if not (math.isfinite(time_s) and time_s > 0):
        raise ValueError(f"{path}: its EXIF's ExposureTime must be positive, got {said}; give --exposures")
    return time_s


def exposures_of_series(paths: Sequence[str], all_tags: Sequence[dict[int, Any]]) -> list[float]:
    """Exposure times [s] of pictures that nothing else tells apart.

    Raises: ValueError naming a file without a time, or with another f-number or ISO speed than the first.
    """
    for path, tags in zip(paths, all_tags, strict=True):
        for name, tag in HELD.items():
            first, here = all_tags[0].get(tag), tags.get(tag)
            if first is not None and here is not None and here != first:
                raise ValueError(
                    f"{path}: its {name} is {here}, that of {paths[0]} {first}: exposure times alone do not say "
                    "how much light each got; give --exposures"
                )
    return [exposure_s(path, tags) for path, tags in zip(paths, all_tags, strict=True)]
