# SPDX-License-Identifier: Apache-2.0
"""Comparison of an answer with the truth."""

import time
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ...smoothing import chi2_quantile
from .families import Problem
from .rooms import Array

MAX_CHANCE = 1e-9  # probability of the chi-square of a right pose beyond its limit
MAX_ERROR_M, MAX_ERROR_RAD = 0.05, 0.05  # a wrong pose is at least one of these off


@dataclass(frozen=True)
class Record:
    """Verdict of one problem, and the errors of its best pose; without a pose they are None."""

    status: str
    time_s: float  # computing time of the calling thread
    risk: float | None = None  # stated; None for functions that state none
    wrong: bool | None = None
    chi2: float | None = None  # of the six parameters
    z: tuple[float, float, float] | None = None  # errors of x, y, z in standard deviations
    truth_listed: bool = False  # one of the candidates is right


def solved(problem: Problem) -> Record:
    """Solves a problem and compares the answer with the truth."""
    begun = time.thread_time()
    found = problem.solve()
    time_s = time.thread_time() - begun
    status, risk = found.status.name, getattr(found, "risk", None)
    if not found.candidates:
        return Record(status, time_s, risk)
    best = found.candidates[0]
    if problem.truth is None:
        return Record(status, time_s, risk, wrong=True)
    chi2 = chi2_of(best, problem.truth)
    return Record(
        status, time_s, risk, is_wrong(best, problem.truth), chi2, _standardised(best, problem.truth),
        not all(is_wrong(candidate, problem.truth) for candidate in found.candidates),
    )


def is_wrong(candidate: Any, truth: Array) -> bool:
    """True if the error is outside what the covariance allows, and larger than MAX_ERROR_M or MAX_ERROR_RAD."""
    delta = difference(truth, candidate.cam_from_world)
    far = np.linalg.norm(position(truth) - candidate.position_m) > MAX_ERROR_M
    turned = np.linalg.norm(delta[:3]) > MAX_ERROR_RAD
    return bool(far or turned) and chi2_of(candidate, truth) > _chi2_limit()


def chi2_of(candidate: Any, truth: Array) -> float:
    """Squared Mahalanobis distance of the truth; 0 if the covariance is infinite."""
    return _mahalanobis2(difference(truth, candidate.cam_from_world), candidate.covariance)


def _mahalanobis2(delta: Array, covariance: Array) -> float:
    if not np.isfinite(covariance).all():
        return 0.0
    scale = np.sqrt(np.diag(covariance))  # rotations and metres: makes the matrix better conditioned
    if (scale <= 0).any():
        return float("inf")
    unit = delta / scale
    return float(unit @ np.linalg.solve(covariance / np.outer(scale, scale), unit))


def _standardised(candidate: Any, truth: Array) -> tuple[float, float, float]:
    error = candidate.position_m - position(truth)
    sigma = np.sqrt(np.diag(candidate.position_covariance_m2))
    x, y, z = (float(e / s) if np.isfinite(s) else 0.0 for e, s in zip(error, sigma))
    return x, y, z


def position(cam_from_world: Array) -> Array:
    return np.asarray(-cam_from_world[:3, :3].T @ cam_from_world[:3, 3])


def difference(to: Array, source: Array) -> Array:
    """Left perturbation [rotation, translation] that leads from `source` to `to`, as in libocc/geometry/rigid.hpp."""
    turn = to[:3, :3] @ source[:3, :3].T
    return np.concatenate([_rotation_vector(turn), to[:3, 3] - turn @ source[:3, 3]])


def _rotation_vector(turn: Array) -> Array:
    twice_sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine, cosine = np.linalg.norm(twice_sine) / 2, (np.trace(turn) - 1) / 2
    angle = np.arctan2(sine, cosine)
    if sine > 1e-6:
        return np.asarray(angle / (2 * sine) * twice_sine)
    if cosine > 0:
        return twice_sine / 2
    values, vectors = np.linalg.eigh((turn + turn.T) / 2)  # half a turn: the axis is the eigenvector of 1
    return np.asarray(angle * vectors[:, np.argmax(values)])


@cache
def _chi2_limit() -> float:
    return chi2_quantile(1 - MAX_CHANCE, 6)
