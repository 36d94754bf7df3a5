# SPDX-License-Identifier: Apache-2.0
"""Cameras and targets of Kalibr.

camchain.yaml has the intrinsics of each camera and the transforms between neighbours: the cameras become mounts of a
rig whose station is the first camera. A target file describes a grid of AprilTags or a chessboard, which becomes a
fixed body. Such a network has no images yet. Format: Kalibr's wiki, "Yaml formats", "Supported models" and
"Calibration targets" (github.com/ethz-asl/kalibr).
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import AprilGrid, Camera, Network
from ...yaml_files import read_yaml
from ..sections import Section
from .fields import Imported

TARGET_KEYS = (
    "target_type", "tagCols", "tagRows", "tagSize", "tagSpacing", "targetCols", "targetRows", "rowSpacingMeters",
    "colSpacingMeters", "codeOffset",
)
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


def transform(section: Section, key: str) -> NDArray[np.float64]:
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


def count(section: Section, key: str) -> int:
    value = section.number(key)
    if value < 1 or value % 1:
        raise section.fail(key, "a whole number, 1 or more")
    return int(value)


def target_corners(path: Path) -> NDArray[np.float64]:
    """Corners (n, 3) [m] of a target, x along its columns and y along its rows, upwards.

    A grid of AprilTags starts with the tag on the lower left, row by row; each tag has four corners in the order of
    detect_april_tags(). A chessboard has its inner corners, row by row.
    """
    section = Section(path, "", read_yaml(path), TARGET_KEYS)
    kind = section.text("target_type")
    if kind == "aprilgrid":
        side, gap = section.positive("tagSize"), section.positive("tagSpacing")
        rows, columns = count(section, "tagRows"), count(section, "tagCols")
        pitch = side * (1 + gap)  # the spacing is a part of the tag's side
        corner = side * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        return np.concatenate([
            corner + [pitch * column, pitch * row, 0] for row in range(rows) for column in range(columns)
        ])
    if kind == "checkerboard":
        across, up = section.positive("colSpacingMeters"), section.positive("rowSpacingMeters")
        rows, columns = count(section, "targetRows"), count(section, "targetCols")
        return np.array([[across * column, up * row, 0.0] for row in range(rows) for column in range(columns)])
    raise section.fail("target_type", "aprilgrid or checkerboard")


def read_april_grid(path: Path, family: str = "tag36h11", border_cells: int = 2) -> AprilGrid:
    """The grid of AprilTags of a target file of Kalibr. Raises: OSError; ValueError naming file, key and value."""
    section = Section(path, "", read_yaml(path), TARGET_KEYS)
    if section.text("target_type") != "aprilgrid":
        raise section.fail("target_type", "aprilgrid")
    if section.has("codeOffset") and section.number("codeOffset") != 0:
        raise section.fail("codeOffset", "0: ids start at the lower left tag")
    try:
        board = AprilGrid(
            columns=count(section, "tagCols"), rows=count(section, "tagRows"), tag_size_m=section.positive("tagSize"),
            spacing=section.positive("tagSpacing"), family=family, border_cells=border_cells,
        )
    except ValueError as error:
        raise ValueError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    return board


def read_kalibr(path: str | Path, *, target: str | Path | None = None) -> Imported:
    """Reads a camchain.yaml, and the file of a target if it is given.

    Raises: OSError; ValueError naming file, key and value.
    """
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
    if target is not None:
        network.add_body("target", target_corners(Path(target)), np.eye(4), fixed=True)
    notes.append("the file has cameras and their mounts; add stations, images and observations")
    if ignored:
        notes.append(f"{', '.join(sorted(ignored))} were ignored: a network has no inertial sensor")
    return Imported(network, notes=notes)
