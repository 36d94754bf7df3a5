# SPDX-License-Identifier: Apache-2.0
"""Exposure settings in the EXIF data of image files."""

import math
from collections.abc import Sequence
from typing import Any

from PIL import ExifTags, Image

EXPOSURE_TIME = ExifTags.Base.ExposureTime
# Settings that must be constant in an exposure series.
CONSTANT = {"f-number": ExifTags.Base.FNumber, "ISO speed": ExifTags.Base.ISOSpeedRatings}


def camera_tags(path: str) -> dict[int, Any]:
    """EXIF tags of an image file. Raises: OSError when it is not an image file."""
    with Image.open(path) as image:
        return dict(image.getexif().get_ifd(ExifTags.IFD.Exif))


def exposure_s(path: str, tags: dict[int, Any]) -> float:
    """Exposure time [s]. Raises: ValueError naming the file."""
    value = tags.get(EXPOSURE_TIME)
    if value is None:
        raise ValueError(f"{path}: has no ExposureTime in its EXIF data; give --exposures")
    try:
        time_s = float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        time_s = math.nan
    if not (math.isfinite(time_s) and time_s > 0):
        raise ValueError(f"{path}: the ExposureTime in its EXIF data must be positive, got {value}; give --exposures")
    return time_s


def exposures_of_series(paths: Sequence[str], all_tags: Sequence[dict[int, Any]]) -> list[float]:
    """Exposure times [s] of images that differ in nothing but the exposure time.

    Raises: ValueError naming a file without a time, or whose f-number or ISO speed differs from the first one's.
    """
    for path, tags in zip(paths, all_tags, strict=True):
        for name, tag in CONSTANT.items():
            first, here = all_tags[0].get(tag), tags.get(tag)
            if first is not None and here is not None and here != first:
                raise ValueError(
                    f"{path}: its {name} is {here}, that of {paths[0]} is {first}: the exposures are not "
                    "proportional to the exposure times; give --exposures"
                )
    return [exposure_s(path, tags) for path, tags in zip(paths, all_tags, strict=True)]
