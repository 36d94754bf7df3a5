# SPDX-License-Identifier: Apache-2.0
"""One point of a sweep: rendering and evaluation of its images."""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._core import Fix, Renderer, Scene, Truth, detect, locate
from ..dataset.frames import renderer_of
from ..dataset.images import image_bytes
from ..dataset.truth import frame_dict
from ..result_folder import json_bytes
from .plan import scene_and_pose

STILL = np.zeros(6)


@dataclass(frozen=True)
class Point:
    """Description of one point; its values can be sent to another process."""

    index: int
    base: str
    values: dict[str, Any]
    images: int
    seed: int
    keep: tuple[str, ...]
    image_format: str


def point_name(index: int) -> str:
    return f"points/{index:06d}.json"


def detection_row(image: Any, truth: Truth) -> dict[str, Any]:
    """Detection errors of the lamps that are completely visible.

    A lamp is missed if no blob is within its radius; the others give the r.m.s. distance of the nearest blob from
    the centre of the lamp's image.
    """
    blobs = np.array([np.ravel(blob.centroid_px) for blob in detect(image)]).reshape(-1, 2)
    missed, squares = 0, []
    for lamp in truth.lamps:
        if not lamp.whole or lamp.hidden > 0:
            continue
        centre = np.ravel(lamp.image_centre_px)
        reach = 1 + np.linalg.norm(np.asarray(lamp.rim_px) - centre, axis=1).max()
        distance = np.linalg.norm(blobs - centre, axis=1).min(initial=np.inf)
        if distance < reach:
            squares.append(distance**2)
        else:
            missed += 1
    rms = float(np.sqrt(np.mean(squares))) if squares else None
    return {"blobs": len(blobs), "missed_lamps": missed, "centroid_rms_px": rms}


def location_row(fix: Fix, truth: Truth) -> dict[str, Any]:
    """Errors of the pose if the fix is ok."""
    row: dict[str, Any] = {"status": fix.status.name}
    row.update(dict.fromkeys(("position_error_m", "position_sigma_m", "rotation_error_rad")))
    if fix.ok:
        row["position_error_m"] = float(np.linalg.norm(np.ravel(fix.position_m - truth.position_m)))
        row["position_sigma_m"] = float(np.sqrt(np.trace(fix.position_covariance_m2)))
        rotation = fix.cam_from_world[:3, :3] @ truth.cam_from_world[:3, :3].T
        skewed = [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
        sine = 0.5 * float(np.linalg.norm(skewed))
        row["rotation_error_rad"] = float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1)))
    return row


def compute_point(point: Point) -> dict[str, bytes]:
    """Files of a point by name; the last one marks the point as done and lists the others.

    Raises: ValueError naming the point.
    """
    try:
        scene, pose = scene_and_pose(point.base, point.values)
        renderer = renderer_of(scene.format())
        files: dict[str, bytes] = {}
        rows, times = [], []
        for i in range(point.images):
            row, spent = _image(point, i, renderer, scene, pose, files)
            rows.append(row)
            times.append(spent)
    except ValueError as error:
        raise ValueError(f"point {point.index}, {point.values}: {error}") from error
    if "time" in point.keep:
        files[f"times/{point.index:06d}.json"] = json_bytes(times)
    done = {"point": point.index, "values": point.values, "files": list(files), "rows": rows}
    return {**files, point_name(point.index): json_bytes(done)}


def _image(
    point: Point, i: int, renderer: Renderer, scene: Scene, pose: Any, files: dict[str, bytes]
) -> tuple[dict[str, Any], dict[str, Any]]:
    begun = time.perf_counter()
    frame = point.index * point.images + i  # different noise for every image of the sweep
    image, truth = renderer.render(pose, seed=point.seed, frame=frame)
    rendered = time.perf_counter()
    name = f"{point.index:06d}_{i:03d}"
    row: dict[str, Any] = {"image": i, "lamps_in_view": sum(lamp.in_view for lamp in truth.lamps)}
    spent: dict[str, Any] = {"image": i, "render_s": rendered - begun}
    if "images" in point.keep:
        files[f"images/{name}.{point.image_format}"] = image_bytes(image, point.image_format)
    if "truth" in point.keep:
        files[f"truth/{name}.json"] = json_bytes(frame_dict(scene, truth, 0.0, STILL))
    if "detect" in point.keep:
        row.update(detection_row(image, truth))
    if "locate" in point.keep:
        fix = locate(image, scene)
        row.update(location_row(fix, truth))
        spent["locate_s"] = fix.timing_s.total_s
    return row, spent
