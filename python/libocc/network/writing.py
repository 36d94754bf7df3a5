# SPDX-License-Identifier: Apache-2.0
"""Networks as YAML files with tables; read_network() reads them again."""

from collections.abc import Mapping, Sequence

import numpy as np
import yaml
from numpy.typing import NDArray

from .._core import Datum, DatumKind, Network, Target, format_camera
from .poses import pose_columns
from .sections import POSE, SCHEMA
from .tables import table_bytes

Line = tuple[object, ...]


def image_table(network: Network) -> bytes:
    """Table of the poses of all images, as for the key `images` of a network file."""
    names, cameras = network.image_names, network.camera_names
    return table_bytes(
        ("name", "camera", *POSE),
        ((name, cameras[camera], *pose_columns(network.cam_from_world(i)))
         for i, (name, camera) in enumerate(zip(names, network.image_cameras))),
    )


def require_unique(kind: str, names: Sequence[str]) -> None:
    """Raises ValueError for a name that a file cannot refer to."""
    seen: set[str] = set()
    for k, name in enumerate(names):
        if name == "" or name != name.strip() or "\n" in name:
            raise ValueError(f"network: {kind} {k} must have a name without spaces at its ends, got {name!r}")
        if name in seen:
            raise ValueError(f"network: {kind} {name!r} occurs twice")
        seen.add(name)


def flow(value: object) -> str:
    """YAML of a value on one line; numbers have all digits."""
    text = yaml.safe_dump(value, default_flow_style=True, width=float("inf"), allow_unicode=True, sort_keys=False)
    return text.strip()


def listed(key: str, items: Sequence[dict[str, object]]) -> list[str]:
    return [f"{key}:", *(f"  - {flow(item)}" for item in items)] if items else []


def numbers(values: NDArray[np.float64]) -> list[float]:
    return [float(value) for value in np.asarray(values).ravel()]


def is_plain(network: Network) -> bool:
    """True if each image has a station of its own with the same name, and no mount."""
    return (
        network.image_stations == list(range(len(network.station_names)))
        and network.image_names == network.station_names
        and all(mount < 0 for mount in network.image_mounts)
    )


