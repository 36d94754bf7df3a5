# SPDX-License-Identifier: Apache-2.0
"""Layout of the BOP benchmark (Hodan et al., "BOP: Benchmark for 6D Object Pose Estimation", 2018):
test/000000 with gray/, mask/, mask_visib/, scene_camera.json, scene_gt.json and scene_gt_info.json;
test_targets_bop19.json; camera.json; models/, and models_eval/ with the same models.

Units are millimetres. Every lamp is an object; the object numbers start with 1 in the order of the scene. The origin
of a model is the lamp's centre; its x and z axes are the lamp's x_axis and normal. cam_R_w2c and cam_t_w2c are the pose
at the start of the first row's exposure. For a moving camera with a rolling shutter, a lamp's cam_R_m2c and cam_t_m2c
refer to the time at which its row is exposed. There is no depth, so px_count_valid is 0.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..._core import Lamp, encode_image
from ..result_folder import json_bytes
from .masks import Mask, box_of, from_run_lengths
from .plain import Plain

SCENE = "test/000000"
RIM_POINTS = 64
MIN_TARGET = 0.1  # min visible fraction of a silhouette for a target of the BOP challenge
NOTHING = [-1, -1, -1, -1]
MM = 1e3


def rim_in_lamp_m(lamp: Lamp) -> Any:
    """(n, 2) rim points along the lamp's axes; for a point source only its centre."""
    angle = 2 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    half = 0.5 * np.ravel(lamp.size_m)
    if lamp.shape.name == "disc":
        return lamp.radius_m * circle
    if lamp.shape.name == "rectangle":
        return half * [[1, 1], [-1, 1], [-1, -1], [1, -1]]
    if lamp.shape.name == "lame":
        return half * np.sign(circle) * np.abs(circle) ** (2 / lamp.exponent)
    if lamp.shape.name == "polygon":
        return np.array(lamp.corners_m)
    return np.zeros((1, 2))


def model_ply(lamp: Lamp) -> bytes:
    """Luminous face as triangles [mm], in PLY format."""
    rim = MM * rim_in_lamp_m(lamp)
    fan = [[0, i, i + 1] for i in range(1, len(rim) - 1)]
    faces = [f"3 {i} {j} {k}" for i, j, k in lamp.face_triangles() or fan]
    lines = ["ply", "format ascii 1.0", "comment libocc", f"element vertex {len(rim)}"]
    lines += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [f"{x:.6f} {y:.6f} 0 0 0 1" for x, y in rim]
    return ("\n".join(lines + faces) + "\n").encode()


def symmetries_of_polygon(lamp: Lamp) -> list[tuple[float, float]]:
    """Cosine and sine of the rotations that map the corners to themselves, except by 0."""
    corners = np.array(lamp.corners_m) @ [1, 1j]
    turns = []
    for k in range(1, len(corners)):
        turn = corners[k] / corners[0]
        if np.allclose(np.roll(corners, -k), turn * corners, atol=1e-6 * np.abs(corners).max()):
            turns.append((float(turn.real), float(turn.imag)))
    return turns


