# SPDX-License-Identifier: Apache-2.0
"""Renders the missing frames of a folder."""

from collections.abc import Sequence

from ..progress import Advance
from ..result_folder import ResultFolder, json_bytes
from ..workers import run_jobs
from .bop import Bop
from .coco import Coco
from .frames import Frame, render_frame, renderer_of
from .plain import Plain

LAYOUTS: dict[str, type[Plain]] = {layout.name: layout for layout in (Plain, Bop, Coco)}


def truth_name(index: int) -> str:
    return f"truth/{index:06d}.json"


def missing_frames(folder: ResultFolder, layout: Plain, frames: Sequence[Frame]) -> list[Frame]:
    """Frames without an image or without the truth file, which is written last."""
    return [
        f for f in frames
        if not (folder.has(truth_name(f.index)) and folder.has(layout.image_name(f.index, f.image_format)))
    ]


def frame_files(job: tuple[str, Frame]) -> dict[str, bytes]:
    """Files of a frame in the order of writing. job: name of the layout and the frame."""
    name, frame = job
    layout = LAYOUTS[name](renderer_of(frame.scene).scene)
    image, truth = render_frame(frame)
    files = {layout.image_name(frame.index, frame.image_format): image, **dict(layout.frame_files(truth))}
    return {**files, truth_name(frame.index): json_bytes(truth)}


def write_frames(
    folder: ResultFolder, layout: Plain, frames: Sequence[Frame], workers: int, advance: Advance
) -> bool:
    """Writes the missing frames; returns True after Ctrl-C, which keeps finished frames. Raises: OSError."""
    todo = [(layout.name, frame) for frame in missing_frames(folder, layout, frames)]
    return folder.keep(run_jobs(frame_files, todo, workers, idle=lambda: advance(0)), advance)


def write_set_files(folder: ResultFolder, layout: Plain, ending: str, advance: Advance) -> int:
    """Writes the layout's files of the whole set; returns the number of frames in the folder."""
    entries = []
    for stem in folder.names("truth", ".json"):
        entries.append(layout.entry(folder.read_json(f"truth/{stem}.json")))
        advance()
    if entries:
        for name, content in layout.set_files(entries, ending):
            folder.write(name, content)
    return len(entries)
