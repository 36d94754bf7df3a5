# SPDX-License-Identifier: Apache-2.0
"""Fixes, blobs and ground truth as plain data for JSON and as text for the terminal."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import (
    Blob,
    BlobColour,
    Camera,
    Candidate,
    Fix,
    Hypothesis,
    Identification,
    PoseCircle,
    ProtectionLevel,
    RungChoice,
    Scene,
    Status,
    Symmetry,
    Truth,
    heading_rad,
)


def sigmas_mm(found: Fix | Candidate) -> list[float]:
    """Standard deviation of the position along the world's axes [mm]."""
    return [float(s) * 1e3 for s in np.sqrt(np.diag(found.position_covariance_m2))]


def sigma_px(blob: Blob) -> float:
    """Standard deviation of the centroid [px], root mean square over directions."""
    return float(np.sqrt(np.trace(blob.covariance_px2) / 2))


def flags(blob: Blob) -> list[str]:
    """Names of the flags that are set."""
    named = ("saturated", "merged", "cut_by_border", "hidden_in_part", "patterned", "striped", "free_form")
    return [name for name in named if getattr(blob, name)]


def colour_dict(colour: BlobColour) -> dict[str, Any]:
    """Colour of a blob as plain data."""
    return {"share": colour.share.tolist(), "sigma": colour.sigma.tolist(), "clipped": list(colour.clipped)}


def blob_dict(blob: Blob) -> dict[str, Any]:
    """Blob as plain data, without its rim points."""
    return {
        "centroid_px": blob.centroid_px.tolist(),
        "covariance_px2": blob.covariance_px2.tolist(),
        "flux_dn": blob.flux_dn,
        "flux_sigma_dn": blob.flux_sigma_dn,
        "peak_dn": blob.peak_dn,
        "background_dn": blob.background_dn,
        "noise_dn": blob.noise_dn,
        "area_px": blob.area_px,
        "box_px": [blob.x0, blob.y0, blob.x1, blob.y1],
        "ellipse": {
            "centre_px": blob.ellipse.centre_px.tolist(),
            "semi_major_px": blob.ellipse.semi_major_px,
            "semi_minor_px": blob.ellipse.semi_minor_px,
            "angle_rad": blob.ellipse.angle_rad,
        },
        "rim_points": len(blob.rim),
        "flags": flags(blob),
        "lamp_id": blob.lamp_id,
        "colour": None if blob.colour is None else colour_dict(blob.colour),
        "frequency_hz": blob.frequency_hz,
        "frequency_sigma_hz": None if blob.frequency_hz is None else blob.frequency_sigma_hz,
    }


def candidate_dict(found: Fix | Candidate) -> dict[str, Any]:
    """Pose of a fix or of a candidate as plain data."""
    return {
        "position_m": found.position_m.tolist(),
        "position_covariance_m2": found.position_covariance_m2.tolist(),
        "heading_rad": heading_rad(found.cam_from_world),
        "cam_from_world": found.cam_from_world.tolist(),
        "covariance": found.covariance.tolist(),
        "rms_px": found.rms_px,
        "lamps": {str(id): blob_dict(blob) for id, blob in found.lamps.items()},
    }


def parameters_dict(camera: Camera | None) -> dict[str, float] | None:
    """Parameters of an estimated camera by name."""
    return None if camera is None else {parameter.name: parameter.value for parameter in camera.parameters}


def _candidate_dict(candidate: Candidate) -> dict[str, Any]:
    return {
        **candidate_dict(candidate),
        "probability": candidate.probability,
        "variance_factor": candidate.variance_factor,
        "estimated_map_sigma_m": candidate.estimated_map_sigma_m,
        "estimated_size_sigma": candidate.estimated_size_sigma,
        "estimated_growth_px": candidate.estimated_growth_px,
        "estimated_camera": parameters_dict(candidate.estimated_camera),
    }


def choice_dict(choice: RungChoice | None) -> dict[str, Any] | None:
    """Rung of the refinement and the reason of the choice, as plain data."""
    if choice is None:
        return None
    return {
        "rung": choice.rung.name,
        "predicted_s": choice.predicted_s,
        "predicted_sigma_m": choice.predicted_sigma_m,
        "met": choice.met,
        "reason": choice.reason,
        "alternatives": [
            {"rung": f.rung.name, "predicted_s": f.predicted_s, "predicted_sigma_m": f.predicted_sigma_m}
            for f in choice.alternatives
        ],
    }


