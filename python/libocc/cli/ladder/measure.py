# SPDX-License-Identifier: Apache-2.0
"""Runs rungs frame by frame and keeps, of each, what its figures need."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _core
from .experiment import Experiment
from .peers import Peer, answer

OUTLIER = 10.0  # times the error to be expected (the bound of what a rung sees, its bias included)


@dataclass
class Rung:
    """One rung, and a value of each list for every frame that it was run on."""

    name: str
    family: str
    what: str
    peer: Peer | None = None
    time_s: list[float] = field(default_factory=list)
    answered: list[bool] = field(default_factory=list)
    # of answers: (position [m], rotation [rad])
    error: list[tuple[float, float]] = field(default_factory=list)
    bound: list[tuple[float, float]] = field(default_factory=list)  # of what it sees
    expected: list[tuple[float, float]] = field(default_factory=list)  # its bias included
    all_pixels: list[tuple[float, float]] = field(default_factory=list)  # bound

    @property
    def key(self) -> str:
        return self.name if self.peer is None else f"{self.family.lower()}:{self.name}"

    @property
    def foreign(self) -> bool:
        return self.family not in ("libocc", "OpenGV")


@dataclass
class Run:
    """All rungs on the frames that there was time for."""

    rungs: list[Rung]
    frames: int = 0
    lamps: list[int] = field(default_factory=list)
    detect_s: list[float] = field(default_factory=list)
    interrupted: bool = False


def own_rungs() -> list[Rung]:
    return [Rung(step.name, step.family, step.what) for step in _core.ladder_steps()]


def peer_rungs(peers: Sequence[Peer]) -> list[Rung]:
    return [Rung(peer.name, peer.family, peer.what, peer) for peer in peers]


def run(
    experiment: Experiment, rungs: Sequence[Rung], frames: int, min_time_s: float,
    advance: Callable[[], None],
) -> Run:
    """Ctrl-C ends it early; the frame at hand is dropped, what came before is kept."""
    result = Run(list(rungs))
    steps = [rung.name for rung in rungs if rung.peer is None]
    try:
        for number in range(frames):
            pose = experiment.pose(number)
            image = experiment.image(number, pose)
            frame = _core.ladder_frame(image, experiment.scene, pose, steps, min_time_s)
            if len(frame.points_px) >= 3:
                _keep(result, frame, experiment, pose)
            advance()
    except KeyboardInterrupt:
        result.interrupted = True
    return result


def _keep(result: Run, frame: _core.LadderFrame, experiment: Experiment, pose: Any) -> None:
    outcomes = {outcome.name: outcome for outcome in frame.outcomes}
    camera = experiment.scene.camera
    for rung in result.rungs:
        if rung.peer is not None:
            told = answer(rung.peer, frame.points_in_world_m, frame.points_px, camera)
            time_s, found, bound = told.time_s, told.cam_from_world, frame.points
        elif rung.name in outcomes:
            outcome = outcomes[rung.name]
            time_s, bound = outcome.time_s, outcome.bound
            found = outcome.cam_from_world if outcome.answered else None
        else:
            continue
        rung.time_s.append(time_s)
        rung.answered.append(found is not None)
        if found is None:
            continue
        rung.error.append(_errors(found, pose))
        rung.bound.append((bound.position_m, bound.rotation_rad))
        rung.expected.append((bound.position_expected_m, bound.rotation_expected_rad))
        rung.all_pixels.append((frame.pixels.position_m, frame.pixels.rotation_rad))
    result.frames += 1
    result.lamps.append(len(frame.points_px))
    result.detect_s.append(frame.detect_s)


def _errors(found: Any, true: Any) -> tuple[float, float]:
    """Of position [m] and rotation [rad]."""
    between = found[:3, :3] @ true[:3, :3].T
    sine = 0.5 * np.linalg.norm(
        [between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]]
    )
    angle = float(np.arctan2(sine, 0.5 * (np.trace(between) - 1)))
    there, truly = (-pose[:3, :3].T @ pose[:3, 3] for pose in (found, true))
    return float(np.linalg.norm(there - truly)), angle
