# SPDX-License-Identifier: Apache-2.0
"""Frames from a folder of images, each read when it is needed."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .._core import read_image
from .frames import StreamFrame

ENDINGS = (".png", ".pgm", ".tif", ".tiff", ".jpg", ".jpeg")


class FolderSource:
    """Images of a folder in the order of their names.

    The times are those of the truth files of `libocc sequence`, or follow from fps and the numbers in the file names.
    Raises: ValueError naming the folder when it has no images or no times.
    """

    live = False

    def __init__(self, path: str, fps: float | None = None):
        self.name = path
        self._folder = Path(path)
        inside = self._folder / "images" if (self._folder / "images").is_dir() else self._folder
        self._files = sorted(file for file in inside.iterdir() if file.suffix.lower() in ENDINGS)
        if not self._files:
            raise ValueError(f"{inside}: contains no images ({', '.join(ENDINGS)})")
        self._fps = fps
        self._time_s(self._files[0], 0)
        self.total: int | None = len(self._files)

    def __iter__(self) -> Iterator[StreamFrame]:
        for index, file in enumerate(self._files):
            yield self._frame(index, file)

    def _frame(self, index: int, file: Path) -> StreamFrame:
        time_s = None
        try:
            time_s = self._time_s(file, index)
            return StreamFrame(index, time_s, read_image(file), file.name, truth=self._truth(file))
        except (OSError, ValueError) as error:
            return StreamFrame(index, time_s, None, file.name, problem=str(error))

    def _truth_file(self, image: Path) -> Path:
        return self._folder / "truth" / f"{image.stem}.json"

    def _time_s(self, image: Path, index: int) -> float:
        """Number of the frame divided by fps if fps is given, else the time in the truth file."""
        if self._fps is not None:
            number = int(image.stem) if image.stem.isdigit() else index
            return number / self._fps
        file = self._truth_file(image)
        if not file.is_file():
            raise ValueError(f"{file}: no such file, so the times of the frames are unknown: give --fps")
        try:
            return float(json.loads(file.read_text())["time_s"])
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{file}: key `time_s`: must be a number of seconds") from error

    def _truth(self, image: Path) -> Any:
        file = self._truth_file(image)
        if not file.is_file():
            return None
        truth = json.loads(file.read_text())
        return truth if isinstance(truth, dict) and "cam_from_world" in truth else None

    def close(self) -> None:
        """Does nothing: no file stays open."""
