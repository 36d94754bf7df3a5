# SPDX-License-Identifier: Apache-2.0
"""From images of lamps that blink their ids: who is who is read first, then the lamps are tracked.

Nothing has to be known beforehand, not even where the lamps' pattern is its own mirror or turned
image: the ids tell. They are read from the last two seconds of images (`occ.codes.decode`); as soon as
lamps that say known ids leave one pose, the tracker begins with it in the middle of that time and
catches up. While it tracks, ids go on being read: when they contradict the pose, or when the tracker
is lost, it begins again.
"""

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._core import Blob, Code, CodeKind, Decoded, Prior, Rung, Scene, Tracker, decode, locate
from ...streams.frames import Pixels
from .positioner import Seen, seen_of
from .record import Pose

WINDOW = 45  # frames: UFSOOK says an id of 8 bits in 34; longer ones hold more motion
FIRST_TRY = 10  # frames; those that say a bit in two frames take longer
LONG_CODES = {CodeKind.ufsook: 30, CodeKind.s2psk: 30}
TRY_EVERY = 5  # frames while ids are not known
CHECK_EVERY = 60  # frames while they are
LEAST_SEEN = 4  # frames with a blob of a light
SIGMA_PX = 3  # of a lamp in the middle of the window: it is seen in parts, and moves
MOST_RMS_PX = 6  # beyond it a light was lost and another one taken for it
PLACE_SIGMA_M, TURN_SIGMA_RAD = 0.15, 0.05  # added: a light that was dark for long is off by more
CONTRADICTED_PX = 60  # a lamp that says its id so far from where the pose puts it is another one


@dataclass
class _Kept:
    """A frame of the window."""

    number: int
    time_s: float
    image: Pixels
    pose: Pose | None = None


@dataclass(frozen=True)
class _Read:
    """What the lights of a window say, and where they are in its middle frame: Blobs without a rim,
    with the lamp_id of those that said one."""

    middle: int  # number of that frame
    time_s: float  # of it
    frames: int  # of the window
    blobs: list[Blob]

    @property
    def named(self) -> dict[int, NDArray[np.float64]]:
        return {blob.lamp_id: blob.centroid_px for blob in self.blobs if blob.lamp_id is not None}


def lights(found: Decoded, frame: int, width: int, height: int) -> list[Blob]:
    """As blobs, where they are in a frame."""
    blobs = []
    for lamp, blob in zip(found.lamps, found.blobs, strict=True):
        x, y = lamp.track_px[frame]
        if lamp.seen >= LEAST_SEEN and 0 <= x < width and 0 <= y < height:
            blobs.append(Blob(
                centroid_px=(x, y), covariance_px2=SIGMA_PX**2 * np.eye(2), area_px=blob.area_px,
                flux_dn=blob.flux_dn, lamp_id=blob.lamp_id,
            ))
    return blobs


