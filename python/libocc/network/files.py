# SPDX-License-Identifier: Apache-2.0
"""Networks as YAML files with CSV tables beside them; the schema is described in data/calibration/README.md."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from .._core import Camera, Datum, DatumKind, Network, Target, free_start, read_camera, start_values
from ..yaml_files import read_yaml
from .poses import pose_covariance, pose_from
from .sections import KEYS, POSE, SCHEMA, SIGMA_PX, Names, Section
from .starts import similarity, transformed
from .tables import Row, read_table
from .writing import image_table, network_files

__all__ = ["SIGMA_PX", "image_table", "network_files", "read_network", "read_network_and_checks", "target_named"]


DISTANCE = ("from", "to", "length_m", "sigma_m")
CONTROL = ("target", "position_m", "sigma_m", "covariance_m2")


def square(side_m: float) -> NDArray[np.float64]:
    """Corners (4, 3) of an AprilTag in the order of detect_april_tags()."""
    return side_m / 2 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


def pose_of(row: Row) -> NDArray[np.float64]:
    """4x4 cam_from_world from columns with a position and a unit quaternion (w first)."""
    quaternion = np.array([row.number(name) for name in POSE[3:]])
    if abs(quaternion @ quaternion - 1) > 1e-6:
        raise row.fail("qw", "part of a unit quaternion")
    return pose_from(np.array([row.number(name) for name in POSE[:3]]), quaternion)


def target_named(name: str, points: dict[str, int], bodies: dict[str, int], corners: Sequence[int]) -> Target | None:
    """Target of a name: a point's name, or a body's name, a dot and the corner's number.

    corners: number of corners of each body.
    """
    if name in points:
        return Target.point(points[name])
    body, _, corner = name.rpartition(".")
    if body in bodies and corner.isdigit() and int(corner) < corners[bodies[body]]:
        return Target.corner(bodies[body], int(corner))
    return None


def check_free(section: Section, camera: Camera, free: list[str]) -> None:
    """Raises ValueError for a name that is not a free parameter of the camera."""
    known = [parameter.name for parameter in camera.parameters]
    if "fx_px" in known and "fy_px" in known:
        known.append("f_px")
    for name in free:
        if name not in known:
            raise ValueError(
                f"{section.path}: key `{section.full('free')}`: {name!r} is not a parameter of a "
                f"{camera.kind.name}; allowed: {', '.join(known)}"
            )


@dataclass
class ImageRow:
    """An image of the table; station: -1 for an image with a station of its own."""

    row: Row
    camera: int
    fixed: bool
    pose: NDArray[np.float64] | None = None
    station: int = -1
    mount: int = -1


class Reader:
    def __init__(self, path: Path):
        self.path = path
        self.file = Section(path, "", read_yaml(path), KEYS)
        self.network = Network()
        self.cameras, self.images = Names("camera"), Names("image")
        self.points, self.bodies = Names("point"), Names("body")
        self.stations, self.mounts = Names("station"), Names("mount")
        self.shapes: dict[str, list[NDArray[np.float64]]] = {}
        self.corners: list[int] = []  # number of corners of each body
        self.image_rows: list[ImageRow] = []
        self.point_rows: list[tuple[Row, NDArray[np.float64] | None]] = []
        self.seen: list[tuple[int, Target, NDArray[np.float64], NDArray[np.float64]]] = []

    def table(self, key: str) -> Path:
        return self.path.parent / self.file.text(key)

    def target(self, name: str, where: str) -> Target:
        """Target of a name. Raises: ValueError with the location in the file when there is none."""
        found = target_named(name, self.points.indices, self.bodies.indices, self.corners)
        return found or Target.point(self.points.find(name, where))

    def read_cameras(self) -> None:
        for section in self.file.sections("cameras", ("name", "file", "free")):
            camera = read_camera(self.path.parent / section.text("file"))
            free = section.texts("free")
            check_free(section, camera, free)
            index = self.network.add_camera(section.text("name"), camera, free)
            self.cameras.add(section.text("name"), index, str(self.path))
        if not self.cameras.indices:
            raise self.file.fail("cameras", "a list of at least one camera")

    def read_rigs(self) -> None:
        for key, names, add in (
            ("stations", self.stations, self.network.add_station), ("mounts", self.mounts, self.network.add_mount),
        ):
            if not self.file.has(key):
                continue
            for row in read_table(self.table(key), ("name", *POSE), ("fixed",)):
                index = add(row.text("name"), pose_of(row), row.flag("fixed"))
                names.add(row.text("name"), index, f"{row.path}:{row.line}")

    def read_images(self) -> None:
        """Reads the images; those without a start value of the pose are added by add_elements()."""
        stations = [np.asarray(pose) for pose in self.network.station_poses]
        mounts = [np.asarray(pose) for pose in self.network.mount_poses]
        for row in read_table(self.table("images"), ("name", "camera"), (*POSE, "station", "mount", "fixed")):
            camera = self.cameras.find(row.text("camera"), row.where)
            image = ImageRow(row, camera, fixed=row.flag("fixed"))
            if row.has("station"):
                if image.fixed:
                    raise row.fail("fixed", "0 or empty beside `station`; fix the station and the mount")
                image.station = self.stations.find(row.text("station"), row.where)
                image.mount = self.mounts.find(row.text("mount"), row.where) if row.has("mount") else -1
                image.pose = stations[image.station]
                if image.mount >= 0:
                    image.pose = mounts[image.mount] @ image.pose
            elif any(row.has(name) for name in POSE):
                image.pose = pose_of(row)
            elif image.fixed:
                raise row.fail("fixed", "0 or empty without a pose")
            self.images.add(row.text("name"), len(self.image_rows), row.where)
            self.image_rows.append(image)

    def read_points(self) -> None:
        """Reads the points; those without a start value of the position are added by add_elements()."""
        if not self.file.has("points"):
            return
        for row in read_table(self.table("points"), ("name",), (*POSE[:3], "fixed")):
            position = None
            if any(row.has(name) for name in POSE[:3]):
                position = np.array([row.number(name) for name in POSE[:3]])
            elif row.flag("fixed"):
                raise row.fail("fixed", "0 or empty without a position")
            self.points.add(row.text("name"), len(self.point_rows), row.where)
            self.point_rows.append((row, position))

    def read_shapes(self) -> None:
        if not self.file.has("shapes"):
            return
        for row in read_table(self.table("shapes"), ("shape", "x_m", "y_m", "z_m")):
            corners = self.shapes.setdefault(row.text("shape"), [])
            corners.append(np.array([row.number(name) for name in POSE[:3]]))

    def read_bodies(self) -> None:
        if not self.file.has("bodies"):
            return
        for row in read_table(self.table("bodies"), ("name", *POSE), ("side_m", "shape", "scale_free", "fixed")):
            if row.has("shape"):
                if row.text("shape") not in self.shapes:
                    raise row.fail("shape", f"one of {', '.join(self.shapes) or 'none: `shapes` names no table'}")
                corners = np.array(self.shapes[row.text("shape")])
            else:
                corners = square(row.number("side_m"))
                if not row.number("side_m") > 0:
                    raise row.fail("side_m", "positive")
            pose = np.linalg.inv(pose_of(row))  # the table has world_from_body
            index = self.network.add_body(
                row.text("name"), corners, pose, scale_free=row.flag("scale_free"), fixed=row.flag("fixed")
            )
            self.bodies.add(row.text("name"), index, f"{row.path}:{row.line}")
            self.corners.append(len(corners))

    def read_observations(self) -> None:
        columns = ("image", "target", "x_px", "y_px")
        seen: dict[tuple[int, str], list[tuple[int, float]]] = {}  # lines and columns of a target in an image
        for row in read_table(self.table("observations"), columns, ("sigma_x_px", "sigma_y_px")):
            sigma_x = row.number("sigma_x_px", SIGMA_PX)
            sigma = np.array([sigma_x, row.number("sigma_y_px", sigma_x)])
            if not (sigma > 0).all():
                raise row.fail("sigma_x_px" if not sigma[0] > 0 else "sigma_y_px", "positive")
            image = self.images.find(row.text("image"), row.where)
            pixel = np.array([row.number("x_px"), row.number("y_px")])
            same = seen.setdefault((image, row.text("target")), [])
            for line, x_px in same:
                self.refuse_duplicate(row, image, line, x_px)
            same.append((row.line, pixel[0]))
            self.seen.append((image, self.target(row.text("target"), row.where), pixel, sigma))

    def add_elements(self) -> None:
        """Adds points, images and observations, with start values from resections and intersections where needed."""
        poses = {k: image.pose for k, image in enumerate(self.image_rows) if image.pose is not None}
        positions = {k: position for k, (_, position) in enumerate(self.point_rows) if position is not None}
        if len(poses) < len(self.image_rows) or len(positions) < len(self.point_rows):
            poses, positions = self.start_values(poses, positions)
        for k, (row, _) in enumerate(self.point_rows):
            self.network.add_point(row.text("name"), positions[k], row.flag("fixed"))
        for k, image in enumerate(self.image_rows):
            name, station = image.row.text("name"), image.station
            if station < 0:
                station = self.network.add_station(name, poses[k], image.fixed)
            self.network.add_image(name, image.camera, station=station, mount=image.mount)
        for index, target, pixel, sigma in self.seen:
            self.network.observe(index, [target], pixel[None], sigma)

    def start_values(
        self, poses: dict[int, NDArray[np.float64]], positions: dict[int, NDArray[np.float64]]
    ) -> tuple[dict[int, NDArray[np.float64]], dict[int, NDArray[np.float64]]]:
        """All poses and positions. Raises: ValueError naming the first element that has none."""
        cameras = self.network.cameras
        seen: list[dict[int, NDArray[np.float64]]] = [{} for _ in self.image_rows]
        known = dict(positions)
        corners: dict[Target, int] = {}
        for number, target, pixel, _ in self.seen:
            key = target.point_index
            if key < 0:
                key = corners.setdefault(target, len(self.point_rows) + len(corners))
                known[key] = np.asarray(self.network.position_m(target))
            seen[number][key] = pixel
        for target, position in self.control_positions():
            if target.point_index >= 0:
                known.setdefault(target.point_index, position)
        of_image = [cameras[image.camera] for image in self.image_rows]
        found, points = start_values(of_image, cast(Any, seen), cast(Any, known), cast(Any, poses))
        if not found:
            found, points = self.free_start(of_image, seen, known) or (found, points)
        for k, image in enumerate(self.image_rows):
            if k not in found:
                count = sum(key in points for key in seen[k])
                raise ValueError(
                    f"{image.row.where}: image {image.row.text('name')!r} has no pose and shows {count} targets with "
                    "known positions; give its pose, or the positions of four of its targets"
                )
        for k, (row, _) in enumerate(self.point_rows):
            if k not in points:
                raise ValueError(
                    f"{row.where}: point {row.text('name')!r} has no position and is not visible from two directions; "
                    "give its position"
                )
        return found, points

    def control_positions(self) -> list[tuple[Target, NDArray[np.float64]]]:
        return [
            (self.target(section.text("target"), str(self.path)), section.vector("position_m", 3))
            for section in self.file.sections("control", CONTROL)
        ]

    def free_start(
        self, cameras: list[Camera], seen: list[dict[int, NDArray[np.float64]]], known: dict[int, NDArray[np.float64]]
    ) -> tuple[dict[int, NDArray[np.float64]], dict[int, NDArray[np.float64]]] | None:
        """Start values from image points alone, in the frame of three known points or scaled by a distance.

        None if there are one or two known points, which do not determine a frame, or no relative orientation.
        """
        started = free_start(cameras, cast(Any, seen))
        if started is None:
            return None
        poses, points = started
        if known:
            both = [key for key in known if key in points]
            if len(both) < 3:
                return None
            frame = similarity(np.array([points[k] for k in both]), np.array([known[k] for k in both]))
            return None if frame is None else transformed(poses, points, *frame)
        ratios = []
        for section in self.file.sections("distances", DISTANCE):
            start, end = (self.target(section.text(key), str(self.path)).point_index for key in ("from", "to"))
            if start in points and end in points:
                ratios.append(section.positive("length_m") / float(np.linalg.norm(points[end] - points[start])))
        scale = float(np.median(ratios)) if ratios else 1.0
        return transformed(poses, points, scale, np.eye(3), np.zeros(3))

    def refuse_duplicate(self, row: Row, image: int, first_line: int, first_x_px: float) -> None:
        """Raises ValueError for a target that occurs twice in an image.

        A panorama of more than a full rotation may show a target twice, at columns that are a period apart.
        """
        period = self.network.cameras[self.image_rows[image].camera].period_px
        if abs(row.number("x_px") - first_x_px) > period / 2:
            return
        raise ValueError(
            f"{row.where}: target {row.text('target')!r} occurs twice in image {row.text('image')!r}, "
            f"first in line {first_line}; keep one of the two observations"
        )

    def read_constraints(self) -> None:
        where = str(self.path)
        for section in self.file.sections("distances", DISTANCE):
            start, end = (self.target(section.text(key), where) for key in ("from", "to"))
            self.network.add_distance(start, end, section.positive("length_m"), section.positive("sigma_m"))
        for section in self.file.sections("control", CONTROL):
            if section.one_of("sigma_m", "covariance_m2") == "sigma_m":
                covariance = np.diag(section.sigmas("sigma_m") ** 2)
            else:
                covariance = section.covariance("covariance_m2", 3)
            target = self.target(section.text("target"), where)
            self.network.add_control(target, section.vector("position_m", 3), covariance)
        for section in self.file.sections("priors", ("camera", "parameter", "value", "sigma")):
            self.network.add_parameter_prior(
                self.cameras.find(section.text("camera"), where), section.text("parameter"),
                section.number("value"), section.positive("sigma"),
            )

    def read_pose_priors(self) -> None:
        keys = ("image", "station", "position_m", "quaternion", "sigma_rad", "sigma_m", "covariance")
        for section in self.file.sections("pose_priors", keys):
            where = f"{self.path}: key `{section.name}`"
            if section.one_of("image", "station") == "image":
                image = self.images.find(section.text("image"), where)
                if self.network.image_mounts[image] >= 0:
                    raise section.fail("image", "an image without a mount; give the pose of its station instead")
                station = self.network.image_stations[image]
            else:
                station = self.stations.find(section.text("station"), where)
            quaternion = section.vector("quaternion", 4)
            if abs(quaternion @ quaternion - 1) > 1e-6:
                raise section.fail("quaternion", "a unit quaternion")
            pose = pose_from(section.vector("position_m", 3), quaternion)
            if section.one_of("sigma_rad", "covariance") == "covariance":
                if section.has("sigma_m"):
                    raise section.fail("sigma_m", "omitted beside `covariance`")
                covariance = section.covariance("covariance", 6)
            else:
                covariance = pose_covariance(pose, section.sigmas("sigma_rad"), section.sigmas("sigma_m"))
            self.network.add_pose_prior(station, pose, covariance)

    def check_points(self) -> dict[str, list[float]]:
        """Positions of check points by name; they are compared with the result and are not used in the adjustment."""
        checks: dict[str, list[float]] = {}
        if self.file.has("check_points"):
            for row in read_table(self.table("check_points"), ("name", "x_m", "y_m", "z_m")):
                self.points.find(row.text("name"), f"{row.path}:{row.line}")
                checks[row.text("name")] = [row.number(name) for name in POSE[:3]]
        return checks

    def datum(self) -> Datum:
        if not self.file.has("datum"):
            return Datum()
        section = Section(self.path, "datum", self.file.data["datum"], ("kind", "targets"))
        kind = section.text("kind")
        if kind not in DatumKind.__members__:
            raise section.fail("kind", f"one of {', '.join(DatumKind.__members__)}")
        targets = [self.target(name, str(self.path)) for name in section.texts("targets")]
        return Datum(kind=DatumKind[kind], targets=targets)


def read_network(path: str | Path) -> tuple[Network, Datum]:
    """Reads a network and the datum specified in its file.

    Raises: OSError; ValueError naming file, line, key or column, and value.
    """
    network, datum, _ = read_network_and_checks(path)
    return network, datum


def read_network_and_checks(path: str | Path) -> tuple[Network, Datum, dict[str, list[float]]]:
    """Reads a network, the datum specified in its file, and its check points by name.

    Raises: OSError; ValueError naming file, line, key or column, and value.
    """
    reader = Reader(Path(path))
    if reader.file.data.get("schema") != SCHEMA:
        raise reader.file.fail("schema", SCHEMA)
    reader.read_cameras()
    reader.read_points()
    reader.read_shapes()
    reader.read_bodies()
    reader.read_rigs()
    reader.read_images()
    reader.read_observations()
    reader.add_elements()
    reader.read_constraints()
    reader.read_pose_priors()
    try:
        reader.network.check()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return reader.network, reader.datum(), reader.check_points()
