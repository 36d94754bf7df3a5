# SPDX-License-Identifier: Apache-2.0
"""Positions from lamps that transmit their ids: the ids are decoded first, then the lamps are tracked.

No prior is required, also for symmetric lamp patterns, because the ids resolve the symmetry. The ids are decoded from
a window of recent images (`occ.codes.decode`). When the decoded lamps determine one pose, the tracker starts with it
in the middle of the window and processes the remaining images of the window. Decoding continues during tracking. If an
id contradicts the pose, or the tracker is lost, the search restarts.
"""

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._core import Blob, Code, CodeKind, Decoded, Prior, Rung, Scene, Tracker, decode, locate
from ...streams.frames import Pixels
from .positioner import FrameResult, result_of
from .record import Pose

WINDOW = 45  # frames; UFSOOK transmits an id of 8 bits in 34; a longer window has more motion
FIRST_TRY = 10  # frames before the first decoding
# Frames before the first decoding of codes with one bit in two frames.
LONG_CODES = {CodeKind.ufsook: 30, CodeKind.s2psk: 30}
TRY_EVERY = 5  # frames between decodings while searching
CHECK_EVERY = 60  # frames between decodings while tracking
MIN_FRAMES_SEEN = 4  # frames with a blob of a light
SIGMA_PX = 3  # of a lamp's position in the middle frame: covers partial images and motion
MAX_RMS_PX = 6  # a larger residual indicates that the track of a light jumped to another light
# Added to the initial pose: the interpolated position of a light is inaccurate after a long dark interval.
POSITION_SIGMA_M, ROTATION_SIGMA_RAD = 0.15, 0.05
CONTRADICTION_PX = 60  # larger distance of a decoded lamp from its predicted position: the pose is wrong


@dataclass
class _WindowFrame:
    """A frame of the window."""

    number: int
    time_s: float
    image: Pixels
    pose: Pose | None = None


@dataclass(frozen=True)
class _Decoding:
    """Lights of a window as blobs in its middle frame, with the lamp_id of those that were decoded."""

    middle: int  # number of the middle frame
    time_s: float  # of the middle frame
    frames: int  # number of frames in the window
    blobs: list[Blob]

    @property
    def decoded(self) -> dict[int, NDArray[np.float64]]:
        return {blob.lamp_id: blob.centroid_px for blob in self.blobs if blob.lamp_id is not None}


def lights(found: Decoded, frame: int, width: int, height: int) -> list[Blob]:
    """Tracked lights as blobs at their positions in a frame."""
    blobs = []
    for lamp, blob in zip(found.lamps, found.blobs, strict=True):
        x, y = lamp.track_px[frame]
        if lamp.seen >= MIN_FRAMES_SEEN and 0 <= x < width and 0 <= y < height:
            blobs.append(Blob(
                centroid_px=(x, y), covariance_px2=SIGMA_PX**2 * np.eye(2), area_px=blob.area_px,
                flux_dn=blob.flux_dn, lamp_id=blob.lamp_id,
            ))
    return blobs


