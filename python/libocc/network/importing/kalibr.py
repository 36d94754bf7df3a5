# SPDX-License-Identifier: Apache-2.0
"""Cameras of Kalibr: camchain.yaml with the intrinsics of each camera and the transforms between neighbours.

The cameras become mounts of a rig whose station is the first camera; such a network has no images yet. Format: Kalibr's
wiki, "Yaml formats" and "Supported models" (github.com/ethz-asl/kalibr).
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..._core import Camera, Network
from ...yaml_files import read_yaml
from ..sections import Section
from .fields import Imported

KEYS = (
    "camera_model", "intrinsics", "distortion_model", "distortion_coeffs", "resolution", "T_cn_cnm1", "T_cam_imu",
    "timeshift_cam_imu", "rostopic", "cam_overlaps",
)


def camera_names(data: Any) -> list[str]:
    keys = data if isinstance(data, dict) else {}
    names = [key for key in keys if isinstance(key, str) and re.fullmatch(r"cam\d+", key)]
    return sorted(names, key=lambda name: int(name[3:]))


def is_kalibr(path: Path) -> bool:
    if path.suffix.lower() not in (".yaml", ".yml"):
        return False
    with open(path, "rb") as file:
        return re.search(rb"^cam\d+:", file.read(4096), re.MULTILINE) is not None


def make_camera(section: Section) -> tuple[Camera, list[str]]:
    size = [int(v) for v in section.vector("resolution", 2)]
    model = section.text("camera_model")
    lens = section.data.get("distortion_model") or "none"
    common: dict[str, Any] = {"width": size[0], "height": size[1]}
    free = ["fx_px", "fy_px", "cx_px", "cy_px"]
    try:
        if model == "ds":
            xi, alpha, *focal = section.vector("intrinsics", 6)
            if lens != "none":
                raise section.fail("distortion_model", "none beside `camera_model: ds`")
            common.update(zip(("fx_px", "fy_px", "cx_px", "cy_px"), focal))
            return Camera.double_sphere(**common, xi=xi, alpha=alpha), [*free, "xi", "alpha"]
        if model != "pinhole":
            raise section.fail("camera_model", "pinhole or ds")
        common.update(zip(("fx_px", "fy_px", "cx_px", "cy_px"), section.vector("intrinsics", 4)))
        if lens == "none":
            return Camera.pinhole(**common), free
        if lens not in ("radtan", "equidistant"):
            raise section.fail("distortion_model", "radtan, equidistant or none")
        coefficients = [float(v) for v in section.vector("distortion_coeffs", 4)]
        if lens == "radtan":
            return Camera.pinhole(**common, distortion=coefficients), [*free, "k1", "k2", "p1", "p2"]
        return Camera.fisheye(**common, distortion=coefficients), [*free, "k1", "k2", "k3", "k4"]
    except ValueError as error:
        if str(section.path) in str(error):
            raise
        raise ValueError(f"{section.path}: key `{section.name}`: {error}") from None


def transform(section: Section, key: str) -> np.ndarray:
    rule = "4 rows of 4 numbers: a rotation and a translation"
    try:
        matrix = np.asarray(section.data.get(key), dtype=float)
    except (TypeError, ValueError):
        raise section.fail(key, rule) from None
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or not np.allclose(matrix[3], [0, 0, 0, 1]):
        raise section.fail(key, rule)
    left, _, right = np.linalg.svd(matrix[:3, :3])
    rotation = left @ right
    if np.linalg.det(rotation) < 0 or not np.allclose(rotation, matrix[:3, :3], atol=1e-3):
        raise section.fail(key, rule)
    matrix[:3, :3] = rotation  # Kalibr's files have about ten digits
    return matrix


def read_kalibr(path: str | Path) -> Imported:
    """Reads a camchain.yaml. Raises: OSError; ValueError naming file, key and value."""
    path = Path(path)
    data = read_yaml(path)
    names = camera_names(data)
    if not names:
        raise ValueError(f"{path}: has no camera `cam0`")
    network = Network()
    notes, ignored = [], set()
    chain = np.eye(4)
    for k, name in enumerate(names):
        section = Section(path, name, data[name], KEYS)
        camera, free = make_camera(section)
        network.add_camera(name, camera, free)
        if k and not section.has("T_cn_cnm1"):
            raise section.fail("T_cn_cnm1", "given for every camera but the first")
        chain = transform(section, "T_cn_cnm1") @ chain if k else chain
        if len(names) > 1:
            network.add_mount(name, chain, fixed=k == 0)
        ignored |= {key for key in ("T_cam_imu", "timeshift_cam_imu") if section.has(key)}
    notes.append("the file has cameras and their mounts; add stations, images and observations")
    if ignored:
        notes.append(f"{', '.join(sorted(ignored))} were ignored: a network has no inertial sensor")
    return Imported(network, notes=notes)
