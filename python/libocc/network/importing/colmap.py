# SPDX-License-Identifier: Apache-2.0
"""Sparse models of COLMAP: a folder with cameras, images and points3D as .txt or .bin.

Pixels have the left upper corner of the first pixel at (0, 0). Format: COLMAP's documentation, "Output Format" and
"Camera Models" (colmap.github.io).
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._core import Camera, Network, Target
from ..tables import decoded
from .fields import Fields, Imported

SIGMA_PX = 1.0  # COLMAP states none
PARTS = ("cameras", "images", "points3D")

# Names of the parameters by COLMAP's number of the model.
MODELS: dict[int, tuple[str, tuple[str, ...]]] = {
    0: ("SIMPLE_PINHOLE", ("f", "cx", "cy")),
    1: ("PINHOLE", ("fx", "fy", "cx", "cy")),
    2: ("SIMPLE_RADIAL", ("f", "cx", "cy", "k1")),
    3: ("RADIAL", ("f", "cx", "cy", "k1", "k2")),
    4: ("OPENCV", ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")),
    5: ("OPENCV_FISHEYE", ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")),
    6: ("FULL_OPENCV", ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
    8: ("SIMPLE_RADIAL_FISHEYE", ("f", "cx", "cy", "k1")),
    9: ("RADIAL_FISHEYE", ("f", "cx", "cy", "k1", "k2")),
}
OTHER_MODELS = {7: "FOV", 10: "THIN_PRISM_FISHEYE"}
BY_NAME = {name: parameters for name, parameters in MODELS.values()}
FISHEYE = ("OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE")
LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")  # OpenCV's order


@dataclass
class Picture:
    where: str
    key: int
    pose: NDArray[np.float64]  # qw qx qy qz tx ty tz
    camera: int
    name: str
    pixels: NDArray[np.float64]  # (n, 2)
    points: list[int]  # -1: none


def is_colmap(path: Path) -> bool:
    return path.is_dir() and any((path / f"cameras{suffix}").exists() for suffix in (".txt", ".bin"))


def make_camera(where: str, model: str, size: tuple[int, int], values: list[float]) -> tuple[Camera, list[str]]:
    """Camera and the names of the parameters that COLMAP refines by default."""
    if model not in BY_NAME:
        raise ValueError(f"{where}: field `model`: must be one of {', '.join(BY_NAME)}, got {model!r}")
    names = BY_NAME[model]
    if len(values) != len(names):
        raise ValueError(f"{where}: field `parameters`: must be {len(names)} ({', '.join(names)}), got {len(values)}")
    given = dict(zip(names, values))
    fx, fy = given.get("fx", given.get("f", 0.0)), given.get("fy", given.get("f", 0.0))
    order = ("k1", "k2", "k3", "k4") if model in FISHEYE else LENS
    lens = [name for name in names if name in order]
    count = 0 if not lens else 8 if "k6" in lens else 4
    make = Camera.fisheye if model in FISHEYE else Camera.pinhole
    try:
        camera = make(
            width=size[0], height=size[1], fx_px=fx, fy_px=fy, cx_px=given["cx"] - 0.5, cy_px=given["cy"] - 0.5,
            distortion=[given.get(name, 0.0) for name in order[:count]],
        )
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    return camera, [*(["f_px"] if "f" in given else ["fx_px", "fy_px"]), *lens]


class TextModel:
    def __init__(self, folder: Path):
        self.folder = folder

    def lines(self, part: str, blank: bool = False) -> Iterator[Fields]:
        path = self.folder / f"{part}.txt"
        for number, line in enumerate(decoded(path, path.read_bytes()).splitlines(), 1):
            if line.startswith("#") or not (blank or line.strip()):
                continue
            yield Fields(path, number, line.split())

    def cameras(self) -> Iterator[tuple[str, int, str, tuple[int, int], list[float]]]:
        for line in self.lines("cameras"):
            line.require(("camera", "model", "width", "height"), more=True)
            values = [line.number(k, "parameters") for k in range(4, len(line))]
            size = line.integer(2, "width", 1), line.integer(3, "height", 1)
            yield line.where, line.integer(0, "camera"), line.text(1, "model"), size, values

    def images(self) -> Iterator[Picture]:
        lines = self.lines("images", blank=True)
        head = ("image", "qw", "qx", "qy", "qz", "tx", "ty", "tz", "camera", "name")
        for line in lines:
            if not line.cells:
                continue
            line.require(head, more=True)
            seen = next(lines, None)
            if seen is None:
                raise ValueError(f"{line.where}: must be followed by the line of the image's points")
            if len(seen) % 3:
                raise ValueError(f"{seen.where}: must have three fields for each point, got {len(seen)}")
            triples = range(0, len(seen), 3)
            pixels = np.array([[seen.number(k, "x"), seen.number(k + 1, "y")] for k in triples]).reshape(-1, 2)
            yield Picture(
                line.where, line.integer(0, "image"), line.vector(1, head[1:8]), line.integer(8, "camera"),
                " ".join(line.cells[9:]), pixels, [seen.integer(k + 2, "point", -1) for k in triples],
            )

    def points(self) -> Iterator[tuple[str, int, NDArray[np.float64]]]:
        for line in self.lines("points3D"):
            line.require(("point", "x", "y", "z"), more=True)
            yield line.where, line.integer(0, "point", 0), line.vector(1, ("x", "y", "z"))


class Binary:
    """Reads little-endian values; errors name file, byte and what is missing."""

    def __init__(self, path: Path):
        self.path, self.data, self.at = path, path.read_bytes(), 0

    @property
    def where(self) -> str:
        return f"{self.path}: byte {self.at}"

    def read(self, format_: str, what: str) -> tuple[float, ...]:
        size = struct.calcsize("<" + format_)
        if self.at + size > len(self.data):
            raise ValueError(f"{self.where}: the file ends before the {what}")
        values = struct.unpack_from("<" + format_, self.data, self.at)
        self.at += size
        return values

    def count(self, what: str, item_size: int) -> int:
        """A number of items of at least item_size bytes that must follow."""
        (count,) = self.read("Q", f"number of {what}")
        if count * item_size > len(self.data) - self.at:
            raise ValueError(f"{self.where}: the file is too short for {count} {what}")
        return int(count)

    def text(self, what: str) -> str:
        end = self.data.find(b"\0", self.at)
        if end < 0:
            raise ValueError(f"{self.where}: the {what} has no end")
        try:
            text = self.data[self.at:end].decode()
        except UnicodeDecodeError:
            raise ValueError(f"{self.where}: the {what} is not UTF-8") from None
        self.at = end + 1
        return text

    def finish(self) -> None:
        if self.at != len(self.data):
            raise ValueError(f"{self.where}: {len(self.data) - self.at} bytes are left at the end of the file")


class BinaryModel:
    def __init__(self, folder: Path):
        self.folder = folder

    def cameras(self) -> Iterator[tuple[str, int, str, tuple[int, int], list[float]]]:
        file = Binary(self.folder / "cameras.bin")
        for _ in range(file.count("cameras", 24)):
            where = file.where
            key, model, width, height = (int(v) for v in file.read("iiQQ", "camera"))
            if model not in MODELS:
                shown = OTHER_MODELS.get(model, str(model))
                raise ValueError(f"{where}: field `model`: must be one of {', '.join(BY_NAME)}, got {shown!r}")
            name, parameters = MODELS[model]
            yield where, key, name, (width, height), [float(v) for v in file.read(f"{len(parameters)}d", "parameters")]
        file.finish()

    def images(self) -> Iterator[Picture]:
        file = Binary(self.folder / "images.bin")
        for _ in range(file.count("images", 64)):
            where = file.where
            key, *pose, camera = file.read("i7di", "image")
            name = file.text("name of the image")
            count = file.count("image points", 24)
            seen = np.frombuffer(file.data, dtype=[("at", "<f8", 2), ("point", "<i8")], count=count, offset=file.at)
            file.at += 24 * count
            yield Picture(
                where, int(key), np.array(pose), int(camera), name, np.array(seen["at"]).reshape(-1, 2),
                [int(p) for p in seen["point"]],
            )
        file.finish()

    def points(self) -> Iterator[tuple[str, int, NDArray[np.float64]]]:
        file = Binary(self.folder / "points3D.bin")
        for _ in range(file.count("points", 51)):
            where = file.where
            key, x, y, z, _, _, _, _ = file.read("Q3d3Bd", "point")
            track = file.count("images of a point", 8)
            file.at += 8 * track
            yield where, int(key), np.array([x, y, z])
        file.finish()


def pose_of(image: Picture) -> NDArray[np.float64]:
    w, x, y, z = quaternion = image.pose[:4]
    if not np.isfinite(image.pose).all() or abs(quaternion @ quaternion - 1) > 1e-3:
        raise ValueError(f"{image.where}: field `qw`: must be part of a unit quaternion, got {quaternion.tolist()}")
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = image.pose[4:]
    return pose


def read_colmap(folder: str | Path, *, sigma_px: float = SIGMA_PX) -> Imported:
    """Reads a sparse model of COLMAP; of both kinds of files the binary ones. sigma_px: of all image points.

    Raises: OSError; ValueError naming file, line or byte, field and value.
    """
    folder = Path(folder)
    binary = (folder / "cameras.bin").exists()
    suffix = ".bin" if binary else ".txt"
    for part in PARTS:
        if not (folder / f"{part}{suffix}").exists():
            raise ValueError(f"{folder}: has no {part}{suffix}")
    model = BinaryModel(folder) if binary else TextModel(folder)
    network = Network()
    cameras: dict[int, int] = {}
    for where, key, name, size, values in model.cameras():
        if key in cameras:
            raise ValueError(f"{where}: camera {key} occurs twice")
        camera, free = make_camera(where, name, size, values)
        cameras[key] = network.add_camera(f"camera {key}", camera, free)
    points: dict[int, int] = {}
    for where, key, position in model.points():
        if key in points:
            raise ValueError(f"{where}: point {key} occurs twice")
        if not np.isfinite(position).all():
            raise ValueError(f"{where}: field `x`: must be finite, got {position.tolist()}")
        points[key] = network.add_point(str(key), position)
    duplicates = 0
    names: set[str] = set()
    for image in model.images():
        if image.camera not in cameras:
            raise ValueError(f"{image.where}: field `camera`: must be one of {list(cameras)[:8]}, got {image.camera}")
        if image.name in names:
            raise ValueError(f"{image.where}: image {image.name!r} occurs twice")
        names.add(image.name)
        index = network.add_image(image.name, cameras[image.camera], pose_of(image))
        chosen: dict[int, int] = {}
        for k, point in enumerate(image.points):
            if point < 0:
                continue
            if point not in points:
                raise ValueError(f"{image.where}: image {image.name!r} observes point {point}, which does not exist")
            if point in chosen:
                duplicates += 1
            else:
                chosen[point] = k
        if not np.isfinite(image.pixels).all():
            raise ValueError(f"{image.where}: image {image.name!r} has a pixel that is not finite")
        if chosen:
            pixels = image.pixels[list(chosen.values())] - 0.5
            network.observe(index, [Target.point(points[point]) for point in chosen], pixels, sigma_px)
    notes = [
        f"COLMAP states no standard deviations: {sigma_px:g} px are assumed",
        "principal points are kept fixed, as COLMAP does by default",
    ]
    if (folder / f"rigs{suffix}").exists():
        notes.append("rigs and frames are not read: every image has a pose of its own")
    if duplicates:
        notes.append(f"{duplicates} further observations of a point in one image were left out; the first one is kept")
    return Imported(network, notes=notes)