class CodedPositioner:
    """Decodes ids and tracks the lamps.

    live: decoding runs in a second thread while frames arrive; otherwise each decoding is awaited, so that equal
    frames give equal results.
    """

    def __init__(self, scene: Scene, code: Code, prior: Prior | None = None, live: bool = False):
        self._scene, self._code, self._prior = scene, code, prior
        # With three lamps P3P also has solutions near the ceiling, unless height or gravity is known.
        upright = prior is not None and (prior.height_m is not None or prior.gravity_in_cam is not None)
        self._min_lamps = 3 if upright else 4
        self._lamps = {lamp.id: np.asarray(lamp.centre_m) for lamp in scene.lamps}
        self._executor = ThreadPoolExecutor(1) if live else None
        self._reset()

    def restart(self, time_s: float) -> None:
        self._reset()

    def _reset(self) -> None:
        self._window: deque[_WindowFrame] = deque(maxlen=WINDOW)
        self._tracker: Tracker | None = None
        self._number = 0
        self._pending: Future[_Decoding] | None = None
        self._status = "decoding ids"

    def add(self, image: Pixels, time_s: float) -> FrameResult:
        frame = _WindowFrame(self._number, time_s, image)
        self._window.append(frame)
        self._number += 1
        if self._tracker is not None:
            return self._tracked(frame)
        decoding = self._next_decoding()
        if decoding is not None and self._start(decoding):
            return self._process_window(decoding)
        return FrameResult("searching", self._status)

    def _tracked(self, frame: _WindowFrame) -> FrameResult:
        assert self._tracker is not None
        result = result_of(self._tracker.add_image(frame.image, frame.time_s))
        if result.state in ("lost", "searching"):
            return self._fail(result.reason)
        frame.pose = result.pose
        decoding = self._next_decoding()
        if decoding is not None and (lamp := self._contradicting_lamp(decoding)) is not None:
            return self._fail(f"lamp {lamp} was decoded far from its predicted position")
        return result

    def _fail(self, reason: str) -> FrameResult:
        self._tracker, self._pending = None, None
        self._status = f"decoding ids: {reason}"
        return FrameResult("lost", reason)

    def _next_decoding(self) -> _Decoding | None:
        """Decodes the window if due; live: returns the result of an earlier decoding when it is finished."""
        if self._pending is not None:
            if not self._pending.done():
                return None
            done, self._pending = self._pending, None
            return done.result()
        due = CHECK_EVERY if self._tracker is not None else TRY_EVERY
        if len(self._window) < LONG_CODES.get(self._code.kind, FIRST_TRY) or self._number % due:
            return None
        frames = list(self._window)
        if self._executor is None:
            return self._decode(frames)
        self._pending = self._executor.submit(self._decode, frames)
        return None

    def _decode(self, frames: list[_WindowFrame]) -> _Decoding:
        found = decode(
            [frame.image for frame in frames], [frame.time_s for frame in frames], self._scene.sensor,
            self._code, map=self._scene,
        )
        middle, camera = len(frames) // 2, self._scene.camera
        return _Decoding(
            frames[middle].number, frames[middle].time_s, len(frames),
            lights(found, middle, camera.width, camera.height),
        )

    def _start(self, decoding: _Decoding) -> bool:
        """Starts the tracker and returns True if a lamp is decoded and the lights determine one pose."""
        ids = " ".join(map(str, sorted(decoding.decoded)))
        self._status = f"decoding ids: {ids or 'none'} of {len(decoding.blobs)} lights in {decoding.frames} frames"
        if not decoding.decoded:
            return False
        fix = locate(decoding.blobs, self._scene, self._prior, use_brightness=False, rung=Rung.centres)
        if not fix.ok or len(fix.lamps) < self._min_lamps or fix.rms_px > MAX_RMS_PX:
            needed = f"{len(fix.lamps)} of at least {self._min_lamps} lamps required for a pose"
            self._status += "; " + (fix.message or needed)
            return False
        grown = fix.covariance + np.diag([ROTATION_SIGMA_RAD**2] * 3 + [POSITION_SIGMA_M**2] * 3)
        self._tracker = Tracker(self._scene, self._prior)
        self._tracker.start(decoding.time_s, fix.cam_from_world, grown)
        return True

    def _process_window(self, decoding: _Decoding) -> FrameResult:
        """Processes the frames since the middle of the decoded window again, with the tracker."""
        assert self._tracker is not None
        result = FrameResult("searching", self._status)
        for frame in self._window:
            if frame.number >= decoding.middle:
                result = result_of(self._tracker.add_image(frame.image, frame.time_s))
                frame.pose = result.pose
        if result.pose is None:
            return self._fail(result.reason or "the tracker has no pose")
        ids = " ".join(map(str, sorted(decoding.decoded)))
        return replace(result, warning=f"ids were decoded after {self._number} frames: {ids}")

    def _contradicting_lamp(self, decoding: _Decoding) -> int | None:
        """Id of a lamp that was decoded far from its predicted position in the middle frame, or None."""
        frame = next((frame for frame in self._window if frame.number == decoding.middle), None)
        if frame is None or frame.pose is None:
            return None
        for id, seen_px in decoding.decoded.items():
            in_cam = (frame.pose.cam_from_world @ np.append(self._lamps[id], 1.0))[:3]
            expected_px = self._scene.camera.project(in_cam)
            if expected_px is None or np.linalg.norm(expected_px - seen_px) > CONTRADICTION_PX:
                return id
        return None
