# SPDX-License-Identifier: Apache-2.0
"""Outputs that receive the records during a run: files of complete lines, also after an interruption."""

import contextlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from ..._core import Trajectory
from .record import Pose, Record, record_dict


class Output(Protocol):
    """Receives records. Raises OSError naming itself when it cannot be written; the content so far remains."""

    name: str

    def add(self, record: Record) -> None: ...

    def close(self) -> str:
        """Closes the output; returns a message for the user, or an empty string."""


class LineFile:
    """A file that grows by complete lines, each written when the call returns.

    Raises: OSError naming the file. A partly written line is removed.
    """

    def __init__(self, path: str):
        self.path = path
        self._size = 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise self._named(error) from error

    def write(self, line: str) -> None:
        data = (line + "\n").encode()
        done = 0
        try:
            while done < len(data):
                done += os.write(self._file, data[done:])
        except OSError as error:
            with contextlib.suppress(OSError):  # devices and pipes cannot be truncated
                os.ftruncate(self._file, self._size)
            raise self._named(error) from error
        self._size += done

    def close(self) -> None:
        with contextlib.suppress(OSError):
            os.close(self._file)

    def _named(self, error: OSError) -> OSError:
        return OSError(f"{self.path}: cannot be written: {error.strerror or error}")


class JsonLines:
    """Writes every record as one line of JSON."""

    def __init__(self, path: str):
        self.name = path
        self._file = LineFile(path)

    def add(self, record: Record) -> None:
        self._file.write(json_line(record))

    def close(self) -> str:
        self._file.close()
        return ""


def json_line(record: Record) -> str:
    return json.dumps(record_dict(record), allow_nan=False)


def tum_line(pose: Pose) -> str:
    """Line `t tx ty tz qx qy qz qw` with the camera's pose in the world, in the format of Trajectory.save()."""
    return Trajectory([pose.time_s], [pose.cam_from_world]).format().splitlines()[-1]


class Tum:
    """Writes poses of frames with detected lamps in TUM format.

    Predicted poses are omitted because the format cannot mark them. Times must increase: poses with earlier times,
    after a clock was set back, are omitted as well.
    """

    def __init__(self, path: str):
        self.name = path
        self._file = LineFile(path)
        self._last_s: float | None = None
        self._omitted = 0
        self._file.write("# timestamp tx ty tz qx qy qz qw: the camera's pose in the world [s, m]")

    def add(self, record: Record) -> None:
        pose = record.pose
        if pose is None or record.predicted:
            return
        if self._last_s is not None and pose.time_s <= self._last_s:
            self._omitted += 1
            return
        self._file.write(tum_line(pose))
        self._last_s = pose.time_s

    def close(self) -> str:
        self._file.close()
        if not self._omitted:
            return ""
        return f"{self.name}: {self._omitted} poses are omitted because their times do not increase"


class Outputs:
    """All outputs of a run. An output that fails is closed and reported; the others continue."""

    def __init__(self, outputs: list[Output], report: Callable[[str], None]):
        self._open = outputs
        self._report = report
        self.failures: list[str] = []

    @property
    def none_left(self) -> bool:
        return bool(self.failures) and not self._open

    def add(self, record: Record) -> None:
        for output in list(self._open):
            try:
                output.add(record)
            except OSError as error:
                self._open.remove(output)
                self._failed(f"{error}; frame {record.frame} and all later frames are missing in it")
                with contextlib.suppress(OSError):
                    output.close()

    def close(self) -> None:
        for output in self._open:
            try:
                if message := output.close():
                    self._report(message)
            except OSError as error:
                self._failed(f"{error}; it is incomplete")
        self._open = []

    def _failed(self, message: str) -> None:
        self.failures.append(message)
        self._report(f"error: {message}")


def require_writable(path: str) -> None:
    """Raises OSError naming the path when its folder is missing or not writable."""
    folder = Path(path).resolve().parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise OSError(f"{path}: cannot be written: {folder} is not a writable folder")
