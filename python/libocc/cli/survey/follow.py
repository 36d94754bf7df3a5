# SPDX-License-Identifier: Apache-2.0
"""Lamps that are followed through all frames of a recording, and the ids that they transmit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..._core import Blob, Code, Sensor, decode, track_blobs
from ...streams.frames import Pixels
from .. import error_context
from ..progress import progress
from .sources import Detector, Pictures, frames_of

MAX_FRAMES = 1500  # of a recording that are read to follow lamps: 50 s at 30 frames/s
DECODED_FRAMES = 100  # decoded together: an id of 8 bits takes 34 frames at the frame rate
JOIN_FRAMES = (15, 5, 1)  # of a camera that is held still, that moves slowly, and that moves fast
NOMINAL_S = 1 / 30  # between frames without times
# Motion of lamps in the image of a camera that is carried by hand.
SPEED_PX_S, ACCELERATION_PX_S2 = 400.0, 500.0
# A track that waits for its lamp takes up others, such as those after a cut. Lamps that transmit are dark in some
# frames.
LIT_GAP_S, CODED_GAP_S = 0.1, 0.25


@dataclass(frozen=True)
class TimedFrame:
    """Frame of a recording; its index counts all frames."""

    index: int
    time_s: float
    image: Pixels


def all_frames(name: str, fps: float | None, topic: str | None) -> Iterator[TimedFrame]:
    """Frames for following; what is wrong with them has been said when pictures were read."""
    for frame in frames_of(name, fps, topic, [], MAX_FRAMES):
        if frame.image is not None:
            time_s = frame.index * NOMINAL_S if frame.time_s is None else frame.time_s
            yield TimedFrame(frame.index, time_s, frame.image)


def follow(
    name: str, detector: Detector, found: Pictures, fps: float | None, topic: str | None, coded: bool = False
) -> None:
    """Sets the tracks of the blobs of all pictures. coded: lamps may be dark. Raises: Failure naming the source."""
    picture_of = {index: number for number, index in enumerate(found.frames)}
    rows: list[tuple[float, list[Blob]]] = []
    numbers: list[int | None] = []
    with error_context(name), progress("following lamps", MAX_FRAMES) as advance:
        for frame in all_frames(name, fps, topic):
            picture = picture_of.get(frame.index)
            numbers.append(picture)
            blobs = detector.lamps(frame.image) if picture is None else found.blobs[picture][1]
            rows.append((frame.time_s, blobs))
            advance()
    tracks = track_blobs(
        rows, speed_sigma_px_s=SPEED_PX_S, acceleration_px_s2=ACCELERATION_PX_S2,
        max_gap_s=CODED_GAP_S if coded else LIT_GAP_S,
    )
    found.tracks = [[-1] * len(blobs) for _, blobs in found.blobs]
    for number, of_frame in zip(numbers, tracks):
        if number is not None:
            found.tracks[number] = of_frame


def read_codes(
    name: str, detector: Detector, code: Code, found: Pictures, fps: float | None, topic: str | None,
    lamp_of_id: dict[int, int] | None = None,
) -> None:
    """Reads ids as read_ids() does, says if there are none, and follows the lamps.

    detector: with a sensor. Raises: Failure naming the source.
    """
    assert detector.sensor is not None
    if read_ids(name, detector.sensor, code, found, fps, topic, lamp_of_id) == 0:
        whose = "" if lamp_of_id is None else " of a lamp of the map"
        found.notes.append(f"--code {code.kind.name}: no id{whose} could be read")
    follow(name, detector, found, fps, topic, coded=True)


def read_ids(
    name: str, sensor: Sensor, code: Code, found: Pictures, fps: float | None, topic: str | None,
    lamp_of_id: dict[int, int] | None = None,
) -> int:
    """Sets the lamp_id of the blobs of all pictures to the id that their lamp transmits.

    lamp_of_id: lamps of a map by the ids that they transmit; other ids are left out. Returns: the number of ids.
    """
    ids: set[int] = set()
    chunk: list[TimedFrame] = []
    fresh = 0  # frames of the chunk that were not decoded yet
    with error_context(name), progress("reading the ids of lamps", MAX_FRAMES) as advance:
        for frame in all_frames(name, fps, topic):
            chunk.append(frame)
            fresh += 1
            if len(chunk) == DECODED_FRAMES:
                ids |= read_chunk(chunk, sensor, code, found, lamp_of_id)
                # The chunks overlap by half, so that lamps in view across the end of one are read.
                chunk, fresh = chunk[DECODED_FRAMES // 2 :], 0
            advance()
        if fresh > 0:
            ids |= read_chunk(chunk, sensor, code, found, lamp_of_id)
    return len(ids)


def read_chunk(
    chunk: list[TimedFrame], sensor: Sensor, code: Code, found: Pictures,
    lamp_of_id: dict[int, int] | None,
) -> set[int]:
    """Decodes frames that follow each other, and names the blobs of their pictures."""
    images, times_s = [frame.image for frame in chunk], [frame.time_s for frame in chunk]
    lamps = [
        lamp for count in JOIN_FRAMES for lamp in decode(images, times_s, sensor, code, join_frames=count).lamps
    ]
    ids = set()
    pictures = {index: number for number, index in enumerate(found.frames)}
    for lamp in lamps:
        if lamp.id is None or (lamp_of_id is not None and lamp.id not in lamp_of_id):
            continue
        ids.add(lamp.id)
        for number in lamp.seen_frames:  # elsewhere its place is extrapolated
            index = chunk[number].index
            if index not in pictures:
                continue
            _, blobs = found.blobs[pictures[index]]
            nearest = blob_at(blobs, lamp.track_px[number])
            if nearest is not None:
                known = lamp.id if lamp_of_id is None else lamp_of_id[lamp.id]
                blobs[nearest] = blobs[nearest].replace(lamp_id=known)
    return ids


def blob_at(blobs: Sequence[Blob], at_px: NDArray[np.float64]) -> int | None:
    """Index of the blob whose box, with a margin of 3 px, contains a point; of several, the nearest."""
    inside = [
        (float(np.linalg.norm(blob.centroid_px - at_px)), number)
        for number, blob in enumerate(blobs)
        if blob.x0 - 3 <= at_px[0] <= blob.x1 + 3 and blob.y0 - 3 <= at_px[1] <= blob.y1 + 3
    ]
    return min(inside)[1] if inside else None
