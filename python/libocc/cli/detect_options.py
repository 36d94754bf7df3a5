# SPDX-License-Identifier: Apache-2.0
"""Option of the detection threshold, and a hint if an image needs it."""

import math
from collections.abc import Sequence
from typing import Any

import click
import numpy as np

from .._core import Blob, Scene
from . import Failure

AUTO = "auto"
# The threshold `auto` is BACKGROUND_PART of the pixels, and ABOVE of the way from there to the brightest pixel. Lamps
# cover less than a tenth of a picture. With ABOVE from 0.16 to 0.25, all of 30 rendered phone pictures were
# located whose ceiling had up to 141 grey levels, some with a skylight brighter than the lamps; 14 with the noise-based
# threshold.
BACKGROUND_PART, ABOVE = 0.9, 0.2
MAX_BLOBS = 300  # more than a picture of lamps has; those of a lit ceiling reach the limit of detect(), 4096
MAX_AREA = 0.12  # part of the image; a lamp of 0.2 m that is 0.8 m from a phone has 0.06

Threshold = float | str | None


def parsed(ctx: click.Context, param: click.Parameter, value: str | None) -> Threshold:
    """Parses a finite number or `auto`."""
    if value is None or value == AUTO:
        return value
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise Failure(f"--threshold-dn: must be a number or {AUTO}, got {value!r}")
    return number


threshold_option = click.option(
    "--threshold-dn", callback=parsed, metavar="DN|auto",
    help="Absolute threshold of the detection instead of the noise-based one; auto: above the lit ceiling.",
)


def threshold_above_ceiling(pixels: Any) -> float:
    """Threshold [grey levels] between the background and the lamps of an image."""
    grey = pixels[..., :3].mean(axis=2) if pixels.ndim == 3 else pixels
    background = float(np.quantile(grey, BACKGROUND_PART))
    return background + ABOVE * (float(grey.max()) - background)


def threshold_of(pixels: Any, threshold: Threshold) -> float | None:
    """Value of the option for an image."""
    return threshold_above_ceiling(pixels) if isinstance(threshold, str) else threshold


def stated_colours(scene: Scene) -> list[Any]:
    """Colours of the lamps for detect(); empty if the channels of no lamp differ."""
    colours = [lamp.colour for lamp in scene.lamps]
    return colours if any(np.ptp(colour) > 0 for colour in colours) else []


def background_hint(pixels: Any, blobs: Sequence[Blob], threshold: Threshold, lamps: int | None = None) -> str:
    """A sentence if something other than lamps was detected; otherwise empty. lamps: number in the map."""
    area = max((blob.area_px for blob in blobs), default=0)
    limit = MAX_BLOBS if lamps is None else lamps
    if len(blobs) <= limit and area <= MAX_AREA * pixels.shape[0] * pixels.shape[1]:
        return ""
    found = f"{len(blobs)} blobs were detected" if len(blobs) > limit else f"a blob of {area} px was detected"
    if lamps is not None:
        found += f" for {lamps} lamps"
    value = threshold_above_ceiling(pixels)
    if threshold is None:
        return f"{found}; if the ceiling is bright, give --threshold-dn {AUTO} (here {value:.0f}), or expose less"
    return f"{found} with --threshold-dn {threshold_of(pixels, threshold):.0f}; try another threshold, or expose less"