class Writer:
    def __init__(self, network: Network):
        self.network = network
        self.files: dict[str, bytes] = {}
        self.lines = [f"schema: {SCHEMA}"]
        for kind, names in (
            ("camera", network.camera_names), ("station", network.station_names), ("mount", network.mount_names),
            ("image", network.image_names), ("point", network.point_names), ("body", network.body_names),
        ):
            require_unique(kind, names)

    def name(self, target: Target) -> str:
        if target.point_index >= 0:
            return self.network.point_names[target.point_index]
        return f"{self.network.body_names[target.body_index]}.{target.corner_index}"

    def table(self, key: str, head: Sequence[str], rows: Sequence[Line]) -> None:
        self.files[f"{key}.csv"] = table_bytes(head, rows)
        self.lines.append(f"{key}: {key}.csv")

    def cameras(self) -> None:
        n = self.network
        items: list[dict[str, object]] = []
        for name, camera, free in zip(n.camera_names, n.cameras, n.free_parameters):
            if "/" in name or "\\" in name:
                raise ValueError(f"network: camera {name!r} must have a name that can be the name of a file")
            self.files[f"{name}.yaml"] = format_camera(camera).encode()
            items.append({"name": name, "file": f"{name}.yaml", "free": free})
        self.lines += listed("cameras", items)

    def images(self) -> None:
        n = self.network
        cameras = [n.camera_names[camera] for camera in n.image_cameras]
        if is_plain(n):
            head = ("name", "camera", *POSE, "fixed") if any(n.stations_fixed) else ("name", "camera", *POSE)
            rows = [
                (name, camera, *pose_columns(np.asarray(pose)), int(fixed))[: len(head)]
                for name, camera, pose, fixed in zip(n.image_names, cameras, n.station_poses, n.stations_fixed)
            ]
            self.table("images", head, rows)
            return
        for key, names, poses, fixed in (
            ("stations", n.station_names, n.station_poses, n.stations_fixed),
            ("mounts", n.mount_names, n.mount_poses, n.mounts_fixed),
        ):
            if names:
                self.table(key, ("name", *POSE, "fixed"), [
                    (name, *pose_columns(np.asarray(pose)), int(flag)) for name, pose, flag in zip(names, poses, fixed)
                ])
        self.table("images", ("name", "camera", "station", "mount"), [
            (name, camera, n.station_names[station], n.mount_names[mount] if mount >= 0 else "")
            for name, camera, station, mount in zip(n.image_names, cameras, n.image_stations, n.image_mounts)
        ])

    def points(self) -> None:
        n = self.network
        if n.point_names:
            self.table("points", ("name", *POSE[:3], "fixed"), [
                (name, *numbers(at), int(fixed))
                for name, at, fixed in zip(n.point_names, np.asarray(n.points_m), n.points_fixed)
            ])

    def bodies(self) -> None:
        n = self.network
        if not n.body_names:
            return
        self.table("shapes", ("shape", *POSE[:3]), [
            (name, *numbers(scale * corner))
            for name, corners, scale in zip(n.body_names, n.body_corners_m, n.body_scales)
            for corner in np.asarray(corners)
        ])
        self.table("bodies", ("name", "shape", *POSE, "scale_free", "fixed"), [
            (name, name, *pose_columns(np.linalg.inv(np.asarray(pose))), int(free), int(fixed))
            for name, pose, free, fixed in zip(n.body_names, n.body_poses, n.bodies_scale_free, n.bodies_fixed)
        ])

    def observations(self) -> None:
        n = self.network
        images = n.image_names

        def target_text(row: NDArray[np.float64]) -> str:
            point, body, corner = (int(value) for value in row[1:4])
            return n.point_names[point] if point >= 0 else f"{n.body_names[body]}.{corner}"

        self.table("observations", ("image", "target", "x_px", "y_px", "sigma_x_px", "sigma_y_px"), [
            (images[int(row[0])], target_text(row), *numbers(row[4:8]))
            for row in np.asarray(n.observations) if row[8] > 0
        ])

    def knowledge(self) -> None:
        n = self.network
        self.lines += listed("distances", [
            {"from": self.name(start), "to": self.name(end), "length_m": length, "sigma_m": sigma}
            for start, end, length, sigma, used in n.distances if used
        ])
        self.lines += listed("control", [
            {"target": self.name(target), "position_m": numbers(at),
             **({"covariance_m2": np.asarray(covariance).tolist()} if np.count_nonzero(covariance) > 3
                else {"sigma_m": numbers(np.sqrt(np.diag(covariance)))})}
            for target, at, covariance in n.control
        ])
        self.lines += listed("priors", [
            {"camera": n.camera_names[camera], "parameter": parameter, "value": value, "sigma": sigma}
            for camera, parameter, value, sigma in n.parameter_priors
        ])
        plain = is_plain(n)
        poses = [(station, pose_columns(np.asarray(pose)), covariance) for station, pose, covariance in n.pose_priors]
        self.lines += listed("pose_priors", [
            {"image" if plain else "station": n.station_names[station], "position_m": columns[:3],
             "quaternion": columns[3:], "covariance": np.asarray(covariance).tolist()}
            for station, columns, covariance in poses
        ])

    def datum(self, datum: Datum) -> None:
        if datum.kind is not DatumKind.inner or datum.targets:
            targets = [self.name(target) for target in datum.targets]
            self.lines.append(f"datum: {flow({'kind': datum.kind.name, 'targets': targets})}")


def network_files(
    network: Network, datum: Datum | None = None, check_points: Mapping[str, Sequence[float]] | None = None
) -> dict[str, bytes]:
    """Network file and tables for read_network(), which returns the same network and datum.

    Observations and distances that are not used are omitted, and so are outlines (Network.outlines), which a comment in
    the file says: an adjustment of the file has less information than one of the network. The corners of a body are
    written with its scale. The corners' numbers, names, fixed elements, rigs, control points and priors are kept.
    check_points: known positions [m] by the point's name, which are not used in the adjustment.
    Raises: ValueError for elements of a kind with the same name, or without one.
    """
    writer = Writer(network)
    writer.cameras()
    writer.points()
    writer.bodies()
    writer.images()
    writer.observations()
    writer.knowledge()
    if network.outlines:
        writer.lines.append(f"# {len(network.outlines)} outlines about points are not in this file.")
    if datum is not None:
        writer.datum(datum)
    if check_points:
        rows = [(name, *map(float, at)) for name, at in check_points.items()]
        writer.table("check_points", ("name", *POSE[:3]), rows)
    writer.files["network.yaml"] = ("\n".join(writer.lines) + "\n").encode()
    return writer.files
