# SPDX-License-Identifier: Apache-2.0
"""Maps of lamps from pictures alone: survey() and the scene of its result; update_map() of a map by new pictures.

    pictures = [(name, occ.detect(occ.read_image(name))) for name in names]
    found = occ.surveying.survey(pictures, camera, radius_m=0.08)
    scene = occ.surveying.scene_of(found, camera)

    update = occ.surveying.update_map(pictures, scene)
    scene = occ.surveying.updated_scene(update, scene)
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ._core import (
    Camera,
    Code,
    InertialAlignment,
    LampChange,
    LampCode,
    LampFate,
    LampUpdate,
    MapUpdate,
    MapWay,
    Precision,
    Scene,
    Sensor,
    Survey,
    SurveyedLamp,
    SurveyOmission,
    SurveyScale,
    Tag,
    Target,
    precision,
    survey,
    track_blobs,
    update_map,
)

__all__ = [
    "InertialAlignment", "LampChange", "LampFate", "LampUpdate", "MapUpdate", "MapWay", "Survey", "SurveyOmission",
    "SurveyScale", "SurveyedLamp", "assumptions_of", "joint_covariance_m2", "known_precision", "scene_of",
    "shared_errors", "survey", "track_blobs", "update_map", "updated_scene", "without_scale",
]

MIN_SHARED_RATIO = 2.0  # of variances
MIN_REDUNDANCY = 10  # sigma0 is then known to 22 %
POWER_SIGMA = 0.2  # relative; the emission between the directions of the pictures is not measured


def shared_errors(joint_m2: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Splits the joint covariance (n, n, 3, 3) of positions into standard deviations (n, 3) of each position alone,
    and errors (m, n, 3) that positions share.

    With the covariance of each position as the unit, an eigenvalue of the joint covariance is the ratio of the variance
    of a common motion to that of independent positions. Motions with a ratio above 2 become shared errors.
    """
    count = len(joint_m2)
    own = joint_m2[range(count), range(count)]
    values, vectors = np.linalg.eigh(own)
    values = np.maximum(values, 0)
    inverse = np.where(values > 1e-12 * values.max(), 1 / np.sqrt(np.maximum(values, 1e-300)), 0)
    root = vectors * np.sqrt(values)[:, None, :] @ vectors.transpose(0, 2, 1)
    unit = vectors * inverse[:, None, :] @ vectors.transpose(0, 2, 1)
    scaled = np.einsum("iab,ijbc,jcd->iajd", unit, joint_m2, unit).reshape(3 * count, 3 * count)
    ratios, motions = np.linalg.eigh((scaled + scaled.T) / 2)
    ratios = np.maximum(ratios, 0)
    shared = ratios > MIN_SHARED_RATIO
    errors = np.einsum("iab,ibm->mia", root, (motions * np.sqrt(ratios))[:, shared].reshape(count, 3, -1))
    alone = np.diagonal(own, axis1=1, axis2=2) - (errors**2).sum(axis=0)
    return np.sqrt(np.maximum(alone, 0)), errors


