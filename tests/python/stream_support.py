# SPDX-License-Identifier: Apache-2.0
"""Frames of a short walk in every kind of source: folder, video, ROS 1 and ROS 2 bags."""

import io
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from PIL import Image

import libocc as occ
from libocc.cli.poses import upward_pose

FPS = 20
BEGIN_S = 5.0


def walk() -> occ.Trajectory:
    """Trajectory of 1.5 s below the lamps of irregular_six."""
    poses = [upward_pose([1.6, 1.8, 0.4], 0, 2, 40), upward_pose([1.9, 1.95, 0.45], 12, 3, 100)]
    return occ.Trajectory([BEGIN_S, BEGIN_S + 1.5], poses)


def render(
    scene: occ.Scene, count: int, path: occ.Trajectory | None = None, fps: float = FPS
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Time, image and cam_from_world of each frame."""
    path = path or walk()
    renderer, made = occ.Renderer(scene), []
    for i in range(count):
        time_s = path.begin_s + i / fps
        pose, velocity = path.cam_from_world(time_s), path.velocity(time_s)
        image, _ = renderer.render(
            pose, seed=3, frame=i, start_s=time_s, velocity=velocity, noise_area=occ.rendering.NoiseArea.around_lamps
        )
        made.append((time_s, image.copy(), pose))
    return made


def write_folder(
    folder: Path, frames: list[tuple[float, np.ndarray, np.ndarray]], path: occ.Trajectory | None = None
) -> Path:
    """Folder as written by `libocc sequence`, reduced to the files that are read."""
    (folder / "images").mkdir(parents=True)
    (folder / "truth").mkdir()
    path = path or walk()
    velocity = path.velocity(path.begin_s).tolist()
    for i, (time_s, image, pose) in enumerate(frames):
        occ.write_image(folder / "images" / f"{i:06d}.png", image)
        truth = {"time_s": time_s, "cam_from_world": pose.tolist(), "velocity": velocity}
        (folder / "truth" / f"{i:06d}.json").write_text(json.dumps(truth))
    return folder


def header_of(store: Any, time_s: float, frame: str) -> Any:
    types = store.types
    nanoseconds = round(1e9 * time_s)
    stamp = types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
    header_type = types["std_msgs/msg/Header"]
    numbers = {"seq": 0} if "seq" in header_type.__dataclass_fields__ else {}
    return header_type(**numbers, stamp=stamp, frame_id=frame)


def imu_message(store: Any, row: np.ndarray) -> Any:
    types, unknown = store.types, np.zeros(9)
    vector = types["geometry_msgs/msg/Vector3"]
    return types["sensor_msgs/msg/Imu"](
        header=header_of(store, row[0], "imu"), orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        orientation_covariance=unknown, angular_velocity=vector(*map(float, row[1:4])),
        angular_velocity_covariance=unknown, linear_acceleration=vector(*map(float, row[4:])),
        linear_acceleration_covariance=unknown,
    )


def image_message(store: Any, image: np.ndarray, time_s: float, encoding: str, **changes: Any) -> Any:
    """Message sensor_msgs/Image, or CompressedImage for the encodings jpeg and png."""
    types = store.types
    header = header_of(store, time_s, "camera")
    if encoding in ("jpeg", "png"):
        file = io.BytesIO()
        Image.fromarray(image).save(file, encoding, **({"quality": 98} if encoding == "jpeg" else {}))
        data = np.frombuffer(file.getvalue(), np.uint8)
        return types["sensor_msgs/msg/CompressedImage"](header=header, format=encoding, data=data)
    data = np.frombuffer(np.ascontiguousarray(image).tobytes(), np.uint8)
    fields = {"height": image.shape[0], "width": image.shape[1], "encoding": encoding, "is_bigendian": 0,
              "step": image.nbytes // image.shape[0], "data": data}
    return types["sensor_msgs/msg/Image"](header=header, **{**fields, **changes})


def write_bag(
    path: Path, frames: list[tuple[float, np.ndarray, np.ndarray]], encoding: str = "mono8",
    topics: tuple[str, ...] = ("/camera/image",), stamped: bool = True, imu: np.ndarray | None = None,
) -> Path:
    """Writes a ROS 1 bag if the name ends with .bag, else ROS 2; recording times are 0.1 s after the stamps.

    imu: samples (n, 7) of the topic /imu: time [s], rotation rates [rad/s], specific forces [m/s^2].
    """
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    ros1 = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    kind = "sensor_msgs/msg/CompressedImage" if encoding in ("jpeg", "png") else "sensor_msgs/msg/Image"
    with Writer1(path) if ros1 else Writer2(path, version=8) as bag:
        connections = [bag.add_connection(topic, kind, typestore=store) for topic in topics]
        for time_s, image, _ in frames:
            message = image_message(store, image, time_s if stamped else 0.0, encoding)
            raw = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
            for connection in connections:
                bag.write(connection, round(1e9 * (time_s + 0.1)), raw)
        if imu is not None:
            kind = "sensor_msgs/msg/Imu"
            connection = bag.add_connection("/imu", kind, typestore=store)
            for row in imu:
                message = imu_message(store, row)
                raw = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
                bag.write(connection, round(1e9 * (row[0] + 0.1)), raw)
    return path


def raw_image(encoding: str, height: int, width: int, step: int, data: Any, bigendian: int = 0) -> Any:
    """Message with the fields that pixels_of() reads."""
    return SimpleNamespace(
        encoding=encoding, height=height, width=width, step=step, is_bigendian=bigendian,
        data=np.asarray(data, np.uint8),
    )
