# SPDX-License-Identifier: Apache-2.0
"""Output to a new ROS bag: the poses, and the record of every frame as JSON."""

import sqlite3
from pathlib import Path
from typing import Any

from ...streams.bags import rosbags_module
from .outputs import json_line, require_writable
from .record import Record
from .ros_messages import POSE, TEXT, pose_message

FRAME_ID = "map"
ROS2_VERSION = 8


class BagOutput:
    """Writes a ROS 1 bag if the name ends with .bag, else a ROS 2 bag (a folder).

    Topics: /libocc/pose, a PoseWithCovarianceStamped of the camera's optical frame in the world for each frame with
    detected lamps; /libocc/fix, a String with every record as JSON, including predicted poses.
    Raises: ValueError without rosbags; OSError when the bag exists already.
    """

    def __init__(self, path: str):
        self.name = path
        self._ros1 = Path(path).suffix == ".bag"
        rosbags = rosbags_module(path, "rosbag1" if self._ros1 else "rosbag2")
        typesys = rosbags_module(path, "typesys")
        if Path(path).exists():
            raise OSError(f"{path}: exists already; use another name, bags are not extended")
        require_writable(path)
        stores = typesys.Stores
        self._store = typesys.get_typestore(stores.ROS1_NOETIC if self._ros1 else stores.ROS2_HUMBLE)
        self._failures = (OSError, sqlite3.Error, rosbags.WriterError)
        options: dict[str, Any] = {} if self._ros1 else {"version": ROS2_VERSION}
        try:
            self._bag = rosbags.Writer(path, **options)
            self._bag.open()
            self._poses = self._bag.add_connection("/libocc/pose", POSE, typestore=self._store)
            self._fixes = self._bag.add_connection("/libocc/fix", TEXT, typestore=self._store)
        except self._failures as error:
            raise self._named(error) from error
        self._count = 0

    def add(self, record: Record) -> None:
        if record.time_s is None or record.time_s < 0:
            return
        text = self._store.types[TEXT](data=json_line(record))
        try:
            if record.pose is not None and not record.predicted:
                sequence = self._count if self._ros1 else None
                message = pose_message(self._store, record.pose, FRAME_ID, sequence)
                self._write(self._poses, record.pose.time_s, message, POSE)
                self._count += 1
            self._write(self._fixes, record.time_s, text, TEXT)
        except self._failures as error:
            raise self._named(error) from error

    def _write(self, connection: Any, time_s: float, message: Any, kind: str) -> None:
        serialize = self._store.serialize_ros1 if self._ros1 else self._store.serialize_cdr
        self._bag.write(connection, round(1e9 * time_s), serialize(message, kind))

    def close(self) -> str:
        try:
            self._bag.close()
        except self._failures as error:
            raise self._named(error) from error
        return ""

    def _named(self, error: Exception) -> OSError:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        return OSError(f"{self.name}: cannot be written: {reason}")
