# SPDX-License-Identifier: Apache-2.0
"""Frames and inertial samples from ROS 1 and ROS 2 bags, read by `rosbags` without an installation of ROS."""

import importlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .frames import Pixels, StreamFrame

RAW = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
IMU = "sensor_msgs/msg/Imu"
# Number of channels and bytes per channel. Bayer mosaics are not demosaiced.
ENCODINGS = {
    "mono8": (1, 1), "8UC1": (1, 1), "mono16": (1, 2), "16UC1": (1, 2),
    "rgb8": (3, 1), "bgr8": (3, 1), "8UC3": (3, 1), "rgba8": (4, 1), "bgra8": (4, 1), "8UC4": (4, 1),
    "rgb16": (3, 2), "bgr16": (3, 2), "rgba16": (4, 2), "bgra16": (4, 2),
    **{f"bayer_{tiles}{8 * bytes_}": (1, bytes_) for tiles in ("rggb", "bggr", "gbrg", "grbg") for bytes_ in (1, 2)},
}


def rosbags_module(name: str, module: str) -> Any:
    """Imports a module of rosbags. Raises: ValueError naming the bag when rosbags is not installed."""
    try:
        return importlib.import_module(f"rosbags.{module}")
    except ImportError as error:
        raise ValueError(f"{name}: reading and writing bags requires rosbags: pip install 'libocc[ros]'") from error


def is_bag(path: Path) -> bool:
    return path.suffix in (".bag", ".mcap", ".db3") or (path / "metadata.yaml").is_file()


def pixels_of(message: Any) -> Pixels:
    """Pixels of a sensor_msgs/msg/Image; colours are red, green, blue.

    Raises: ValueError when its encoding or size is invalid.
    """
    if message.encoding not in ENCODINGS:
        raise ValueError(f"encoding must be one of {', '.join(ENCODINGS)}, got {message.encoding!r}")
    channels, bytes_ = ENCODINGS[message.encoding]
    kind = np.dtype(np.uint8 if bytes_ == 1 else np.uint16).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = int(message.height), int(message.width), int(message.step)
    data = np.asarray(message.data, np.uint8)
    min_step = width * channels * bytes_
    if height < 1 or width < 1 or step < min_step or len(data) < step * (height - 1) + min_step:
        raise ValueError(f"{len(data)} bytes of step {step} cannot hold {width} x {height} {message.encoding}")
    padded = np.zeros(step * height, np.uint8)
    padded[: min(len(data), step * height)] = data[: step * height]
    rows = np.ascontiguousarray(padded.reshape(height, step)[:, :min_step])
    pixels = rows.view(kind).astype(kind.newbyteorder("="), copy=False)
    pixels = pixels.reshape((height, width) if channels == 1 else (height, width, channels))
    if message.encoding.startswith("bgr"):
        pixels[..., :3] = pixels[..., 2::-1].copy()
    return pixels


def pixels_of_file(data: bytes) -> Pixels:
    """Pixels of a JPEG or PNG file in memory. Raises: ValueError."""
    try:
        with Image.open(io.BytesIO(data)) as image:
            deep = image.mode.startswith("I")
            grey = image.mode in ("1", "L", "LA", "P")
            pixels = np.asarray(image) if deep else np.asarray(image.convert("L" if grey else "RGB"))
            return pixels.astype(np.uint16) if deep else pixels
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(f"cannot be read as an image: {error}") from error


def open_bag(path: str) -> Any:
    """Reader of a bag. Raises: ValueError naming it."""
    highlevel = rosbags_module(path, "highlevel")
    typesys = rosbags_module(path, "typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)  # for bags without type definitions
    place = Path(path)
    if place.suffix == ".db3" and (place.parent / "metadata.yaml").is_file():
        place = place.parent
    try:
        bag = highlevel.AnyReader([place], default_typestore=store)
        bag.open()
    except Exception as error:  # damaged files raise exceptions of many types
        raise ValueError(f"{path}: is not a bag that rosbags can read: {error}") from error
    return bag


def time_of(message: Any, recorded_ns: int) -> float:
    """Stamp of the header [s], or the time of recording if the stamp is zero."""
    stamp = message.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec if stamp.sec or stamp.nanosec else 1e-9 * recorded_ns)


def imu_of_bag(path: str, topic: str) -> NDArray[np.float64]:
    """Samples (n, 7) of a topic of type sensor_msgs/msg/Imu: time [s], rotation rates [rad/s], specific forces [m/s^2].

    Raises: ValueError naming the bag or its topics.
    """
    bag = open_bag(path)
    try:
        connections = [c for c in bag.connections if c.msgtype == IMU]
        topics = ", ".join(sorted({c.topic for c in connections}))
        wanted = [c for c in connections if c.topic == topic]
        if not wanted:
            raise ValueError(f"is no file, and no topic of {path} of type {IMU}; it has {topics or 'none'}")
        rows = []
        for connection, recorded_ns, raw in bag.messages(connections=wanted):
            message = bag.deserialize(raw, connection.msgtype)
            turn, force = message.angular_velocity, message.linear_acceleration
            rows.append([time_of(message, recorded_ns), turn.x, turn.y, turn.z, force.x, force.y, force.z])
        return np.array(rows, float).reshape(-1, 7)
    finally:
        bag.close()


class BagSource:
    """Images of one topic of a bag; the topic must be given if the bag has several.

    The time of a frame is the stamp of its header, or the time of recording if the stamp is zero.
    Raises: ValueError naming the bag or its topics.
    """

    live = False

    def __init__(self, path: str, topic: str | None = None):
        self.name = path
        self._bag = open_bag(path)
        try:
            self._connections = self._of_topic(topic)
        except ValueError:
            self._bag.close()
            raise
        self.total: int | None = sum(c.msgcount for c in self._connections) or None

    def _of_topic(self, wanted: str | None) -> list[Any]:
        images = [c for c in self._bag.connections if c.msgtype in (RAW, COMPRESSED)]
        topics = sorted({c.topic for c in images})
        if not topics:
            raise ValueError(f"{self.name}: has no topic of type {RAW} or {COMPRESSED}")
        if wanted is None and len(topics) > 1:
            raise ValueError(f"{self.name}: has images on several topics; give --topic with one of {', '.join(topics)}")
        if wanted is not None and wanted not in topics:
            raise ValueError(f"--topic: {wanted!r} has no images in {self.name}; allowed: {', '.join(topics)}")
        return [c for c in images if c.topic == (wanted or topics[0])]

    def __iter__(self) -> Iterator[StreamFrame]:
        messages = iter(self._bag.messages(connections=self._connections))
        index = 0
        while True:
            try:
                connection, recorded_ns, raw = next(messages)
            except StopIteration:
                return
            except Exception as error:  # the remaining part of a damaged bag
                raise ValueError(f"{self.name}: cannot be read after message {index}: {error}") from error
            yield self._frame(index, connection, recorded_ns, raw)
            index += 1

    def _frame(self, index: int, connection: Any, recorded_ns: int, raw: bytes) -> StreamFrame:
        time_s = 1e-9 * recorded_ns
        try:
            message = self._bag.deserialize(raw, connection.msgtype)
            time_s = time_of(message, recorded_ns)
            image = pixels_of(message) if connection.msgtype == RAW else pixels_of_file(bytes(message.data))
            return StreamFrame(index, time_s, image)
        except Exception as error:  # invalid message
            return StreamFrame(index, time_s, None, problem=f"cannot be decoded: {error}")

    def close(self) -> None:
        self._bag.close()
