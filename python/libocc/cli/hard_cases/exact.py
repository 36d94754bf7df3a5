# SPDX-License-Identifier: Apache-2.0
"""Arithmetic with 100 digits: numpy arrays of `decimal.Decimal`, which needs no additional package.

Vectors and matrices are object arrays. `exact` converts floats without error, `rounded` converts to the nearest
doubles. The functions must be called inside `with digits():`.
"""

import decimal
from collections.abc import Sequence
from contextlib import AbstractContextManager
from decimal import Decimal
from typing import Any

import numpy as np

ZERO, ONE, TWO = Decimal(0), Decimal(1), Decimal(2)
DIGITS = 100


def digits() -> AbstractContextManager[decimal.Context]:
    """A context in which Decimal computes with 100 digits."""
    return decimal.localcontext(decimal.Context(prec=DIGITS, Emin=-99999, Emax=99999))


def exact(values: Any) -> Any:
    """Object array of the exact values of floats."""
    array = np.asarray(values, dtype=float)
    return np.array([Decimal(float(v)) for v in array.flat], dtype=object).reshape(array.shape)


def rounded(values: Any) -> Any:
    """Nearest doubles."""
    return np.asarray(values, dtype=object).astype(float)


def long(values: Any) -> Any:
    """Nearest long doubles."""
    high = rounded(values)
    return high.astype(np.longdouble) + rounded(values - exact(high))


def dot(a: Any, b: Any) -> Decimal:
    return Decimal(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def norm(a: Any) -> Decimal:
    return dot(a, a).sqrt()


def unit(a: Any) -> Any:
    return a / norm(a)


def cross(a: Any, b: Any) -> Any:
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dtype=object
    )


def rotation(quaternion: Any) -> Any:
    """Rotation matrix of a quaternion (w, x, y, z) that need not be a unit quaternion; exact, without square roots."""
    w, x, y, z = exact(quaternion)
    n = w * w + x * x + y * y + z * z
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(rows, dtype=object) / n


def frame(points: Any) -> Any:
    """Orthonormal frame of a triangle; columns: along a side, perpendicular to it in the plane, normal."""
    x = unit(points[1] - points[0])
    z = unit(cross(x, points[2] - points[0]))
    return np.stack([x, cross(z, x), z], axis=1)


def value(polynomial: Sequence[Decimal], x: Decimal) -> Decimal:
    """Value of a polynomial with coefficients from the highest power."""
    out = ZERO
    for coefficient in polynomial:
        out = out * x + coefficient
    return out


def derivative(polynomial: Sequence[Decimal]) -> list[Decimal]:
    degree = len(polynomial) - 1
    return [c * (degree - i) for i, c in enumerate(polynomial[:-1])]


def _between(polynomial: Sequence[Decimal], low: Decimal, high: Decimal) -> Decimal:
    """Root between two points with different signs, by Newton's method safeguarded by bisection."""
    slope = derivative(polynomial)
    rising = value(polynomial, high) > 0
    x = (low + high) / 2
    for _ in range(400):
        y = value(polynomial, x)
        if (y > 0) == rising:
            high = x
        else:
            low = x
        gradient = value(slope, x)
        next_x = x - y / gradient if gradient else low
        if not low < next_x < high:
            next_x = (low + high) / 2
        if abs(next_x - x) <= abs(x) * Decimal(10) ** (4 - DIGITS):
            return next_x
        x = next_x
    return x


def positive_roots(polynomial: Sequence[Decimal]) -> list[list[Decimal]]:
    """Ascending positive roots of a polynomial, followed by those of each of its derivatives.

    Between two neighbouring extrema there is at most one root. A root without a change of sign may be missing; it is a
    root of the derivative as well.
    """
    largest = max((abs(c) for c in polynomial), default=ZERO)
    trimmed = list(polynomial)
    while trimmed and abs(trimmed[0]) <= largest * Decimal(10) ** (10 - DIGITS):
        trimmed.pop(0)
    if len(trimmed) < 2:
        return [[]]
    below = positive_roots(derivative(trimmed))
    bound = 1 + max(abs(c / trimmed[0]) for c in trimmed[1:])
    edges = [ZERO, *below[0], bound]
    values = [value(trimmed, x) for x in edges]
    roots: list[Decimal] = []
    for i in range(len(edges) - 1):
        if values[i + 1] == 0:
            roots.append(edges[i + 1])
        elif values[i] * values[i + 1] < 0:
            roots.append(_between(trimmed, edges[i], edges[i + 1]))
    return [roots, *below]
