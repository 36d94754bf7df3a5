# SPDX-License-Identifier: Apache-2.0
"""Frames from a folder of images, read when they are asked for."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .._core import read_image
from ..cli.sequence_frames import ENDINGS, frame_time_s
from .frames import StreamFrame


class FolderSource:
    """Images by name; their times by `libocc sequence`'s truth files, or by fps and the numbers that
    are their names. Raises: ValueError naming the folder when it has no images or no times."""

    live = False

    def __init__(self, path: str, fps: float | None = None):
        self.name = path
        self._folder = Path(path)
        inside = self._folder / "images" if (self._folder / "images").is_dir() else self._folder
        self._files = sorted(file for file in inside.iterdir() if file.suffix.lower() in ENDINGS)
        if not self._files:
            raise ValueError(f"{inside}: holds no images ({', '.join(ENDINGS)})")
        self._fps = fps
        frame_time_s(self._folder, self._files[0], 0, fps)
        self.total: int | None = len(self._files)

    def __iter__(self) -> Iterator[StreamFrame]:
        for index, file in enumerate(self._files):
            yield self._frame(index, file)

    def _frame(self, index: int, file: Path) -> StreamFrame:
        time_s = None
        try:
            time_s = frame_time_s(self._folder, file, index, self._fps)
            return StreamFrame(index, time_s, read_image(file), file.name, truth=self._truth(file))
        except (OSError, ValueError) as error:
            return StreamFrame(index, time_s, None, file.name, problem=str(error))

    def _truth(self, image: Path) -> Any:
        file = self._folder / "truth" / f"{image.stem}.json"
        if not file.is_file():
            return None
        truth = json.loads(file.read_text())
        return truth if isinstance(truth, dict) and "cam_from_world" in truth else None

    def close(self) -> None:
        """Nothing is held."""
