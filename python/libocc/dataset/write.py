# SPDX-License-Identifier: Apache-2.0
"""Renders the frames that a folder lacks."""

from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any

from ..result_folder import ResultFolder, json_bytes
from ..workers import run_jobs
from .bop import Bop
from .coco import Coco
from .frames import Frame, render_frame
from .plain import Plain

LAYOUTS: dict[str, type[Plain]] = {layout.name: layout for layout in (Plain, Bop, Coco)}


def truth_name(index: int) -> str:
    return f"truth/{index:06d}.json"


def missing_frames(folder: ResultFolder, layout: Plain, frames: Sequence[Frame]) -> list[Frame]:
    """Those without an image or without the truth, which is written last."""
    return [
        f for f in frames
        if not (folder.has(truth_name(f.index)) and folder.has(layout.image_name(f.index, f.image_format)))
    ]


def write_frames(
    folder: ResultFolder, layout: Plain, frames: Sequence[Frame], workers: int,
    advance: Callable[[int], None],
) -> bool:
    """Returns whether Ctrl-C ended it; what is done by then is kept. Raises: OSError."""
    todo = missing_frames(folder, layout, frames)
    try:
        with closing(run_jobs(render_frame, todo, workers, idle=lambda: advance(0))) as rendered:
            for frame, (image, truth) in rendered:
                folder.write(layout.image_name(frame.index, frame.image_format), image)
                for name, content in layout.frame_files(truth):
                    folder.write(name, content)
                folder.write(truth_name(frame.index), json_bytes(truth))
                advance(1)
    except KeyboardInterrupt:
        return True
    return False


def write_set_files(folder: ResultFolder, layout: Plain, ending: str) -> int:
    """What the layout says of all frames that the folder holds; returns how many these are."""
    truths: list[dict[str, Any]] = [
        folder.read_json(f"truth/{stem}.json") for stem in folder.names("truth", ".json")
    ]
    if truths:
        for name, content in layout.set_files(truths, ending):
            folder.write(name, content)
    return len(truths)
