# SPDX-License-Identifier: Apache-2.0
"""Ground truth of a frame as plain data."""

import math
from typing import Any

import numpy as np

from ..._core import EffectPlan, Lamp, LampTruth, Scene, Truth, moved_pose
from .masks import Silhouette, hidden_pixels, run_lengths


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def effect_dict(plan: EffectPlan) -> dict[str, Any]:
    """Plan of an effect as plain data; an unknown bound is null."""
    return {
        "effect": plan.effect,
        "use": plan.use.name,
        "called_for": plan.called_for,
        "applied": plan.applied,
        "bound_dn": _finite(plan.bound_dn),
        "bound_px": _finite(plan.bound_px),
        "reason": plan.reason,
    }


def exposure_time_s(scene: Scene, pixel: Any) -> float:
    """Time from the start of the first row's exposure to the middle of the exposure of a pixel's row [s]."""
    by_columns = scene.sensor.readout.name == "columns"
    lines = scene.camera.width if by_columns else scene.camera.height
    line = min(max(float(pixel[0 if by_columns else 1]), 0.0), lines - 1.0)
    return line * scene.sensor.row_time_s + 0.5 * scene.sensor.exposure_s


def lamp_dict(lamp: Lamp, truth: LampTruth, scene: Scene, pose: Any) -> dict[str, Any]:
    """Truth of a lamp. pose: of the camera when the row of the lamp's centre is exposed."""
    data: dict[str, Any] = {
        "id": truth.id,
        "in_view": truth.in_view,
        "whole": truth.whole,
        "centre_px": np.ravel(truth.centre_px).tolist(),
        "image_centre_px": np.ravel(truth.image_centre_px).tolist(),
        "electrons": truth.electrons,
        "hidden": truth.hidden,
        "cam_from_world": np.asarray(pose).tolist(),
        "rim_px": np.asarray(truth.rim_px).tolist(),
    }
    if truth.in_view:
        silhouette = Silhouette(np.asarray(truth.rim_px), np.ravel(truth.image_centre_px))
        mask = silhouette.within(scene.camera.width, scene.camera.height)
        data["silhouette"] = {"pixels": int(silhouette.pixels.sum()), "box_px": silhouette.box()}
        data["mask"] = data["mask_visible"] = run_lengths(mask)
        if truth.hidden > 0:
            hidden = hidden_pixels(mask, lamp, scene, np.asarray(pose))
            data["mask_visible"] = run_lengths(mask & ~hidden)
    return data


def frame_dict(scene: Scene, truth: Truth, time_s: float, velocity: Any) -> dict[str, Any]:
    """Truth of a frame. Its pose refers to the start of the first row's exposure; that of each lamp to the exposure of
    the lamp's row."""
    lamps = []
    for lamp, seen in zip(scene.lamps, truth.lamps, strict=True):
        after_s = exposure_time_s(scene, np.ravel(seen.centre_px))
        pose = moved_pose(truth.cam_from_world, velocity, after_s)
        lamps.append(lamp_dict(lamp, seen, scene, pose))
    return {
        "time_s": time_s,
        "cam_from_world": truth.cam_from_world.tolist(),
        "velocity": np.ravel(velocity).tolist(),
        "position_m": np.ravel(truth.position_m).tolist(),
        "lamps": lamps,
        "effects": [effect_dict(plan) for plan in truth.effects],
    }
