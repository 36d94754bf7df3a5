# SPDX-License-Identifier: Apache-2.0
"""Pictures of a survey: files, a folder of files, frames of a recording or a video."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..._core import AprilTag, Blob, Camera, Sensor, detect, detect_april_tags, read_image
from ...streams.bags import is_bag
from ...streams.folder import ENDINGS
from ...streams.frames import StreamFrame
from ...streams.open_source import open_source
from .. import error_context
from ..detect_options import Threshold, background_hint, threshold_of
from ..progress import progress


@dataclass
class Pictures:
    """Detected blobs and tags by picture; what could not be used; True if the pictures are frames of one motion."""

    blobs: list[tuple[str, list[Blob]]] = field(default_factory=list)
    tags: list[list[AprilTag]] = field(default_factory=list)
    tracks: list[list[int]] = field(default_factory=list)  # of each blob; empty before follow()
    times_s: list[float | None] = field(default_factory=list)
    frames: list[int] = field(default_factory=list)  # index in the recording
    notes: list[str] = field(default_factory=list)
    ordered: bool = False
    parts_of_tags: int = 0  # blobs that are no lamps


@dataclass(frozen=True)
class Detector:
    """Detects the lamps, and the tags of a family if one is given, in pictures of one camera."""

    camera: Camera
    sensor: Sensor | None
    threshold_dn: Threshold
    tag_family: str | None

    def lamps(self, pixels: Any) -> list[Blob]:
        """Blobs of one picture."""
        options: dict[str, Any] = {} if self.sensor is None else {"sensor": self.sensor}
        return list(detect(pixels, threshold_dn=threshold_of(pixels, self.threshold_dn), **options))

    def add(self, found: Pictures, name: str, pixels: Any, time_s: float | None = None) -> None:
        """Raises: ValueError when the picture does not have the camera's size."""
        camera, (height, width) = self.camera, pixels.shape[:2]
        if (width, height) != (camera.width, camera.height):
            turned = ": it was rotated after it was taken; use the original file" if width == camera.height else ""
            raise ValueError(
                f"its size is {width} x {height} px, that of the camera is {camera.width} x {camera.height} px{turned}"
            )
        blobs = self.lamps(pixels)
        hint = background_hint(pixels, blobs, self.threshold_dn)
        if hint:
            found.notes.append(f"{name}: {hint}")
        if self.tag_family is not None:
            tags = list(detect_april_tags(pixels, family=self.tag_family, camera=camera))
            found.tags.append(tags)
            lamps = [blob for blob in blobs if not any(is_part_of(tag, blob) for tag in tags)]
            found.parts_of_tags += len(blobs) - len(lamps)
            blobs = lamps
        found.blobs.append((name, blobs))
        found.times_s.append(time_s)


def is_part_of(tag: AprilTag, blob: Blob) -> bool:
    """True if the centre of the blob is on the tag or on the white border around it."""
    with_border = 1.5  # sides over those of the black square, which has six cells or more
    x, y, scale = np.linalg.solve(tag.homography, [*blob.centroid_px, 1.0])
    return bool(max(abs(x / scale), abs(y / scale)) < with_border)


def image_files(folder: Path) -> list[str]:
    return [str(file) for file in sorted(folder.iterdir()) if file.suffix.lower() in ENDINGS]


def is_recording(names: Sequence[str], fps: float | None) -> bool:
    """True for one video, bag, folder written by `libocc sequence`, or folder of frames with a frame rate."""
    if len(names) != 1:
        return False
    place = Path(names[0])
    if is_bag(place):
        return True
    if place.is_dir():
        return fps is not None or (place / "images").is_dir()
    return place.suffix.lower() not in ENDINGS


def frames_of(
    name: str, fps: float | None, topic: str | None, notes: list[str], max_frames: int
) -> Iterator[StreamFrame]:
    """Every n-th frame of a recording, so that at most max_frames are used; frames out of order are left out."""
    source = open_source(name, fps, topic)
    step = 1 if source.total is None else -(-source.total // max_frames)
    last_s = None
    try:
        for frame in source:
            label = frame.name or f"frame {frame.index}"
            if frame.problem:
                notes.append(f"{label}: {frame.problem}; the frame is not used")
                continue
            if last_s is not None and frame.time_s is not None and frame.time_s <= last_s:
                notes.append(f"{label}: its time {frame.time_s:g} s is not after {last_s:g} s; the frame is not used")
                continue
            last_s = frame.time_s
            if frame.index % step == 0 and frame.image is not None:
                yield frame
    finally:
        source.close()


def read_pictures(
    names: Sequence[str], detector: Detector, ordered: bool, max_pictures: int, fps: float | None,
    topic: str | None = None,
) -> Pictures:
    """Reads all pictures and detects their blobs. Raises: Failure naming the source or the picture."""
    found = detected_pictures(names, detector, ordered, max_pictures, fps, topic)
    if found.parts_of_tags > 0:
        found.notes.append(f"{found.parts_of_tags} blobs are parts of AprilTags, not lamps")
    return found


def detected_pictures(
    names: Sequence[str], detector: Detector, ordered: bool, max_pictures: int, fps: float | None, topic: str | None,
) -> Pictures:
    recording = is_recording(names, fps)
    found = Pictures(ordered=ordered or recording)
    if recording:
        with error_context(names[0]), progress("detecting lamps", max_pictures) as advance:
            for frame in frames_of(names[0], fps, topic, found.notes, max_pictures):
                detector.add(found, frame.name or f"frame {frame.index}", frame.image, frame.time_s)
                found.frames.append(frame.index)
                advance()
        return found
    files: list[str] = []
    for name in names:
        with error_context(name):
            if Path(name).is_dir():
                inside = image_files(Path(name))
                if not inside:
                    raise ValueError(f"{name}: contains no images ({', '.join(ENDINGS)})")
                files += inside
            else:
                files.append(name)
    if len(set(files)) < len(files):
        repeated = next(name for name in files if files.count(name) > 1)
        with error_context(repeated):
            raise ValueError("is given twice")
    with progress("detecting lamps", len(files)) as advance:
        for name in files:
            with error_context(name):
                detector.add(found, name, read_image(name))
            advance()
    return found
