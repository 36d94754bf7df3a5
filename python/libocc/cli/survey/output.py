# SPDX-License-Identifier: Apache-2.0
"""Files and text of a survey."""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Code, Lamp, LampShape, MapUpdate, Scene, Sensor, Survey, SurveyScale, Trajectory
from ...surveying import assumptions_of, joint_covariance_m2, known_precision, scene_of
from ..calibration.figures import png_bytes
from ..calibration.report import table
from ..result_folder import ResultFolder, json_bytes
from .figure import plan
from .sources import Pictures

SHOWN_OMISSIONS = 8  # lines of the text output; the JSON has all


def unit_of(found: Survey) -> str:
    return "units of free scale" if found.scale == SurveyScale.free else "m"


def camera_places(found: Survey) -> tuple[list[str], NDArray[np.float64]]:
    """Names and positions (n, 3) of the pictures that are used, in their order."""
    network = found.network
    images = [image for image in found.image_of_picture if image >= 0]
    poses = [np.asarray(network.cam_from_world(image)) for image in images]
    names = [network.image_names[image] for image in images]
    return names, np.array([-pose[:3, :3].T @ pose[:3, 3] for pose in poses])


def inertial_data(found: Survey) -> dict[str, Any] | None:
    if found.inertial is None:
        return None
    return {
        "down": found.inertial.down.tolist(), "cam_from_imu": found.inertial.cam_from_imu.tolist(),
        "time_offset_s": found.inertial.time_offset_s,
        "turn_rate_bias_rad_s": found.inertial.turn_rate_bias_rad_s.tolist(),
    }


def survey_data(found: Survey, scene: Scene) -> dict[str, Any]:
    """Plain data of the survey for result.json, beside those of the adjustment."""
    names, places = camera_places(found)
    sigmas_m = {lamp.id: sigma_of(lamp, scene).tolist() for lamp in scene.lamps}
    return {
        "scale": found.scale.name, "scale_sigma": found.scale_sigma, "inertial": inertial_data(found),
        "assumed": assumptions_of(found),
        "lamps": [
            {
                "id": s.lamp.id, "shape": s.lamp.shape.name, "centre_m": list(map(float, s.lamp.centre_m)),
                "normal": list(map(float, s.lamp.normal)), "radius_m": float(s.lamp.radius_m),
                "size_m": list(map(float, s.lamp.size_m)), "size_sigma": float(s.lamp.size_sigma),
                "tilt_sigma_rad": s.lamp.tilt_sigma_rad, "relative_power": s.lamp.power_w if s.has_power else None,
                "colour": list(map(float, s.lamp.colour)), "code_id": s.code_id, "frequency_hz": s.lamp.frequency_hz,
                "pictures": s.pictures, "sigma_m": sigmas_m.get(s.lamp.id),
            }
            for s in found.lamps
        ],
        "pictures": [
            {"name": name, "position_m": list(map(float, place))} for name, place in zip(names, places)
        ],
        "omissions": omissions_of(found),
    }


def sigma_of(lamp: Lamp, scene: Scene) -> NDArray[np.float64]:
    """(3,) standard deviations of a lamp's position with the errors that lamps share."""
    middle_m = np.mean([each.centre_m for each in scene.lamps], axis=0)
    shared = np.vstack([*lamp.shared_errors_m, scene.map_scale_sigma * (lamp.centre_m - middle_m)])
    own = 0.0 if lamp.position_sigma_m is None else np.asarray(lamp.position_sigma_m) ** 2
    return np.asarray(np.sqrt(own + (shared**2).sum(axis=0)))


def omissions_of(found: Survey | MapUpdate) -> list[dict[str, Any]]:
    return [
        {"picture": o.picture, "blob": None if o.blob < 0 else o.blob, "reason": o.reason} for o in found.omissions
    ]


def omissions_table(found: Survey | MapUpdate) -> str:
    """Table of the report: everything that is not used."""
    rows = [(o.picture, "the picture" if o.blob < 0 else f"blob {o.blob}", o.reason) for o in found.omissions]
    return "<h2>Not used</h2>" + (table(("picture", "part", "reason"), rows) if rows else "<p>nothing</p>")


def omission_lines(found: Survey | MapUpdate) -> list[str]:
    """Lines of the text output: pictures that are not used, then blobs."""
    shown = [o for o in found.omissions if o.blob < 0] + [o for o in found.omissions if o.blob >= 0]
    lines = [
        f"not used: {o.picture}{'' if o.blob < 0 else f', blob {o.blob}'}: {o.reason}" for o in shown[:SHOWN_OMISSIONS]
    ]
    if len(shown) > SHOWN_OMISSIONS:
        lines.append(f"not used: {len(shown) - SHOWN_OMISSIONS} more, see result.json")
    return lines