def without_scale(joint_m2: NDArray[np.float64], at_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Splits the joint covariance (n, n, 3, 3) of positions at_m (n, 3) into that of a map with an exact scale, and the
    relative standard deviation of the scale.

    The variance of the scale is the largest one that leaves a covariance: 1 / (s^T C^+ s), where s is the motion of
    all positions by the scale, away from their mean.
    """
    count = len(joint_m2)
    covariance = joint_m2.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count)
    by_scale = (at_m - at_m.mean(axis=0)).ravel()
    values, vectors = np.linalg.eigh(covariance)
    along = vectors.T @ by_scale
    known = values > 1e-12 * values.max(initial=0)
    if count < 2 or not (along**2).sum() > 0 or (along[~known] ** 2).sum() > 1e-9 * (along**2).sum():
        return joint_m2, 0.0
    variance = 1 / (along[known] ** 2 / values[known]).sum()
    rest = covariance - variance * np.outer(by_scale, by_scale)
    return rest.reshape(count, 3, count, 3).transpose(0, 2, 1, 3), float(np.sqrt(variance))


def known_precision(found: Survey) -> Precision:
    """Precision of the surveyed network in the datum of all lamps.

    It is scaled by sigma0 squared if that is known to 22 % or is above 1.
    """
    factor = found.sigma0**2 if found.redundancy >= MIN_REDUNDANCY else max(1.0, found.sigma0**2)
    return precision(found.network).scaled(factor)


def joint_covariance_m2(found: Survey, known: Precision, ids: Sequence[int]) -> NDArray[np.float64]:
    """Joint covariance (n, n, 3, 3) of the positions of lamps, with the error of a scale by radius."""
    targets = [Target.point(id) for id in ids]
    joint = np.array([[known.positions(a, b)[:3, 3:] for b in targets] for a in targets])
    for i, target in enumerate(targets):
        joint[i, i] = known.position(target)
    at = np.array([found.lamps[id].lamp.centre_m for id in ids])
    arms = found.scale_sigma * (at - at.mean(axis=0))
    return np.asarray(joint + np.einsum("ia,jb->ijab", arms, arms))


def tags_of(found: Survey, known: Precision, family: str = "tag36h11") -> list[Tag]:
    """Tags of the survey whose pose is determined."""
    network = found.network
    tags = []
    bodies = zip(network.body_names, network.body_corners_m, network.body_poses, network.body_scales)
    for k, (name, corners_m, pose, scale) in enumerate(bodies):
        if not np.isfinite(known.body(k)).all():
            continue
        axes = np.asarray(pose)[:3, :3]
        tags.append(Tag(
            id=int(name.removeprefix("tag ")), family=family, centre_m=np.asarray(pose)[:3, 3], normal=axes[:, 2],
            x_axis=axes[:, 0], size_m=float(scale * np.linalg.norm(np.subtract(corners_m[1], corners_m[0]))),
        ))
    return tags


def scene_of(
    found: Survey, camera: Camera, sensor: Sensor | None = None, code: Code | None = None,
    tag_family: str = "tag36h11",
) -> Scene:
    """Scene of a survey that is ok: its lamps with the standard deviations of their positions and shared errors.

    camera: Survey.camera, which has the estimated parameters if there are any, or another camera for other pictures.
    code: that of the ids which the lamps transmit (SurveyedLamp.code_id). tag_family: that of the AprilTags, which
    count as exact in a scene. Lamps whose position is not determined are left out. `assumed` of the scene states the
    frame and the scale.
    """
    known = known_precision(found)
    ids = [i for i, covariance in enumerate(known.points()) if np.isfinite(covariance).all()]
    at_m = np.array([found.lamps[id].lamp.centre_m for id in ids])
    joint_m2, scale_sigma = without_scale(joint_covariance_m2(found, known, ids), at_m)
    sigmas_m, errors_m = shared_errors(joint_m2)
    lamps = []
    for row, id in enumerate(ids):
        surveyed = found.lamps[id]
        transmits = {}
        if code is not None and surveyed.code_id is not None:
            transmits = {"code": LampCode(code=code, id=surveyed.code_id)}
        lamps.append(surveyed.lamp.replace(
            position_sigma_m=sigmas_m[row], shared_errors_m=list(errors_m[:, row]), power_sigma=POWER_SIGMA, **transmits
        ))
    scene = Scene(
        camera=camera, lamps=lamps, sensor=sensor, map_scale_sigma=scale_sigma, tags=tags_of(found, known, tag_family)
    )
    return Scene.parse(scene.format() + "assumed:\n" + "".join(f"  - '{note}'\n" for note in assumptions_of(found)))


def assumptions_of(found: Survey) -> list[str]:
    """Sentences about the scale and the frame, which the pictures do not determine."""
    scale = {
        SurveyScale.free: "the scale is free: the distance from lamp 0 to the lamp farthest from it is set to 1",
        SurveyScale.distances: "the scale is that of measured distances",
        SurveyScale.tags: "the scale is that of the given size of the AprilTags",
        SurveyScale.odometry: "the scale is that of the odometry",
        SurveyScale.imu: "the scale is that of the inertial measurements",
        SurveyScale.radius: "the scale is that of the given radius of the lamps",
    }[found.scale]
    tilt = "which need not be vertical"
    if found.inertial is not None:
        tilt = f"{np.degrees(np.arccos(np.clip(-found.inertial.down[2], -1, 1))):.2f} deg from the vertical"
    notes = [
        scale, f"the z axis is the mean normal of the lamps, {tilt}",
        "the powers of the lamps are relative: their mean is 1 W",
    ]
    return [*notes, "the tags count as exact"] if found.network.body_names else notes


def updated_scene(update: MapUpdate, scene: Scene) -> Scene:
    """Scene of an update that is ok: without the lamps that are gone, with new ones, and with the errors of all places.

    scene: the map that was updated; everything beside the lamps is kept. Raises: ValueError if the update is not ok.
    """
    if not update.ok:
        raise ValueError(f"update must have the status ok, got {update.status.name}: {update.message}")
    lamps = [one.lamp for one in update.lamps if one.fate != LampFate.gone]
    count = len(lamps)
    joint_m2 = np.asarray(update.covariance_m2).reshape(count, 3, count, 3).transpose(0, 2, 1, 3)
    scale_sigma = 0.0
    if scene.map_scale_sigma > 0:
        joint_m2, scale_sigma = without_scale(joint_m2, np.array([lamp.centre_m for lamp in lamps]))
    sigmas_m, errors_m = shared_errors(joint_m2)
    return scene.replace(map_scale_sigma=scale_sigma, lamps=[
        lamp.replace(position_sigma_m=sigmas_m[i], shared_errors_m=list(errors_m[:, i]))
        for i, lamp in enumerate(lamps)
    ])