def symmetries(lamp: Lamp) -> dict[str, Any]:
    """Symmetries under rotation about the normal."""
    if lamp.shape.name in ("disc", "point"):
        return {"symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]}
    if lamp.shape.name == "polygon":
        turns = symmetries_of_polygon(lamp)
    elif lamp.size_m[0] == lamp.size_m[1]:
        turns = [(0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
    else:
        turns = [(-1.0, 0.0)]
    rotations = []
    for cosine, sine in turns:
        rotations.append([cosine, -sine, 0, 0, sine, cosine, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
    return {"symmetries_discrete": rotations}


def model_info(lamp: Lamp) -> dict[str, Any]:
    rim = MM * rim_in_lamp_m(lamp)
    low, size = rim.min(axis=0), np.ptp(rim, axis=0)
    apart = np.linalg.norm(rim[:, None] - rim[None], axis=2)
    box = {"min_x": low[0], "min_y": low[1], "min_z": 0.0}
    box.update({"size_x": size[0], "size_y": size[1], "size_z": 0.0, "diameter": apart.max()})
    return {**{key: float(value) for key, value in box.items()}, **symmetries(lamp), "lamp_id": lamp.id}


def world_from_lamp(lamp: Lamp) -> Any:
    x, z = np.ravel(lamp.x_axis), np.ravel(lamp.normal)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = np.ravel(lamp.centre_m)
    return pose


def toolkit_box(x0: int, y0: int, x1: int, y1: int) -> list[int]:
    """x, y, width, height as in BOP's toolkit, where a box of one column has the width 0."""
    return [x0, y0, x1 - x0, y1 - y0]


def mask_png(mask: Mask) -> bytes:
    return encode_image(255 * mask.astype(np.uint8), ".png")


def seen(truth: dict[str, Any]) -> list[tuple[int, dict[str, Any]]]:
    """Object numbers and truths of the lamps in view, in the order of annotation."""
    return [(i, lamp) for i, lamp in enumerate(truth["lamps"], 1) if lamp["in_view"]]


def lamp_info(lamp: dict[str, Any]) -> dict[str, Any]:
    """Entry of scene_gt_info.json for a lamp in view."""
    visible = from_run_lengths(lamp["mask_visible"])
    count = int(visible.sum())
    whole = lamp["silhouette"]
    return {
        "bbox_obj": toolkit_box(*whole["box_px"]) if count else NOTHING,
        "bbox_visib": toolkit_box(*box_of(visible)) if count else NOTHING,
        "px_count_all": whole["pixels"],
        "px_count_valid": 0,
        "px_count_visib": count,
        "visib_fract": count / whole["pixels"],
    }


def targets(entry: dict[str, Any]) -> Iterator[dict[str, int]]:
    """Targets of the challenge in an image; each lamp has one instance."""
    for pose, info in zip(entry["scene_gt"], entry["scene_gt_info"], strict=True):
        if info["visib_fract"] >= MIN_TARGET:
            yield {"im_id": entry["frame"], "inst_count": 1, "obj_id": pose["obj_id"], "scene_id": 0}


class Bop(Plain):
    name = "bop"
    images = f"{SCENE}/gray"
    formats = ("png",)

    def frame_files(self, truth: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
        for i, (_, lamp) in enumerate(seen(truth)):
            name = f"{truth['frame']:06d}_{i:06d}.png"
            png = mask_png(from_run_lengths(lamp["mask"]))
            yield f"{SCENE}/mask/{name}", png
            if lamp["mask_visible"] != lamp["mask"]:
                png = mask_png(from_run_lengths(lamp["mask_visible"]))
            yield f"{SCENE}/mask_visib/{name}", png

    def entry(self, truth: dict[str, Any]) -> dict[str, Any]:
        return {
            **super().entry(truth),
            "scene_camera": self._camera_entry(truth),
            "scene_gt": [self._pose(number, lamp) for number, lamp in seen(truth)],
            "scene_gt_info": [lamp_info(lamp) for _, lamp in seen(truth)],
        }

    def set_files(self, entries: list[dict[str, Any]], ending: str) -> Iterator[tuple[str, bytes]]:
        yield from super().set_files(entries, ending)
        for name in ("scene_camera", "scene_gt", "scene_gt_info"):
            table = {str(entry["frame"]): entry[name] for entry in entries}
            yield f"{SCENE}/{name}.json", json_bytes(table)
        yield "camera.json", json_bytes(self._camera())
        infos = {str(i): model_info(lamp) for i, lamp in enumerate(self.scene.lamps, 1)}
        for folder in ("models", "models_eval"):
            yield f"{folder}/models_info.json", json_bytes(infos)
            for i, lamp in enumerate(self.scene.lamps, 1):
                yield f"{folder}/obj_{i:06d}.ply", model_ply(lamp)
        yield "test_targets_bop19.json", json_bytes([t for entry in entries for t in targets(entry)])

    def _camera(self) -> dict[str, Any]:
        c = self.scene.camera
        size = {"width": c.width, "height": c.height, "depth_scale": 1.0}
        return {**size, "fx": c.fx_px, "fy": c.fy_px, "cx": c.cx_px, "cy": c.cy_px}

    def _camera_entry(self, truth: dict[str, Any]) -> dict[str, Any]:
        """Entry of scene_camera.json. BOP has no lens distortion; non-zero coefficients are added in OpenCV's order."""
        pose = np.asarray(truth["cam_from_world"])
        entry = {
            "cam_K": self.scene.camera.matrix.ravel().tolist(),
            "depth_scale": 1.0,
            "cam_R_w2c": pose[:3, :3].ravel().tolist(),
            "cam_t_w2c": (MM * pose[:3, 3]).tolist(),
        }
        distortion = [float(k) for k in self.scene.camera.distortion]
        return {**entry, "distortion": distortion} if any(distortion) else entry

    def _pose(self, number: int, lamp: dict[str, Any]) -> dict[str, Any]:
        model = world_from_lamp(self.scene.lamps[number - 1])
        pose = np.asarray(lamp["cam_from_world"]) @ model
        return {
            "cam_R_m2c": pose[:3, :3].ravel().tolist(),
            "cam_t_m2c": (MM * pose[:3, 3]).tolist(),
            "obj_id": number,
            "lamp_id": lamp["id"],
        }
