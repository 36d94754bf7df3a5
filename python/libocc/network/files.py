# SPDX-License-Identifier: Apache-2.0
"""Networks as YAML files with CSV tables beside them; the schema is described in data/calibration/README.md."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Datum, DatumKind, Network, Target, format_camera, read_camera
from ..yaml_files import read_yaml
from .tables import Row, read_table, table_bytes

SCHEMA = "libocc-network/1"
KEYS = (
    "schema", "cameras", "stations", "mounts", "images", "points", "shapes", "bodies", "observations", "distances",
    "control", "priors", "datum", "check_points",
)
POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
SIGMA_PX = 0.5  # default of the tables


def square(side_m: float) -> NDArray[np.float64]:
    """Corners (4, 3) of an AprilTag in the order of detect_april_tags()."""
    return side_m / 2 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


class Section:
    """A mapping in the file; its errors name file, key and value."""

    def __init__(self, path: Path, name: str, data: Any, known: tuple[str, ...]):
        self.path, self.name, self.data = path, name, data
        if not isinstance(data, dict):
            raise ValueError(f"{path}: key `{name}`: must be a mapping, got {data!r}")
        for key in data:
            if key not in known:
                raise ValueError(f"{path}: key `{self.full(key)}`: is unknown; allowed: {', '.join(known)}")

    def full(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def fail(self, key: str, rule: str) -> ValueError:
        return ValueError(f"{self.path}: key `{self.full(key)}`: must be {rule}, got {self.data.get(key)!r}")

    def has(self, key: str) -> bool:
        return self.data.get(key) is not None

    def text(self, key: str) -> str:
        value = self.data.get(key)
        if not isinstance(value, (str, int)) or value == "":
            raise self.fail(key, "a text")
        return str(value)

    def number(self, key: str) -> float:
        value = self.data.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise self.fail(key, "a finite number")
        return float(value)

    def positive(self, key: str) -> float:
        value = self.number(key)
        if not value > 0:
            raise self.fail(key, "positive")
        return value

    def vector(self, key: str, size: int) -> NDArray[np.float64]:
        try:
            vector = np.asarray(self.data.get(key), dtype=float)
        except (TypeError, ValueError):
            raise self.fail(key, f"a list of {size} numbers") from None
        if vector.shape != (size,) or not np.isfinite(vector).all():
            raise self.fail(key, f"a list of {size} numbers")
        return vector

    def texts(self, key: str) -> list[str]:
        value = self.data.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, (str, int)) for item in value):
            raise self.fail(key, "a list of names")
        return [str(item) for item in value]

    def sections(self, key: str, known: tuple[str, ...]) -> list["Section"]:
        value = self.data.get(key) or []
        if not isinstance(value, list):
            raise self.fail(key, "a list")
        return [Section(self.path, f"{self.full(key)}[{i}]", item, known) for i, item in enumerate(value)]


class Names:
    """Indices by name; raises ValueError for a duplicate or unknown name."""

    def __init__(self, kind: str):
        self.kind = kind
        self.indices: dict[str, int] = {}

    def add(self, name: str, index: int, where: str) -> None:
        if name in self.indices:
            raise ValueError(f"{where}: {self.kind} {name!r} occurs twice")
        self.indices[name] = index

    def find(self, name: str, where: str) -> int:
        if name not in self.indices:
            known = ", ".join(list(self.indices)[:8]) or "none"
            raise ValueError(f"{where}: no {self.kind} is named {name!r}; existing names: {known}")
        return self.indices[name]


def pose_of(row: Row) -> NDArray[np.float64]:
    """4x4 cam_from_world from columns with a position and a unit quaternion (w first)."""
    w, x, y, z = quaternion = np.array([row.number(name) for name in POSE[3:]])
    if abs(quaternion @ quaternion - 1) > 1e-6:
        raise row.fail("qw", "part of a unit quaternion")
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = -rotation @ [row.number(name) for name in POSE[:3]]
    return pose


def pose_columns(pose: NDArray[np.float64]) -> list[float]:
    """Columns of a pose: inverse of pose_of() up to rounding errors."""
    r = pose[:3, :3]
    eigenvalues, vectors = np.linalg.eigh(np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
        [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
    ]))
    quaternion = vectors[:, np.argmax(eigenvalues)]
    if quaternion[0] < 0:
        quaternion = -quaternion
    return [float(v) for v in (*(-r.T @ pose[:3, 3]), *quaternion)]


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
            known = [parameter.name for parameter in camera.parameters]
            for name in free:
                if name not in known:
                    raise ValueError(
                        f"{self.path}: key `{section.full('free')}`: {name!r} is not a parameter of a "
                        f"{camera.kind.name}; allowed: {', '.join(known)}"
                    )
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
        for row in read_table(self.table("images"), ("name", "camera"), (*POSE, "station", "mount")):
            where, name = f"{row.path}:{row.line}", row.text("name")
            camera = self.cameras.find(row.text("camera"), where)
            if row.has("station"):
                station = self.stations.find(row.text("station"), where)
                mount = self.mounts.find(row.text("mount"), where) if row.has("mount") else -1
                index = self.network.add_image(name, camera, station=station, mount=mount)
            else:
                index = self.network.add_image(name, camera, pose_of(row))
            self.images.add(name, index, where)

    def read_points(self) -> None:
        if not self.file.has("points"):
            return
        for row in read_table(self.table("points"), ("name", "x_m", "y_m", "z_m"), ("fixed",)):
            position = [row.number(name) for name in POSE[:3]]
            index = self.network.add_point(row.text("name"), position, row.flag("fixed"))
            self.points.add(row.text("name"), index, f"{row.path}:{row.line}")

    def read_shapes(self) -> None:
        if not self.file.has("shapes"):
            return
        for row in read_table(self.table("shapes"), ("shape", "x_m", "y_m", "z_m")):
            corners = self.shapes.setdefault(row.text("shape"), [])
            corners.append(np.array([row.number(name) for name in POSE[:3]]))

    def read_bodies(self) -> None:
        if not self.file.has("bodies"):
            return
        for row in read_table(self.table("bodies"), ("name", *POSE), ("side_m", "shape", "scale_free")):
            if row.has("shape"):
                if row.text("shape") not in self.shapes:
                    raise row.fail("shape", f"one of {', '.join(self.shapes) or 'none: `shapes` names no table'}")
                corners = np.array(self.shapes[row.text("shape")])
            else:
                corners = square(row.number("side_m"))
                if not row.number("side_m") > 0:
                    raise row.fail("side_m", "positive")
            pose = np.linalg.inv(pose_of(row))  # the table has world_from_body
            index = self.network.add_body(row.text("name"), corners, pose, scale_free=row.flag("scale_free"))
            self.bodies.add(row.text("name"), index, f"{row.path}:{row.line}")
            self.corners.append(len(corners))

    def read_observations(self) -> None:
        columns = ("image", "target", "x_px", "y_px")
        for row in read_table(self.table("observations"), columns, ("sigma_x_px", "sigma_y_px")):
            where = f"{row.path}:{row.line}"
            sigma_x = row.number("sigma_x_px", SIGMA_PX)
            sigma = np.array([sigma_x, row.number("sigma_y_px", sigma_x)])
            if not (sigma > 0).all():
                raise row.fail("sigma_x_px" if not sigma[0] > 0 else "sigma_y_px", "positive")
            self.network.observe(
                self.images.find(row.text("image"), where), [self.target(row.text("target"), where)],
                np.array([[row.number("x_px"), row.number("y_px")]]), sigma,
            )

    def read_constraints(self) -> None:
        where = str(self.path)
        for section in self.file.sections("distances", ("from", "to", "length_m", "sigma_m")):
            start, end = (self.target(section.text(key), where) for key in ("from", "to"))
            self.network.add_distance(start, end, section.positive("length_m"), section.positive("sigma_m"))
        for section in self.file.sections("control", ("target", "position_m", "sigma_m")):
            self.network.add_control(
                self.target(section.text("target"), where), section.vector("position_m", 3),
                np.eye(3) * section.positive("sigma_m") ** 2,
            )
        for section in self.file.sections("priors", ("camera", "parameter", "value", "sigma")):
            self.network.add_parameter_prior(
                self.cameras.find(section.text("camera"), where), section.text("parameter"),
                section.number("value"), section.positive("sigma"),
            )

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
    reader.read_constraints()
    try:
        reader.network.check()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return reader.network, reader.datum(), reader.check_points()


def image_table(network: Network) -> bytes:
    """Table of the poses of all images, as for the key `images` of a network file."""
    names, cameras = network.image_names, network.camera_names
    return table_bytes(
        ("name", "camera", *POSE),
        ((name, cameras[camera], *pose_columns(network.cam_from_world(i)))
         for i, (name, camera) in enumerate(zip(names, network.image_cameras))),
    )


def network_files(network: Network) -> dict[str, bytes]:
    """Network file and tables for read_network().

    Contains the used observations, without distances, control points, priors and rigs.
    """
    points, names = np.asarray(network.points_m), network.point_names
    images, bodies = network.image_names, network.body_names

    def target_text(row: NDArray[np.float64]) -> str:
        return names[int(row[1])] if row[1] >= 0 else f"{bodies[int(row[2])]}.{int(row[3])}"

    files = {
        "images.csv": image_table(network),
        "observations.csv": table_bytes(
            ("image", "target", "x_px", "y_px", "sigma_x_px", "sigma_y_px"),
            ((images[int(row[0])], target_text(row), *map(float, row[4:8]))
             for row in np.asarray(network.observations) if row[8] > 0),
        ),
    }
    lines = [f"schema: {SCHEMA}", "cameras:"]
    for name, camera, free in zip(network.camera_names, network.cameras, network.free_parameters):
        files[f"{name}.yaml"] = format_camera(camera).encode()
        lines.append(f"  - {{name: {name}, file: {name}.yaml, free: [{', '.join(free)}]}}")
    if names:
        rows = ((name, *map(float, at)) for name, at in zip(names, points))
        files["points.csv"] = table_bytes(("name", *POSE[:3]), rows)
        lines.append("points: points.csv")
    if bodies:
        corners = zip(bodies, network.body_corners_m, network.body_scales)
        files["shapes.csv"] = table_bytes(
            ("shape", *POSE[:3]),
            ((name, *map(float, scale * corner)) for name, body, scale in corners for corner in np.asarray(body)),
        )
        files["bodies.csv"] = table_bytes(
            ("name", "shape", *POSE),
            ((name, name, *pose_columns(np.asarray(np.linalg.inv(pose), dtype=float)))
             for name, pose in zip(bodies, network.body_poses)),
        )
        lines += ["shapes: shapes.csv", "bodies: bodies.csv"]
    lines += ["images: images.csv", "observations: observations.csv", ""]
    files["network.yaml"] = "\n".join(lines).encode()
    return files