class CodedPositioner:
    """live: ids are read beside, while frames go on coming; else each reading is waited for, so that
    the same frames give the same answers."""

    def __init__(self, scene: Scene, code: Code, prior: Prior | None = None, live: bool = False):
        self._scene, self._code, self._prior = scene, code, prior
        # Three lamps leave poses near the ceiling, too, unless something tells up from down.
        self._least = 3 if prior is not None and (prior.height_m is not None or prior.gravity_in_cam is not None) else 4
        self._lamps = {lamp.id: np.asarray(lamp.centre_m) for lamp in scene.lamps}
        self._readers = ThreadPoolExecutor(1) if live else None
        self._forget()

    def begin_anew(self, time_s: float) -> None:
        self._forget()

    def _forget(self) -> None:
        self._window: deque[_Kept] = deque(maxlen=WINDOW)
        self._tracker: Tracker | None = None
        self._number = 0
        self._reading: Future[_Read] | None = None
        self._said = "ids are being read"

    def add(self, image: Pixels, time_s: float) -> Seen:
        kept = _Kept(self._number, time_s, image)
        self._window.append(kept)
        self._number += 1
        if self._tracker is not None:
            return self._tracked(kept)
        read = self._next_reading()
        if read is not None and self._begin(read):
            return self._catch_up(read)
        return Seen("searching", self._said)

    def _tracked(self, kept: _Kept) -> Seen:
        assert self._tracker is not None
        seen = seen_of(self._tracker.add_image(kept.image, kept.time_s))
        if seen.state in ("lost", "searching"):
            return self._give_up(seen.reason)
        kept.pose = seen.pose
        read = self._next_reading()
        if read is not None and (lamp := self._contradicted(read)) is not None:
            return self._give_up(f"lamp {lamp} says its id where the pose does not put it")
        return seen

    def _give_up(self, reason: str) -> Seen:
        self._tracker, self._reading = None, None
        self._said = f"ids are being read: {reason}"
        return Seen("lost", reason)

    def _next_reading(self) -> _Read | None:
        """Of this window, if one is due; live: one that was begun earlier, when it is done."""
        if self._reading is not None:
            if not self._reading.done():
                return None
            done, self._reading = self._reading, None
            return done.result()
        due = CHECK_EVERY if self._tracker is not None else TRY_EVERY
        if len(self._window) < LONG_CODES.get(self._code.kind, FIRST_TRY) or self._number % due:
            return None
        frames = list(self._window)
        if self._readers is None:
            return self._read(frames)
        self._reading = self._readers.submit(self._read, frames)
        return None

    def _read(self, frames: list[_Kept]) -> _Read:
        found = decode(
            [frame.image for frame in frames], [frame.time_s for frame in frames], self._scene.sensor,
            self._code, map=self._scene,
        )
        middle, camera = len(frames) // 2, self._scene.camera
        return _Read(
            frames[middle].number, frames[middle].time_s, len(frames),
            lights(found, middle, camera.width, camera.height),
        )

    def _begin(self, read: _Read) -> bool:
        """Whether a lamp has said its id and the lights leave one pose; the tracker then begins with it."""
        ids = " ".join(map(str, sorted(read.named)))
        self._said = f"ids are being read: {ids or 'none'} of {len(read.blobs)} lights in {read.frames} frames"
        if not read.named:
            return False
        fix = locate(read.blobs, self._scene, self._prior, use_brightness=False, rung=Rung.centres)
        if not fix.ok or len(fix.lamps) < self._least or fix.rms_px > MOST_RMS_PX:
            self._said += "; " + (fix.message or f"{len(fix.lamps)} of the {self._least} lamps that a pose needs")
            return False
        grown = fix.covariance + np.diag([TURN_SIGMA_RAD**2] * 3 + [PLACE_SIGMA_M**2] * 3)
        self._tracker = Tracker(self._scene, self._prior)
        self._tracker.start(read.time_s, fix.cam_from_world, grown)
        return True

    def _catch_up(self, read: _Read) -> Seen:
        """The frames since the middle of what was read, once more."""
        assert self._tracker is not None
        seen = Seen("searching", self._said)
        for kept in self._window:
            if kept.number >= read.middle:
                seen = seen_of(self._tracker.add_image(kept.image, kept.time_s))
                kept.pose = seen.pose
        if seen.pose is None:
            return self._give_up(seen.reason or "the tracker did not follow")
        ids = " ".join(map(str, sorted(read.named)))
        return replace(seen, warning=f"ids are known after {self._number} frames: {ids}")

    def _contradicted(self, read: _Read) -> int | None:
        """A lamp that said its id elsewhere than the pose of the middle frame puts it."""
        kept = next((kept for kept in self._window if kept.number == read.middle), None)
        if kept is None or kept.pose is None:
            return None
        for id, seen_px in read.named.items():
            in_cam = (kept.pose.cam_from_world @ np.append(self._lamps[id], 1.0))[:3]
            expected_px = self._scene.camera.project(in_cam)
            if expected_px is None or np.linalg.norm(expected_px - seen_px) > CONTRADICTED_PX:
                return id
        return None
