# SPDX-License-Identifier: Apache-2.0
"""Independent reader of the BOP format, after the document "Format of BOP datasets"."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image


def load_json(path: Path) -> Any:
    """Converts keys to integers, as BOP's toolkit does."""
    def whole(pairs: dict[str, Any]) -> dict[Any, Any]:
        return {int(k) if k.lstrip("-").isdigit() else k: v for k, v in pairs.items()}

    return json.loads(path.read_text(), object_hook=whole)


def matrix(values: list[float]) -> Any:
    """3x3 matrix from a row-major list."""
    assert len(values) == 9
    return np.array(values, float).reshape(3, 3)


def column(values: list[float]) -> Any:
    assert len(values) == 3
    return np.array(values, float).reshape(3, 1)


@dataclass
class Model:
    vertices_mm: Any
    normals: Any
    faces: Any


def load_model(path: Path) -> Model:
    """ASCII PLY file of vertices with normals, and of triangles."""
    lines = iter(path.read_text().splitlines())
    assert next(lines) == "ply" and next(lines) == "format ascii 1.0"
    counts, names, element = {}, [], ""
    for line in lines:
        words = line.split()
        if words[0] == "end_header":
            break
        if words[0] == "element":
            element = words[1]
            counts[element] = int(words[2])
        elif words[0] == "property" and element == "vertex":
            names.append(words[-1])
        elif words[0] == "property":
            assert element == "face" and words[1:] == ["list", "uchar", "int", "vertex_indices"]
    rows = [[float(word) for word in next(lines).split()] for _ in range(counts["vertex"])]
    faces = [[int(word) for word in next(lines).split()] for _ in range(counts["face"])]
    assert all(face[0] == 3 for face in faces) and next(lines, None) is None
    columns = dict(zip(names, np.array(rows).T, strict=True))
    return Model(
        np.stack([columns[name] for name in ("x", "y", "z")], axis=1),
        np.stack([columns[name] for name in ("nx", "ny", "nz")], axis=1),
        np.array(faces, int).reshape(-1, 4)[:, 1:],
    )


class BopFolder:
    def __init__(self, path: Path, split: str = "test", scene_id: int = 0):
        self.path = path
        self.scene = path / split / f"{scene_id:06d}"
        self.cameras = load_json(self.scene / "scene_camera.json")
        self.truths = load_json(self.scene / "scene_gt.json")
        self.infos = load_json(self.scene / "scene_gt_info.json")
        self.targets = json.loads((path / "test_targets_bop19.json").read_text())
        self.camera = load_json(path / "camera.json")
        self.models_info = load_json(path / "models" / "models_info.json")

    def camera_matrix(self, im_id: int) -> Any:
        return matrix(self.cameras[im_id]["cam_K"])

    def world_to_camera(self, im_id: int) -> tuple[Any, Any]:
        camera = self.cameras[im_id]
        return matrix(camera["cam_R_w2c"]), column(camera["cam_t_w2c"])

    def model(self, obj_id: int, folder: str = "models") -> Model:
        return load_model(self.path / folder / f"obj_{obj_id:06d}.ply")

    def model_px(self, im_id: int, gt_id: int) -> Any:
        """Vertices of an annotated object in the image: s p = K [R t] p_m."""
        truth = self.truths[im_id][gt_id]
        seen = matrix(truth["cam_R_m2c"]) @ self.model(truth["obj_id"]).vertices_mm.T + column(truth["cam_t_m2c"])
        image = self.camera_matrix(im_id) @ seen
        return (image[:2] / image[2]).T

    def image(self, im_id: int) -> Any:
        return np.asarray(Image.open(self.scene / "gray" / f"{im_id:06d}.png"))

    def mask(self, im_id: int, gt_id: int, kind: str) -> Any:
        pixels = np.asarray(Image.open(self.scene / kind / f"{im_id:06d}_{gt_id:06d}.png"))
        assert pixels.dtype == np.uint8 and set(np.unique(pixels)) <= {0, 255}
        return pixels > 0