def plan_image(figure_png: bytes) -> str:
    """The plan as an element of the report."""
    image = base64.b64encode(figure_png).decode()
    return f'<p><img alt="plan of the room" src="data:image/png;base64,{image}"></p>'


def trajectory(poses: Sequence[Any], times_s: Sequence[float | None]) -> bytes:
    """Poses of the pictures (4x4, or None) in TUM format; if a time is unknown, times are the numbers of pictures."""
    known_s = [time_s for time_s in times_s if time_s is not None]
    if len(known_s) < len(times_s):
        known_s = [float(number) for number in range(len(times_s))]
    used = [(time_s, np.asarray(pose)) for time_s, pose in zip(known_s, poses) if pose is not None]
    return Trajectory([time_s for time_s, _ in used], [pose for _, pose in used]).format().encode()


def sections_of(found: Survey, figure_png: bytes) -> list[str]:
    lamps = [
        (
            s.lamp.id, s.pictures, size_text(s.lamp),
            f"{100 * s.lamp.size_sigma:.2g} %" if s.has_shape else "unknown",
        )
        for s in found.lamps
    ]
    return [
        f"<h2>Plan</h2>{plan_image(figure_png)}",
        "<h2>Lamps</h2>" + table(("lamp", "pictures", f"size [{unit_of(found)}]", "sigma of the size"), lamps),
        omissions_table(found),
    ]


def size_text(lamp: Lamp) -> str:
    if lamp.shape == LampShape.disc:
        return f"radius {lamp.radius_m:.4g}"
    if lamp.shape == LampShape.point:
        return "unknown"
    return f"{lamp.size_m[0]:.4g} x {lamp.size_m[1]:.4g}"


def plan_png(found: Survey, scene: Scene, ordered: bool) -> bytes:
    known = known_precision(found)
    ids = [lamp.id for lamp in scene.lamps]
    joint = joint_covariance_m2(found, known, ids)
    _, places = camera_places(found)
    covariances = joint[range(len(ids)), range(len(ids))]
    return png_bytes(plan(scene.lamps, covariances, places, ordered, unit_of(found)))


def write_survey(
    folder: ResultFolder, found: Survey, sensor: Sensor | None, code: Code | None, tag_family: str, pictures: Pictures,
) -> tuple[dict[str, Any], Scene | None]:
    """Writes all files; returns the data of result.json, and the scene if the survey is ok."""
    if not found.ok:
        data = {
            "status": found.status.name, "message": found.message, "warnings": pictures.notes + found.warnings,
            "omissions": omissions_of(found),
        }
        folder.write("result.json", json_bytes(data))
        return data, None
    from ..._core import Datum
    from ..calibration.run import calibrate, write

    scene = scene_of(found, found.camera, sensor, code, tag_family)
    png = plan_png(found, scene, pictures.ordered)
    adjusted, _ = calibrate(found.network_with_all_observations, Datum(), notes=pictures.notes + found.warnings)
    data = write(
        folder, adjusted, f"Survey of {len(scene.lamps)} lamps", sections_of(found, png)
    )
    data = {**data, **survey_data(found, scene)}
    folder.write("result.json", json_bytes(data))
    folder.write("scene.yaml", scene.format().encode())
    folder.write("plan.png", png)
    poses = [found.network.cam_from_world(image) if image >= 0 else None for image in found.image_of_picture]
    folder.write("trajectory.tum", trajectory(poses, pictures.times_s))
    return data, scene


def text_lines(found: Survey, scene: Scene, pictures: int) -> list[str]:
    """One line per lamp, then what was not used."""
    unit = "m" if found.scale != SurveyScale.free else "(free scale)"
    factor, small = (1e3, "mm") if found.scale != SurveyScale.free else (1.0, "")
    lines = []
    for lamp in scene.lamps:
        place = " ".join(f"{value:.4f}" for value in lamp.centre_m)
        sigma = " ".join(f"{factor * s:.2g}" for s in sigma_of(lamp, scene))
        transmits = "" if lamp.code is None else f", transmits {lamp.code.id}"
        lines.append(
            f"lamp {lamp.id} at {place} {unit}, sigma {sigma} {small}".rstrip() + f", {size_text(lamp)}{transmits}"
        )
    used = sum(image >= 0 for image in found.image_of_picture)
    scale = {
        SurveyScale.free: "free: give --distance between two lamps, --tag-size or --radius",
        SurveyScale.radius: "of the radius", SurveyScale.distances: "of the distances", SurveyScale.tags: "of the tags",
        SurveyScale.odometry: "of the odometry", SurveyScale.imu: "of the inertial measurements",
    }[found.scale]
    if found.inertial is not None:
        scale += f" to {100 * found.inertial.scale_sigma:.2g} %, their clock {found.inertial.time_offset_s:+.3f} s"
    lines.append(f"{used} of {pictures} pictures, sigma0 {found.sigma0:.3g}, scale {scale}")
    return lines + omission_lines(found)