def protection_dict(level: ProtectionLevel) -> dict[str, Any]:
    """Protection level as plain data; an infinite one is None."""
    return {
        "risk": level.risk,
        "horizontal_m": level.horizontal_m if level.ok else None,
        "vertical_m": level.vertical_m if level.ok else None,
        "message": level.message,
    }


def circle_dict(circle: PoseCircle) -> dict[str, Any]:
    """Poses that one disc allows, as plain data."""
    return {
        "lamp": circle.lamp, "blob": circle.blob, "centre_m": circle.centre_m.tolist(), "axis": circle.axis.tolist(),
        "radius_m": circle.radius_m, "radius_sigma_m": circle.radius_sigma_m, "height_m": circle.height_m,
        "height_sigma_m": circle.height_sigma_m, "cam_from_world": circle.cam_from_world.tolist(),
        "information": circle.information.tolist(),
    }


def fix_dict(fix: Fix, protection_risk: float = 1e-7) -> dict[str, Any]:
    """Fix as plain data. protection_risk: risk of the protection level."""
    timing = fix.timing_s
    pose = candidate_dict(fix)
    if not fix.candidates:
        pose.update({key: None for key in pose if key != "lamps"})  # JSON has no infinity
    return {
        "ok": fix.ok,
        "status": fix.status.name,
        "message": fix.message,
        **pose,
        "risk": fix.risk,
        "taken_as_exact": fix.taken_as_exact,
        "found_colour": None if fix.found_colour is None else fix.found_colour.tolist(),
        "excluded_lamps": fix.excluded_lamps,
        "protection_level_m": protection_dict(fix.protection_level_m(protection_risk)),
        "candidates": [_candidate_dict(candidate) for candidate in fix.candidates],
        "circles": [circle_dict(circle) for circle in fix.circles],
        "choice": choice_dict(fix.choice),
        "timing_s": {
            "detect": timing.detect_s,
            "identify": timing.identify_s,
            "refine": timing.refine_s,
            "total": timing.total_s,
        },
    }


def truth_dict(truth: Truth) -> dict[str, Any]:
    """Ground truth of a rendered image as plain data, as `libocc simulate` writes it beside the image."""
    return {
        "cam_from_world": truth.cam_from_world.tolist(),
        "position_m": truth.position_m.tolist(),
        "lamps": [
            {
                "id": lamp.id,
                "in_view": lamp.in_view,
                "whole": lamp.whole,
                "centre_px": lamp.centre_px.tolist(),
                "image_centre_px": lamp.image_centre_px.tolist(),
                "electrons": lamp.electrons,
            }
            for lamp in truth.lamps
        ],
    }


def _numbers(values: Any, digits: int, width: int) -> str:
    """Aligned numbers; rounded before formatting so that -0.00 does not occur."""
    return " ".join(f"{round(float(v), digits) + 0.0:{width}.{digits}f}" for v in values)


def _ids(found: Fix | Candidate) -> str:
    return " ".join(str(id) for id in found.lamps)


def _risk(risk: float) -> str:
    return "below 1e-9" if risk < 1e-9 else f"{risk:.1g}"


def _probability(candidate: Candidate) -> str:
    return "" if candidate.probability is None else f"probability {candidate.probability:.2g}  "


def _protection(level: ProtectionLevel) -> str:
    if not level.ok:
        return f"level     infinite: {level.message}"
    return (
        f"level     {1e3 * level.horizontal_m:.2f} mm horizontal, {1e3 * level.vertical_m:.2f} mm vertical "
        f"at a risk of {level.risk:.1g}"
    )


