# SPDX-License-Identifier: Apache-2.0
"""All solutions of the P3P problem with 100 digits.

With depths d1, d2 = u d1, d3 = v d1 the law of cosines for the three sides (Grunert 1841) gives two conics in u and v;
their resultant is a quartic in v. If a root v does not determine u, the roots u of either conic are tested in the other
one, so that there are no singular views.
"""

from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

from . import exact as ex
from .conditioning import EPSILON, Reference, reference

EXACT = Decimal(10) ** -30  # max misfit of a real root, which is far smaller; that of a near-double root is larger
NEAR = Decimal("1e-5")  # relative distance from a real root below which an extremum is not a separate root
ROUNDINGS = 8  # epsilons of the input within which a complex pair counts as a double root


@dataclass(frozen=True)
class Solution:
    """Solution of the exact problem, or a double root of a problem within the rounding of the input."""

    pose: Reference
    depths: tuple[float, float, float]
    real: bool  # False: a complex pair that is real within rounding

    def is_double(self, factor: float = ROUNDINGS) -> bool:
        """True if rounding of the input may move the solution as far as a double root."""
        change = factor * EPSILON
        return self.pose.condition**2 * change * self.pose.curvature > 1


def _multiply(a: list[Decimal], b: list[Decimal]) -> list[Decimal]:
    out = [ex.ZERO] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def _subtract(a: list[Decimal], b: list[Decimal]) -> list[Decimal]:
    size = max(len(a), len(b))
    a = [ex.ZERO] * (size - len(a)) + a
    b = [ex.ZERO] * (size - len(b)) + b
    return [x - y for x, y in zip(a, b)]


class _Triangle:
    """Sides and angles of three points and their bearings."""

    def __init__(self, bearings: Any, points: Any) -> None:
        self.points = ex.exact(points)
        self.units = [ex.unit(f) for f in ex.exact(bearings)]
        f1, f2, f3 = self.units
        self.cosines = ex.dot(f2, f3), ex.dot(f1, f3), ex.dot(f1, f2)
        p1, p2, p3 = self.points
        self.sides = ex.dot(p2 - p3, p2 - p3), ex.dot(p1 - p3, p1 - p3), ex.dot(p1 - p2, p1 - p2)
        normal = ex.cross(p2 - p1, p3 - p1)
        self.flat = ex.dot(normal, normal) == 0

    def in_u(self) -> tuple[list[list[Decimal]], list[list[Decimal]]]:
        """Both conics as quadratics in u, whose coefficients are polynomials in v."""
        (ca, cb, cc), (a, b, c) = self.cosines, self.sides
        first = [[b], [-2 * b * ca, ex.ZERO], [b - a, 2 * a * cb, -a]]
        second = [[b], [-2 * b * cc], [-c, 2 * c * cb, b - c]]
        return first, second

    def quartic(self) -> list[Decimal]:
        (a1, b1, c1), (a2, b2, c2) = self.in_u()
        ac = _subtract(_multiply(a1, c2), _multiply(a2, c1))
        ab = _subtract(_multiply(a1, b2), _multiply(a2, b1))
        bc = _subtract(_multiply(b1, c2), _multiply(b2, c1))
        return _subtract(_multiply(ac, ac), _multiply(ab, bc))

    def us(self, v: Decimal) -> list[Decimal]:
        """Candidates of u for a root v: common root of the conics and roots of each conic."""
        (a1, b1, c1), (_, b2, c2) = (
            [ex.value(p, v) for p in conic] for conic in self.in_u()
        )
        out = [(c1 - c2) / (b2 - b1)] if b1 != b2 else []
        for b, c in ((b1, c1), (b2, c2)):
            half = -b / (2 * a1)
            root = max(half * half - c / a1, ex.ZERO).sqrt()
            out += [half - root, half + root]
        return out

    def depths(self, u: Decimal, v: Decimal) -> Any:
        """Depths scaled so that the sum of the squared sides is correct."""
        forms = self._forms((ex.ONE, u, v))
        total = sum(forms, ex.ZERO)
        scale = (sum(self.sides, ex.ZERO) / total).sqrt() if total > 0 else ex.ZERO
        return scale, u * scale, v * scale

    def _forms(self, d: Any) -> list[Decimal]:
        pairs = ((1, 2), (0, 2), (0, 1))
        return [
            d[i] * d[i] + d[j] * d[j] - 2 * d[i] * d[j] * cosine
            for (i, j), cosine in zip(pairs, self.cosines)
        ]

    def misfit(self, d: Any) -> Decimal:
        """Change of the bearings and relative change of the sides for which the depths fit."""
        pairs = ((1, 2), (0, 2), (0, 1))
        worst = ex.ZERO
        for (i, j), cosine, side, form in zip(pairs, self.cosines, self.sides, self._forms(d)):
            sine = max(1 - cosine * cosine, ex.ZERO).sqrt()
            worst = max(worst, abs(form - side) / (2 * d[i] * d[j] * sine + side))
        return worst

    def pose(self, d: Any) -> tuple[Any, Any]:
        """Rotation and centroid in the camera's frame, in long double."""
        in_cam = np.stack([f * depth for f, depth in zip(self.units, d)])
        rotation = ex.frame(in_cam) @ ex.frame(self.points).T
        return ex.long(rotation), ex.long(in_cam.sum(0) / 3)


def three_points(bearings: Any, points: Any) -> list[Solution]:
    """All solutions with depths above rounding errors; empty for collinear points."""
    with ex.digits():
        triangle = _Triangle(bearings, points)
        if triangle.flat or 0 in triangle.sides:
            return []
        levels = ex.positive_roots(triangle.quartic())[:3]  # includes extrema, see Solution.real
        tried = [
            triangle.depths(u, v) for level in levels for v in level for u in triangle.us(v) if u > 0
        ]
        in_front = [d for d in tried if min(d) > ROUNDINGS * Decimal(EPSILON) * max(d)]
        found = _distinct([(triangle.misfit(d), d) for d in in_front])
        return [_solution(triangle, d, real, bearings, points) for d, real in found]


def _distinct(tried: list[tuple[Decimal, Any]]) -> list[tuple[Any, bool]]:
    """Distinct depths that fit, and whether they are real roots; real roots first."""
    found: list[tuple[Any, bool]] = []
    for misfit, d in sorted(tried, key=lambda pair: pair[0]):
        real = misfit < EXACT
        near = EXACT.sqrt() if real else NEAR
        same = any(max(abs(x / y - 1) for x, y in zip(d, other)) < near for other, _ in found)
        if misfit < ROUNDINGS * Decimal(EPSILON) and not same:
            found.append((d, real))
    return found


def _solution(triangle: _Triangle, d: Any, real: bool, bearings: Any, points: Any) -> Solution:
    rotation, centroid = triangle.pose(d)
    pose = reference(bearings, points, rotation, centroid)
    return Solution(pose, (float(d[0]), float(d[1]), float(d[2])), real)
