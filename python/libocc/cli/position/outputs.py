# SPDX-License-Identifier: Apache-2.0
"""Where records go while they come: files of whole lines, whatever ends the run."""

import contextlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from ..._core import Trajectory
from .record import Pose, Record, record_dict


class Output(Protocol):
    """Raises: OSError naming itself when it cannot go on; what is there then stays."""

    name: str

    def add(self, record: Record) -> None: ...

    def close(self) -> str:
        """A sentence to say at the end, or an empty one."""


class LineFile:
    """A file that grows by whole lines, each on the disk when the call returns.

    Raises: OSError naming it. A line that did not fit is taken back.
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
            with contextlib.suppress(OSError):  # no plain file: nothing to take back
                os.ftruncate(self._file, self._size)
            raise self._named(error) from error
        self._size += done

    def close(self) -> None:
        with contextlib.suppress(OSError):
            os.close(self._file)

    def _named(self, error: OSError) -> OSError:
        return OSError(f"{self.path}: cannot be written: {error.strerror or error}")


class JsonLines:
    """Every record, an object a line."""

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
    """`t tx ty tz qx qy qz qw`, the camera's pose in the world, as Trajectory.save writes it."""
    return Trajectory([pose.time_s], [pose.cam_from_world]).format().splitlines()[-1]


class Tum:
    """The poses of frames in which lamps were seen; predicted ones are left out, as the format cannot
    say which they are. Times rise in it: what comes after a clock was set back is left out, too."""

    def __init__(self, path: str):
        self.name = path
        self._file = LineFile(path)
        self._last_s: float | None = None
        self._left_out = 0
        self._file.write("# timestamp tx ty tz qx qy qz qw: the camera's pose in the world [s, m]")

    def add(self, record: Record) -> None:
        pose = record.pose
        if pose is None or record.predicted:
            return
        if self._last_s is not None and pose.time_s <= self._last_s:
            self._left_out += 1
            return
        self._file.write(tum_line(pose))
        self._last_s = pose.time_s

    def close(self) -> str:
        self._file.close()
        return f"{self.name}: {self._left_out} poses left out whose times do not rise" if self._left_out else ""


class Outputs:
    """All of a run. One that fails is closed and said; the others go on."""

    def __init__(self, outputs: list[Output], say: Callable[[str], None]):
        self._open = outputs
        self._say = say
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
                self._failed(f"{error}; frame {record.frame} and what follows are not in it")
                with contextlib.suppress(OSError):
                    output.close()

    def close(self) -> None:
        for output in self._open:
            try:
                if said := output.close():
                    self._say(said)
            except OSError as error:
                self._failed(f"{error}; it is not whole")
        self._open = []

    def _failed(self, message: str) -> None:
        self.failures.append(message)
        self._say(f"error: {message}")


def require_writable(path: str) -> None:
    """Raises: OSError naming what cannot be made where path says."""
    folder = Path(path).resolve().parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise OSError(f"{path}: cannot be written: {folder} is no folder that can be written to")
