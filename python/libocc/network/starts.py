# SPDX-License-Identifier: Apache-2.0
"""Similarities of start values."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def similarity(source: Array, target: Array) -> tuple[float, Array, Array] | None:
    """Scale, rotation and translation with target = scale * rotation @ source + translation, for points (n, 3).

    None if the points are collinear. Source: Umeyama, "Least-squares estimation of transformation parameters between
    two point patterns", PAMI 13(4), 1991, eqs 40-42.
    """
    about_source, about_target = source - source.mean(axis=0), target - target.mean(axis=0)
    u, values, vt = np.linalg.svd(about_target.T @ about_source)
    if len(source) < 3 or values[1] < 1e-9 * values[0] or not values[0] > 0:
        return None
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ np.diag(signs) @ vt
    scale = float(values @ signs / np.sum(about_source**2))
    return scale, rotation, target.mean(axis=0) - scale * rotation @ source.mean(axis=0)


def transformed(
    poses: Mapping[int, Array], points: Mapping[int, Array], scale: float, rotation: Array, translation: Array
) -> tuple[dict[int, Array], dict[int, Array]]:
    """Poses and points after a similarity of the world."""
    moved = {}
    for image, pose in poses.items():
        turned = np.eye(4)
        turned[:3, :3] = pose[:3, :3] @ rotation.T
        turned[:3, 3] = scale * pose[:3, 3] - turned[:3, :3] @ translation
        moved[image] = turned
    return moved, {point: scale * rotation @ at + translation for point, at in points.items()}
