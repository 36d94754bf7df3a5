# SPDX-License-Identifier: Apache-2.0
"""Runs the rungs on every frame and collects the data of their statistics."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _core
from .experiment import Experiment
from .peers import Peer, answer

OUTLIER = 10.0  # multiple of the expected error (bound of the rung's observations including their bias)


@dataclass
class Rung:
    """One rung with lists of results, one entry per frame on which it was run."""

    name: str
    family: str
    description: str
    peer: Peer | None = None
    time_s: list[float] = field(default_factory=list)
    answered: list[bool] = field(default_factory=list)
    # One entry per answer: (position [m], rotation [rad]).
    error: list[tuple[float, float]] = field(default_factory=list)
    bound: list[tuple[float, float]] = field(default_factory=list)  # of the rung's observations
    expected: list[tuple[float, float]] = field(default_factory=list)  # bound including the bias
    all_pixels: list[tuple[float, float]] = field(default_factory=list)  # bound of all pixels

    @property
    def key(self) -> str:
        return self.name if self.peer is None else f"{self.family.lower()}:{self.name}"

    @property
    def foreign(self) -> bool:
        return self.family not in ("libocc", "OpenGV")


@dataclass
class Run:
    """Results of all rungs."""

    rungs: list[Rung]
    frames: int = 0
    lamps: list[int] = field(default_factory=list)
    detect_s: list[float] = field(default_factory=list)
    interrupted: bool = False


def own_rungs() -> list[Rung]:
    return [Rung(step.name, step.family, step.what) for step in _core.ladder_steps()]


def peer_rungs(peers: Sequence[Peer]) -> list[Rung]:
    return [Rung(peer.name, peer.family, peer.description, peer) for peer in peers]


def run(
    experiment: Experiment, rungs: Sequence[Rung], frames: int, min_time_s: float,
    advance: Callable[[], None],
) -> Run:
    """Runs all rungs on all frames. Ctrl-C ends the run; completed frames are kept."""
    result = Run(list(rungs))
    steps = [rung.name for rung in rungs if rung.peer is None]
    try:
        for number in range(frames):
            pose = experiment.pose(number)
            image = experiment.image(number, pose)
            frame = _core.ladder_frame(image, experiment.scene, pose, steps, min_time_s)
            if frame.outcomes:
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
            if len(frame.points_px) < 3:
                continue
            returned = answer(rung.peer, frame.points_in_world_m, frame.points_px, camera)
            time_s, found, bound = returned.time_s, returned.cam_from_world, frame.points
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
    """Errors of position [m] and rotation [rad]."""
    between = found[:3, :3] @ true[:3, :3].T
    sine = 0.5 * np.linalg.norm(
        [between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]]
    )
    angle = float(np.arctan2(sine, 0.5 * (np.trace(between) - 1)))
    position, true_position = (-pose[:3, :3].T @ pose[:3, 3] for pose in (found, true))
    return float(np.linalg.norm(position - true_position)), angle
