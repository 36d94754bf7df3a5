# SPDX-License-Identifier: Apache-2.0
"""Relative orientation of two images from common targets, for start values.

The essential matrix follows from five pairs of bearings: Stewenius, Engels, Nister, "Recent developments on direct
relative orientation", ISPRS Journal 60(4), 2006. Its four elements x, y, z, 1 of the null space of the epipolar
conditions satisfy ten cubic equations; x is an eigenvalue of the action matrix of the multiplication by x.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement, permutations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MIN_COMMON = 6  # five pairs of bearings determine the orientation, up to ten solutions
MIN_ANGLE_RAD = np.radians(2.0)  # of two rays that count as an intersection
SAMPLES = 60  # with a third of gross errors, one of them is free of errors with a probability of 0.9997
MAX_POSES = 4  # of two images: two for points of a plane, each perhaps twice with noise
MAX_ERROR_RATIO = 3.0  # of poses that are worth a try, to the best one
MIN_ERROR_RAD = 1e-7  # rounding of pixels in a file with three decimals, at 1e4 pixels per radian
SAME_POSE = 0.05  # norm of the difference of two poses that are one
PAIRS = 15  # of images that are tried, those with the most common targets

# Monomials of x, y, z and 1 as indices 0 to 3: ten of the third degree, then the basis x^2 xy xz y^2 yz z^2 x y z 1.
MONOMIALS = sorted(combinations_with_replacement(range(4), 3), key=lambda m: (m.count(3), m))

LEVI_CIVITA = np.array([[[(i - j) * (j - k) * (k - i) / 2 for k in range(3)] for j in range(3)] for i in range(3)])


def five_point(a: Array, b: Array) -> list[Array]:
    """Essential matrices with b^T E a = 0 of five pairs of bearings, (5, 3) each; up to ten."""
    conditions = (b[:, :, None] * a[:, None, :]).reshape(5, 9)
    basis = np.linalg.svd(conditions)[2][5:].reshape(4, 3, 3)
    # Trilinear forms of det E = 0 and 2 E E^T E - tr(E E^T) E = 0.
    product = np.einsum("iab,jcb->ijac", basis, basis)
    traces = np.einsum("ijaa->ij", product)
    cubic = 2 * np.einsum("ijac,kcd->ijkad", product, basis) - np.einsum("ij,kad->ijkad", traces, basis)
    determinant = np.einsum("ia,jb,kc,abc->ijk", basis[:, :, 0], basis[:, :, 1], basis[:, :, 2], LEVI_CIVITA)
    forms = np.concatenate([determinant[..., None], cubic.reshape(4, 4, 4, 9)], axis=3)
    equations = np.stack([sum(forms[p] for p in set(permutations(m))) for m in MONOMIALS], axis=1)
    try:
        reduced = np.linalg.solve(equations[:, :10], equations[:, 10:])
    except np.linalg.LinAlgError:
        return []
    if not np.isfinite(reduced).all():
        return []
    action = np.zeros((10, 10))
    action[:6] = -reduced[:6]  # x times x^2 xy xz y^2 yz z^2
    action[[6, 7, 8, 9], [0, 1, 2, 6]] = 1
    values, vectors = np.linalg.eig(action)
    found = []
    for k in range(10):
        vector = vectors[:, k]
        if abs(values[k].imag) > 1e-8 * (1 + abs(values[k])) or abs(vector[9]) < 1e-12:
            continue
        x, y, z = (vector[6:9] / vector[9]).real
        matrix = x * basis[0] + y * basis[1] + z * basis[2] + basis[3]
        found.append(matrix / np.linalg.norm(matrix))
    return found


def epipolar_errors(essential: Array, a: Array, b: Array) -> Array:
    """Angles [rad] between the bearings b and the epipolar planes of a."""
    normals = a @ essential.T
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    return np.asarray(np.abs(np.einsum("ni,ni->n", b, normals)) / lengths, dtype=float)


def depths(pose: Array, a: Array, b: Array) -> tuple[Array, Array]:
    """Distances along bearings a and b of the points nearest to both rays; pose: b_from_a, (3, 4)."""
    turned = a @ pose[:, :3].T  # in frame b: s_a turned + t = s_b b
    cosine = np.einsum("ni,ni->n", turned, b)
    across = np.maximum(1 - cosine**2, 1e-300)
    along_a, along_b = -turned @ pose[:, 3], b @ pose[:, 3]
    return (along_a + cosine * along_b) / across, (along_b + cosine * along_a) / across


def poses_of(essential: Array) -> list[Array]:
    """The four poses b_from_a (3, 4) of an essential matrix, with a baseline of 1."""
    u, _, vt = np.linalg.svd(essential)
    u, vt = u * np.linalg.det(u), vt * np.linalg.det(vt)
    w = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    return [np.column_stack([u @ turn @ vt, sign * u[:, 2]]) for turn in (w, w.T) for sign in (1, -1)]


@dataclass
class RelativePose:
    """Pose of the second image in the frame of the first, with a baseline of 1."""

    pose: Array  # b_from_a, 4x4
    error_rad: float  # robust epipolar error
    intersected: int  # number of points in front of both images whose rays meet at MIN_ANGLE_RAD or more


def is_new(pose: Array, found: Sequence[RelativePose]) -> bool:
    return all(np.linalg.norm(pose - other.pose) > SAME_POSE for other in found)


def relative_orientation(a: Array, b: Array, seed: int = 0) -> list[RelativePose]:
    """Poses of two images from common bearings (n, 3), best first; up to a third of the pairs may be gross errors.

    Points of a plane may have two poses. Empty with fewer than MIN_COMMON pairs, or if half of the points are behind an
    image.
    """
    count = len(a)
    if count < MIN_COMMON:
        return []
    samples = [list(c) for c in combinations(range(count), 5)] if count <= 7 else []
    random = np.random.default_rng(seed)
    samples = samples or [random.choice(count, 5, replace=False).tolist() for _ in range(SAMPLES)]
    rank = 5 + (count - 5 + 1) // 2 - 1  # five errors are zero by construction
    scored: list[tuple[float, Array]] = []
    for sample in samples:
        for essential in five_point(a[sample], b[sample]):
            errors = np.maximum(epipolar_errors(essential, a, b), epipolar_errors(essential.T, b, a))
            scored.append((float(np.partition(errors, rank)[rank]), essential))
    scored.sort(key=lambda entry: entry[0])
    found: list[RelativePose] = []
    for error, essential in scored:
        if error > MAX_ERROR_RATIO * max(scored[0][0], MIN_ERROR_RAD):
            break
        for pose in poses_of(essential):
            along_a, along_b = depths(pose, a, b)
            front = (along_a > 0) & (along_b > 0)
            if 2 * front.sum() < count:
                continue
            angles = np.arccos(np.clip(np.einsum("ni,ni->n", a @ pose[:, :3].T, b), -1, 1))
            whole = np.eye(4)
            whole[:3] = pose
            if is_new(whole, found):
                found.append(RelativePose(whole, error, int(np.sum(front & (angles > MIN_ANGLE_RAD)))))
        if len(found) >= MAX_POSES:
            break
    return found[:MAX_POSES]


def start_pair(bearings: Sequence[Mapping[int, Array]]) -> tuple[int, int, list[Array]] | None:
    """Two images with the most well intersected targets, and poses of the second in the frame of the first.

    bearings: unit bearings of targets by their number, for each image. None if no pair has a relative orientation.
    """
    common = [
        (len(bearings[i].keys() & bearings[k].keys()), i, k) for i in range(len(bearings)) for k in range(i)
    ]
    common.sort(key=lambda entry: (-entry[0], entry[1], entry[2]))
    best: tuple[int, int, int, list[Array]] | None = None
    for number, i, k in common[:PAIRS]:
        if number < MIN_COMMON:
            break
        shared = sorted(bearings[i].keys() & bearings[k].keys())
        found = relative_orientation(np.array([bearings[k][p] for p in shared]),
                                     np.array([bearings[i][p] for p in shared]))
        found = [pose for pose in found if pose.intersected >= MIN_COMMON]
        if found and (best is None or found[0].intersected > best[0]):
            best = found[0].intersected, k, i, [pose.pose for pose in found]
    return None if best is None else best[1:]
