# SPDX-License-Identifier: Apache-2.0
"""Option of the detection threshold, and a hint if an image needs it."""

from collections.abc import Sequence
from typing import Any

import click
import numpy as np

from .._core import Blob

MAX_BLOBS = 300  # more than a picture of lamps has; those of a lit ceiling reach the limit of detect(), 4096
PER_LAMP, MORE = 2, 5  # blobs for each lamp of the map, and further ones, before they are suspect
MAX_AREA = 0.12  # part of the image; a lamp of 0.2 m that is 0.8 m from a phone has 0.06
SUGGESTED = 0.25  # of the full scale: above a lit ceiling, below a lamp (both in sRGB)

threshold_option = click.option(
    "--threshold-dn", type=float, metavar="DN",
    help="Absolute threshold of the lamps' detection instead of the noise-based one.",
)


def background_hint(
    pixels: Any, blobs: Sequence[Blob], threshold_dn: float | None, lamps: int | None = None
) -> str:
    """A sentence if something other than lamps was detected; otherwise empty. lamps: number in the map."""
    area = max((blob.area_px for blob in blobs), default=0)
    limit = MAX_BLOBS if lamps is None else PER_LAMP * lamps + MORE
    if len(blobs) <= limit and area <= MAX_AREA * pixels.shape[0] * pixels.shape[1]:
        return ""
    found = f"{len(blobs)} blobs were detected" if len(blobs) > limit else f"a blob of {area} px was detected"
    if threshold_dn is not None:
        return f"{found} with --threshold-dn {threshold_dn:g}; increase it, or decrease the exposure"
    suggested = SUGGESTED * float(np.iinfo(pixels.dtype).max)
    return f"{found}, probably parts of the lit ceiling; give --threshold-dn {suggested:.0f}, or decrease the exposure"
