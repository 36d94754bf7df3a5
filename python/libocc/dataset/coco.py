# SPDX-License-Identifier: Apache-2.0
"""COCO's layout: images/ and annotations/instances.json.

Every lamp is a category of its own, the n-th of the scene number n from 1: its name is what a detector
is to tell. An image's id is its frame's. In COCO's coordinates (0, 0) is the corner of the first pixel,
not its centre. What is seen is annotated: as a polygon, or as run lengths where boxes hide a part.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..result_folder import json_bytes
from .masks import box_of, from_run_lengths
from .plain import Plain


def clipped(rim_px: list[list[float]], width: int, height: int) -> list[float]:
    """A convex or other polygon within the image's borders, in COCO's coordinates, as x, y, x, y, ...
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

    def set_files(self, truths: list[dict[str, Any]], ending: str) -> Iterator[tuple[str, bytes]]:
        yield from super().set_files(truths, ending)
        camera = self.scene.camera
        images = [
            {
                "id": truth["frame"],
                "file_name": f"{truth['frame']:06d}.{ending}",
                "width": camera.width,
                "height": camera.height,
            }
            for truth in truths
        ]
        data = {
            "info": {"description": "Rendered by libocc"},
            "licenses": [],
            "images": images,
            "annotations": self._annotations(truths),
            "categories": [
                {"id": i, "name": lamp.name or f"lamp {lamp.id}", "supercategory": "lamp", "lamp_id": lamp.id}
                for i, lamp in enumerate(self.scene.lamps, 1)
            ],
        }
        yield "annotations/instances.json", json_bytes(data)

    def _annotations(self, truths: list[dict[str, Any]]) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        for truth in truths:
            for category, lamp in enumerate(truth["lamps"], 1):
                if not lamp["in_view"]:
                    continue
                annotation = self._annotation(lamp)
                if annotation is not None:
                    ids = {"id": len(found) + 1, "image_id": truth["frame"], "category_id": category}
                    found.append({**ids, **annotation})
        return found

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
