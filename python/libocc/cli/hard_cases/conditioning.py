# SPDX-License-Identifier: Apache-2.0
"""Error of a pose that is caused by rounding of the input.

A change of the pose is x = (rotation about the points' centroid [rad], translation of the centroid divided by the
points' r.m.s. distance); F(x) is the change of the observed directions [rad]. Let s be the smallest singular value of
F' with right and left singular vectors v, w, and k = w . F''(v, v) / 2. A change e of the directions moves the pose by
t with s t + k t^2 = e. This is about e / s if the other root, near -s / k, is distant. For e > s^2 / 4k the two roots
may merge, and the error is up to (s + sqrt(s^2 + 4 k e)) / 2k. Rounding changes each direction by an epsilon, and in
addition by the rounding of the points' coordinates as seen from the camera, which is larger for near points of a wide
scene.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Reference:
    """A pose with more digits than double precision."""

    rotation: Any  # (3, 3) long double
    centroid_in_cam: Any  # (3,) long double
    distance: float  # r.m.s. over the points
    condition: float  # 1 / s
    curvature: float  # k
    rounding: float  # of the points' coordinates, divided by distance

    def allowed(self, factor: float) -> float:
        """Max pose error (see `error`) caused by `factor` times the rounding of the input."""
        change = factor * EPSILON
        s, k = 1 / self.condition, self.curvature
        if 4 * k * change < s * s:
            moved = 2 * change / (s + np.sqrt(s * s - 4 * k * change))
        else:
            moved = (s + np.sqrt(s * s + 4 * k * change)) / (2 * k) if k > 0 else np.inf
        return float(moved) + factor * self.rounding

    def error(self, cam_from_world: Any, centroid: Any) -> float:
        """Error of a pose: the larger of rotation [rad] and translation of the centroid divided by distance."""
        given = np.asarray(cam_from_world, dtype=np.longdouble)
        angle = np.linalg.norm((given[:3, :3] - self.rotation).astype(float)) / np.sqrt(2)
        shift = given[:3, :3] @ centroid + given[:3, 3] - self.centroid_in_cam
        return float(max(angle, np.linalg.norm(shift.astype(float)) / self.distance))


def long_norm(vectors: Any) -> Any:
    """Length along the last axis, in long double (numpy.linalg computes in double)."""
    return np.sqrt((vectors * vectors).sum(-1))


def hat(w: Any) -> Any:
    zero = w[0] * 0
    return np.array([[zero, -w[2], w[1]], [w[2], zero, -w[0]], [-w[1], w[0], zero]])


def cayley(w: Any) -> Any:
    """Rotation matrix of a vector by the Cayley transform: orthogonal, and exact to second order."""
    half = hat(w) / 2
    a, b, c = w / 2
    squared = a * a + b * b + c * c
    return np.eye(3, dtype=np.longdouble) + (2 * half + 2 * half @ half) / (1 + squared)


class Directions:
    """Directions of points as a function of the pose, relative to the observed directions."""

    def __init__(self, bearings: Any, points: Any, rotation: Any, centroid_in_cam: Any) -> None:
        world = np.asarray(points, dtype=np.longdouble)
        self.arms = (world - world.mean(0)) @ np.asarray(rotation, dtype=np.longdouble).T
        self.centroid = np.asarray(centroid_in_cam, dtype=np.longdouble)
        seen = np.asarray(bearings, dtype=np.longdouble)
        self.seen = seen / long_norm(seen)[:, None]
        self.tangents = tangent_bases(self.seen.astype(float))
        self.distance = float(np.sqrt((long_norm(self.in_cam()) ** 2).mean()))

    def in_cam(self, x: Any = None) -> Any:
        if x is None:
            return self.centroid + self.arms
        x = np.asarray(x, dtype=np.longdouble)
        return self.centroid + self.distance * x[3:] + self.arms @ cayley(x[:3]).T

    def residuals(self, x: Any = None) -> Any:
        """(2 n,) tangential components of the predicted minus the observed directions."""
        points = self.in_cam(x)
        off = points / long_norm(points)[:, None] - self.seen
        return (self.tangents * off[:, None]).sum(-1).ravel()

    def jacobian(self) -> Any:
        """(2 n, 6) Jacobian of `residuals`, in double precision."""
        points, arms = self.in_cam().astype(float), self.arms.astype(float)
        length = np.sqrt((points * points).sum(1))[:, None, None]
        unit = points[:, None] / length
        across = (self.tangents - (self.tangents * unit).sum(-1)[..., None] * unit) / length
        rotational = np.cross(arms[:, None], across)
        return np.concatenate([rotational, self.distance * across], axis=2).reshape(-1, 6)


def tangent_bases(f: Any) -> Any:
    """(n, 2, 3) two orthonormal directions perpendicular to each unit vector."""
    other = np.eye(3)[np.argmin(np.abs(f), axis=1)]
    a = np.cross(f, other)
    a /= np.sqrt((a * a).sum(1))[:, None]
    return np.stack([a, np.cross(f, a)], axis=1)


def reference(bearings: Any, points: Any, rotation: Any, centroid_in_cam: Any) -> Reference:
    """A known pose with its conditioning."""
    seen = Directions(bearings, points, rotation, centroid_in_cam)
    depths, arms = long_norm(seen.in_cam()), long_norm(seen.arms)
    weights = np.repeat(1 / np.maximum(1, arms.max() / depths), 2)
    jacobian = weights[:, None].astype(float) * seen.jacobian()
    left, singular, right = np.linalg.svd(jacobian, full_matrices=False)
    step = 1e-3 * float((depths / (arms + seen.distance)).min())
    bend = seen.residuals(step * right[-1]) + seen.residuals(-step * right[-1]) - 2 * seen.residuals()
    return Reference(
        np.asarray(rotation, dtype=np.longdouble),
        seen.centroid,
        seen.distance,
        float(1 / singular[-1]) if singular[-1] > 0 else np.inf,
        abs(float(left[:, -1] @ (weights * bend))) / (2 * step * step),
        EPSILON * float(np.abs(np.asarray(points)).max()) / seen.distance,
    )


def refined(bearings: Any, points: Any, rotation: Any, centroid_in_cam: Any) -> Reference:
    """Least-squares pose near a given one, by Gauss-Newton with residuals in long double.

    The given pose is returned if the normal equations are singular.
    """
    rotation = np.asarray(rotation, dtype=np.longdouble)
    centroid = np.asarray(centroid_in_cam, dtype=np.longdouble)
    for _ in range(4):
        seen = Directions(bearings, points, rotation, centroid)
        jacobian = seen.jacobian()
        if np.linalg.cond(jacobian) > 1e7:
            break
        x = -np.linalg.lstsq(jacobian, seen.residuals().astype(float), rcond=None)[0]
        x = x.astype(np.longdouble)
        rotation = cayley(x[:3]) @ rotation
        centroid = centroid + seen.distance * x[3:]
    return reference(bearings, points, rotation, centroid)
