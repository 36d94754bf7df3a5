# SPDX-License-Identifier: Apache-2.0
"""Layout of COCO: images/ and annotations/instances.json.

Every lamp is a category; the category numbers start with 1 in the order of the scene. The id of an image is the number
of its frame. In COCO's coordinates (0, 0) is the corner of the first pixel, not its centre. The visible part of a lamp
is annotated as a polygon, or as run lengths if a box hides a part of it.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..result_folder import json_bytes
from .masks import box_of, from_run_lengths
from .plain import Plain


def clipped(rim_px: list[list[float]], width: int, height: int) -> list[float]:
    """Polygon clipped to the image, in COCO's coordinates, as x, y, x, y, ...
    (Sutherland and Hodgman, "Reentrant polygon clipping", 1974)."""
    points = np.asarray(rim_px, float) + 0.5
    for axis, sign, limit in ((0, 1, 0.0), (0, -1, -float(width)), (1, 1, 0.0), (1, -1, -float(height))):
        kept: list[Any] = []
        for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
            over_a, over_b = sign * a[axis] - limit, sign * b[axis] - limit
            if over_a >= 0:
                kept.append(a)
            if (over_a >= 0) != (over_b >= 0):
                kept.append(a + (b - a) * over_a / (over_a - over_b))
        points = np.asarray(kept, float).reshape(-1, 2)
    return [float(v) for v in points.ravel()]


class Coco(Plain):
    name = "coco"

    def entry(self, truth: dict[str, Any]) -> dict[str, Any]:
        found = []
        for category, lamp in enumerate(truth["lamps"], 1):
            annotation = self._annotation(lamp) if lamp["in_view"] else None
            if annotation is not None:
                found.append({"image_id": truth["frame"], "category_id": category, **annotation})
        return {**super().entry(truth), "annotations": found}

    def set_files(self, entries: list[dict[str, Any]], ending: str) -> Iterator[tuple[str, bytes]]:
        yield from super().set_files(entries, ending)
        size = {"width": self.scene.camera.width, "height": self.scene.camera.height}
        annotations = [annotation for entry in entries for annotation in entry["annotations"]]
        data = {
            "info": {"description": "Rendered by libocc"},
            "licenses": [],
            "images": [
                {"id": entry["frame"], "file_name": f"{entry['frame']:06d}.{ending}", **size}
                for entry in entries
            ],
            "annotations": [{"id": i, **annotation} for i, annotation in enumerate(annotations, 1)],
            "categories": [
                {"id": i, "name": lamp.name or f"lamp {lamp.id}", "supercategory": "lamp", "lamp_id": lamp.id}
                for i, lamp in enumerate(self.scene.lamps, 1)
            ],
        }
        yield "annotations/instances.json", json_bytes(data)

    def _annotation(self, lamp: dict[str, Any]) -> dict[str, Any] | None:
        mask = from_run_lengths(lamp["mask_visible"])
        if not mask.any():
            return None
        x0, y0, x1, y1 = box_of(mask)
        outline = clipped(lamp["rim_px"], self.scene.camera.width, self.scene.camera.height)
        whole = lamp["hidden"] == 0 and len(outline) >= 6
        return {
            "segmentation": [outline] if whole else lamp["mask_visible"],
            "area": int(mask.sum()),
            "bbox": [x0, y0, x1 - x0 + 1, y1 - y0 + 1],
            "iscrowd": 0,
        }
