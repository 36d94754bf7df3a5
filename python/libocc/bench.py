# SPDX-License-Identifier: Apache-2.0
"""Accuracy against computing time: rungs of the refinement, their cost, and the bound of the pose."""

from ._core import (
    LadderBound,
    LadderFrame,
    LadderOutcome,
    LadderStep,
    PoseBound,
    RungChoice,
    RungCost,
    RungCosts,
    RungForecast,
    ladder_frame,
    ladder_steps,
    missing_ladder_steps,
    pose_bound,
    time_refine,
)

__all__ = [
    "LadderBound", "LadderFrame", "LadderOutcome", "LadderStep", "PoseBound", "RungChoice", "RungCost", "RungCosts",
    "RungForecast", "ladder_frame", "ladder_steps", "missing_ladder_steps", "pose_bound", "time_refine",
]
