# SPDX-License-Identifier: Apache-2.0
"""Exposure settings and focal length in the EXIF data of image files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from PIL import ExifTags, Image, UnidentifiedImageError

EXPOSURE_TIME = ExifTags.Base.ExposureTime
F_NUMBER = ExifTags.Base.FNumber
# Settings that must be constant in an exposure series.
CONSTANT = {"f-number": F_NUMBER, "ISO speed": ExifTags.Base.ISOSpeedRatings}
FILM_DIAGONAL_MM = math.hypot(36, 24)
# Relative errors. The 35 mm equivalent is a whole number (2 % at 26 mm) and is defined by the diagonal of the
# frame (CIPA DCG-001), but some cameras define it by the width: 4 % on a frame of 4:3.
FILM_SIGMA = 0.05
PLANE_SIGMA = 0.02  # nominal values without the focusing distance
UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0, 5: 1e-3}  # FocalPlaneResolutionUnit: inch, cm, mm, um
HEIF_BRANDS = {b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1", b"avif"}
USE_JPEG = (
    "is a HEIC/HEIF picture, which cannot be read; set the phone to save JPEG "
    "(iPhone: Settings > Camera > Formats > Most Compatible), or convert the picture to JPEG"
)


@dataclass(frozen=True)
class FocalLength:
    """Focal length that the EXIF data of a picture give."""

    px: float
    sigma_px: float
    source: str  # the tags with their values


def is_heif(path: str) -> bool:
    """True if the file begins like a HEIC, HEIF or AVIF picture (ISO base media file with such a brand)."""
    with open(path, "rb") as file:
        head = file.read(12)
    return head[4:8] == b"ftyp" and head[8:12] in HEIF_BRANDS


def open_picture(path: str) -> Image.Image:
    """Opens an image file without reading its pixels. Raises: OSError naming the file and what to do."""
    try:
        return Image.open(path)
    except UnidentifiedImageError as error:
        reason = USE_JPEG if is_heif(path) else "is not an image that can be read"
        raise OSError(f"{path}: {reason}") from error


def camera_tags(path: str) -> dict[int, Any]:
    """EXIF tags of an image file. Raises: OSError when it is not an image file."""
    with open_picture(path) as image:
        return dict(image.getexif().get_ifd(ExifTags.IFD.Exif))


def stored_size(path: str) -> tuple[int, int]:
    """Width and height of the stored pixels, which the EXIF orientation does not rotate. Raises: OSError."""
    with open_picture(path) as image:
        return image.size


def positive(value: Any) -> float | None:
    """Value of a tag as a number, if it is positive and finite."""
    try:
        number = float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) and number > 0 else None


def exposure_s(path: str, tags: dict[int, Any]) -> float:
    """Exposure time [s]. Raises: ValueError naming the file."""
    value = tags.get(EXPOSURE_TIME)
    if value is None:
        raise ValueError(f"{path}: has no ExposureTime in its EXIF data; give --exposures")
    time_s = positive(value)
    if time_s is None:
        raise ValueError(f"{path}: the ExposureTime in its EXIF data must be positive, got {value}; give --exposures")
    return time_s


def focal_length(tags: dict[int, Any], width: int, height: int) -> FocalLength | None:
    """Focal length in pixels of a picture that was not cropped; None without usable tags.

    width, height: size of the picture, which may be reduced.
    """
    base = ExifTags.Base
    focal_mm, per_unit = positive(tags.get(base.FocalLength)), positive(tags.get(base.FocalPlaneXResolution))
    unit_mm = UNIT_MM.get(tags.get(base.FocalPlaneResolutionUnit, 2))
    full_width = positive(tags.get(base.ExifImageWidth)) or width
    if focal_mm and per_unit and unit_mm:
        px = focal_mm * per_unit / unit_mm * max(width, height) / max(full_width, width, height)
        source = f"FocalLength {focal_mm:g} mm, FocalPlaneXResolution {per_unit / unit_mm:.4g} px/mm"
        return FocalLength(px, PLANE_SIGMA * px, source)
    film_mm = positive(tags.get(base.FocalLengthIn35mmFilm))
    if film_mm is None:
        return None
    px = film_mm * math.hypot(width, height) / FILM_DIAGONAL_MM
    return FocalLength(px, FILM_SIGMA * px, f"FocalLengthIn35mmFilm {film_mm:g} mm")


def zoom(tags: dict[int, Any]) -> float:
    """Digital zoom; 1 if there is none or it is not known."""
    return positive(tags.get(ExifTags.Base.DigitalZoomRatio)) or 1.0


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