def fix_text(fix: Fix, explain: bool = False, protection_risk: float | None = None) -> str:
    """Fix as text. explain: adds the reason for the choice of the rung. protection_risk: adds the protection level."""
    timing = fix.timing_s
    lines = [f"status    {fix.status.name}" + (f": {fix.message}" if fix.message else "")]
    if fix.candidates:
        lines += [
            f"position  {_numbers(fix.position_m, 4, 8)} m",
            f"sigma     {_numbers(sigmas_mm(fix), 2, 8)} mm",
            f"heading   {_numbers([np.degrees(heading_rad(fix.cam_from_world))], 2, 8)} deg",
        ]
        if fix.lamps:
            lines.append(f"lamps     {_ids(fix)}")
        lines.append(f"rms       {fix.rms_px:.3f} px")
        if fix.risk is not None:
            lines.append(f"risk      {_risk(fix.risk)}")
        if fix.taken_as_exact:
            exact = " and ".join(fix.taken_as_exact)
            best = fix.candidates[0]
            estimated = (best.estimated_map_sigma_m, best.estimated_size_sigma, best.estimated_growth_px,
                         best.estimated_camera)
            contained = "is that of the image alone" if estimated == (None,) * 4 else "allows for the errors above"
            lines.append(f"exact     {exact}, by the scene: the sigma {contained}")
        if fix.excluded_lamps:
            lines.append(f"excluded  {' '.join(str(id) for id in fix.excluded_lamps)}")
        if protection_risk is not None:
            lines.append(_protection(fix.protection_level_m(protection_risk)))
    if timing.total_s > 0:
        lines.append(
            f"time      {timing.total_s * 1e3:.1f} ms (detect {timing.detect_s * 1e3:.1f}, "
            f"identify {timing.identify_s * 1e3:.1f}, refine {timing.refine_s * 1e3:.1f})"
        )
    if explain and fix.choice is not None and fix.choice.met:
        lines.append(f"rung      {fix.choice.reason}")
    if fix.status is not Status.ok and len(fix.candidates) > 1:
        lines.append("candidates, best first:")
        for i, candidate in enumerate(fix.candidates, 1):
            lines.append(
                f"  {i:2}  {_numbers(candidate.position_m, 4, 8)} m  "
                f"rms {candidate.rms_px:.3f} px  {_probability(candidate)}lamps {_ids(candidate)}"
            )
    return "\n".join(lines)


def blobs_text(blobs: list[Blob]) -> str:
    """Blobs as text, one line each."""
    lines = [" n      x px      y px  sigma px      flux dn  area px  what"]
    for i, blob in enumerate(blobs):
        x, y = blob.centroid_px
        notes = flags(blob)
        if blob.frequency_hz is not None:
            notes.append(f"{blob.frequency_hz:.1f} Hz")
        line = f"{i:2} {x:9.3f} {y:9.3f} {sigma_px(blob):9.4f} {blob.flux_dn:12.0f} {blob.area_px:8}"
        lines.append(f"{line}  {', '.join(notes)}".rstrip())
    return "\n".join(lines) if blobs else "no blobs"


def _position_m(hypothesis: Hypothesis) -> NDArray[np.float64]:
    pose = hypothesis.cam_from_world
    return np.asarray(-pose[:3, :3].T @ pose[:3, 3])


def symmetry_dict(symmetry: Symmetry | None) -> dict[str, Any] | None:
    """Symmetry that relates the best pose to another one, as plain data."""
    if symmetry is None:
        return None
    return {
        "kind": symmetry.kind.name,
        "world_from_world": symmetry.world_from_world.tolist(),
        "misfit_m": symmetry.misfit_m,
        "text": symmetry.text,
    }


def identification_dict(found: Identification, scene: Scene) -> dict[str, Any]:
    """Identification as plain data, with lamp ids."""
    return {
        "status": found.status.name,
        "message": found.message,
        "risk": found.risk,
        "chance": found.chance,
        "poses": [
            {
                "cam_from_world": h.cam_from_world.tolist(),
                "position_m": _position_m(h).tolist(),
                "probability": h.probability,
                "chi2": h.chi2,
                "missed": h.missed,
                "brightness_chi2": h.brightness_chi2,
                "symmetry": symmetry_dict(h.symmetry),
                "lamp_of_blob": {m.blob: scene.lamps[m.lamp].id for m in h.matches},
            }
            for h in found.hypotheses
        ],
    }


def identification_text(found: Identification, scene: Scene) -> str:
    """Identification as text, one line per pose."""
    lines = [f"status  {found.status.name}"]
    if found.message:
        lines.append(f"why     {found.message}")
    if found.hypotheses:
        lines.append(f"risk    {_risk(found.risk)}")
        lines.append("pose    position [m]               heading  probability   chi2  missed  lamps (blob: lamp)")
    for rank, h in enumerate(found.hypotheses, 1):
        position = _numbers(_position_m(h), 3, 9)
        heading = float(np.degrees(heading_rad(h.cam_from_world)))
        pairs = sorted((m.blob, scene.lamps[m.lamp].id) for m in h.matches)
        names = " ".join(f"{blob}:{lamp}" for blob, lamp in pairs)
        if h.symmetry is not None:
            names += f"  ({h.symmetry.text})"
        lines.append(f"{rank:<5}{position} {heading:7.2f} {h.probability:12.2g} {h.chi2:6.1f} {h.missed:7d}  {names}")
    return "\n".join(lines)
