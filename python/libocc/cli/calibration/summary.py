# SPDX-License-Identifier: Apache-2.0
"""An adjusted network with the values of its report."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import (
    Adjustment,
    CheckResult,
    Datum,
    Network,
    NetworkStatistics,
    Precision,
    Target,
    VarianceComponents,
    check_points,
    free_parameter_value,
    image_residuals_px,
    network_statistics,
    precision,
    projection_uncertainty,
    variance_components,
)

STRONG = 0.9  # correlations above it are reported
GRID = 24  # points of the uncertainty map along the longer side
MISFIT = 3.0  # sigma0 above it gives a warning: the residuals are not explained by noise
IMAGE, POINT, BODY, CORNER, X, Y, SIGMA_X, SIGMA_Y, USED = range(9)  # columns of Network.observations


@dataclass(frozen=True)
class Parameter:
    """Estimated parameter of a camera; sigma includes the factor sigma0."""

    camera: str
    name: str
    unit: str
    value: float
    sigma: float
    before: float

    @property
    def t(self) -> float:
        """Estimate over its sigma: test statistic against zero."""
        return abs(self.value) / self.sigma if self.sigma > 0 else float("inf")


@dataclass(frozen=True)
class Calibration:
    """An adjustment and its statistics.

    start: network before the adjustment. known: precision; `ok` only if the adjustment is ok.
    """

    start: Network
    adjustment: Adjustment
    known: Precision
    seconds: float = 0.0
    notes: list[str] = field(default_factory=list)
    statistics: NetworkStatistics | None = None
    components: VarianceComponents | None = None
    checked: CheckResult | None = None

    @property
    def network(self) -> Network:
        return self.adjustment.network

    @property
    def ok(self) -> bool:
        return self.adjustment.ok and self.known.ok

    @cached_property
    def observations(self) -> NDArray[np.float64]:
        return np.asarray(self.network.observations)

    @cached_property
    def residuals_px(self) -> NDArray[np.float64]:
        return np.asarray(image_residuals_px(self.network))

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        return (self.observations[:, USED] > 0) & np.isfinite(self.residuals_px).all(axis=1)

    def of_camera(self, camera: int) -> NDArray[np.bool_]:
        """Mask of the used observations of a camera."""
        cameras = np.asarray(self.network.image_cameras, dtype=int)
        return np.asarray(self.used & (cameras[self.observations[:, IMAGE].astype(int)] == camera))

    def rms_px(self, camera: int) -> NDArray[np.float64]:
        """(2,) r.m.s. residual per axis [px]."""
        chosen = self.residuals_px[self.of_camera(camera)]
        return np.sqrt(np.mean(chosen**2, axis=0)) if len(chosen) else np.zeros(2)

    @cached_property
    def projection_sigmas_px(self) -> list[NDArray[np.float64] | None]:
        """Map (rows, columns) of the projection uncertainty of each camera; None without free parameters."""
        found: list[NDArray[np.float64] | None] = []
        for k, (model, free) in enumerate(zip(self.network.cameras, self.network.free_parameters)):
            if not free or not self.known.ok:
                found.append(None)
                continue
            columns = GRID if model.width >= model.height else max(GRID // 2, GRID * model.width // model.height)
            rows = GRID if model.height >= model.width else max(GRID // 2, GRID * model.height // model.width)
            sigma, _, _ = projection_uncertainty(model, free, self.known.parameters(k), columns=columns, rows=rows)
            found.append(np.asarray(sigma))
        return found

    @cached_property
    def parameters(self) -> list[Parameter]:
        found = []
        for k, (camera, name, free) in enumerate(
            zip(self.network.cameras, self.network.camera_names, self.network.free_parameters)
        ):
            sigmas = np.sqrt(np.diag(self.known.parameters(k))) if self.known.ok else np.full(len(free), np.inf)
            for parameter, sigma in zip(free, sigmas):
                now = free_parameter_value(camera, parameter)
                before = free_parameter_value(self.start.cameras[k], parameter).value
                found.append(Parameter(name, parameter, now.unit, now.value, float(sigma), before))
        return found

    def correlations(self, camera: int) -> NDArray[np.float64]:
        return np.asarray(self.known.parameter_correlation(camera))

    def strong_correlations(self, camera: int) -> list[tuple[str, str, float]]:
        names = self.network.free_parameters[camera]
        rho = self.correlations(camera)
        return [
            (names[i], names[j], float(rho[i, j]))
            for i in range(len(names)) for j in range(i) if abs(rho[i, j]) > STRONG
        ]

    @cached_property
    def point_sigmas_m(self) -> NDArray[np.float64]:
        """(n, 3) sigmas along the axes; infinite for points that were not estimated."""
        if not self.known.ok or not self.network.point_names:
            return np.empty((0, 3))
        return np.asarray(np.sqrt(np.einsum("nii->ni", self.known.points())))


def calibration_of(
    start: Network, adjustment: Adjustment, datum: Datum, seconds: float = 0.0, checks: dict[str, Any] | None = None,
) -> Calibration:
    """Adjustment with its statistics, and its precision in the datum, scaled by sigma0 squared if there is redundancy.

    checks: known positions of check points by name.
    """
    known = precision(adjustment.network, datum)
    if adjustment.redundancy > 0:
        known = known.scaled(adjustment.sigma0**2)
    if not (adjustment.ok and known.ok):
        return Calibration(start, adjustment, known, seconds)
    checked = None
    if checks:
        names = adjustment.network.point_names
        targets = [Target.point(names.index(name)) for name in checks]
        checked = check_points(adjustment.network, known, targets, np.array(list(checks.values())))
    notes = []
    if adjustment.sigma0 > MISFIT:
        notes.append(
            f"the residuals are {adjustment.sigma0:.3g} times as large as their sigmas: the camera model may be wrong, "
            "or the observations are much less accurate than assumed"
        )
    return Calibration(
        start, adjustment, known, seconds, notes, statistics=network_statistics(adjustment.network),
        components=variance_components(adjustment.network, datum), checked=checked,
    )


def finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def without_infinities(data: Any) -> Any:
    """Plain data in which infinite and undefined numbers are None, as JSON requires."""
    if isinstance(data, dict):
        return {key: without_infinities(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [without_infinities(value) for value in data]
    return finite(data) if isinstance(data, float) else data


def summary(c: Calibration) -> dict[str, Any]:
    """Plain data for JSON; infinite values are null."""
    return without_infinities(everything(c))  # type: ignore[no-any-return]


def everything(c: Calibration) -> dict[str, Any]:
    """Values of the report, some of them infinite or undefined without redundancy."""
    a, network = c.adjustment, c.network
    sigmas = c.point_sigmas_m
    names = network.point_names
    return {
        "status": a.status.name if not a.ok else c.known.status.name,
        "message": a.message or c.known.message,
        "warnings": list(a.warnings) + c.notes,
        "sigma0": a.sigma0, "redundancy": a.redundancy, "observations": a.observations,
        "unknowns": a.unknowns, "datum_defect": a.defect, "iterations": a.iterations,
        "rejected_share": a.rejected_share,
        "cameras": [
            {
                "name": name, "kind": camera.kind.name, "rms_px": c.rms_px(k).tolist(),
                "observations": int(c.of_camera(k).sum()),
                "strong_correlations": c.strong_correlations(k) if c.known.ok else [],
                "projection": projection_of(c, k),
            }
            for k, (name, camera) in enumerate(zip(network.camera_names, network.cameras))
        ],
        "parameters": [
            {"camera": p.camera, "name": p.name, "unit": p.unit, "value": p.value, "sigma": finite(p.sigma),
             "before": p.before, "t": finite(p.t)}
            for p in c.parameters
        ],
        "rejected": [
            {"image": network.image_names[int(c.observations[r.observation, IMAGE])],
             "target": target_name(c, r.observation), "normalised": finite(r.normalised), "reason": r.reason}
            for r in a.rejected
        ],
        "rejected_distances": [
            {"name": r.name, "normalised": finite(r.normalised), "residual_m": finite(r.residual_m)}
            for r in a.rejected_distances
        ],
        "rejected_control": [
            {"name": r.name, "normalised": finite(r.normalised), "coordinate": "xyz"[r.coordinate],
             "residual_m": finite(r.residual_m)}
            for r in a.rejected_control
        ],
        "left_out": [{"kind": one.kind, "name": one.name, "reason": one.reason} for one in a.left_out],
        "weak_points": [network.point_names[i] for i in a.weak_points],
        "variance_components": components_of(c),
        "reliability": reliability_of(c),
        "check_points": None if c.checked is None or not c.checked.ok else {
            "rmse_m": c.checked.rmse_m.tolist(), "predicted_m": c.checked.predicted_m.tolist(),
            "rmse_3d_m": c.checked.rmse_3d_m, "predicted_3d_m": c.checked.predicted_3d_m,
        },
        "points": [
            {"name": name, "position_m": position.tolist(), "sigma_m": [finite(s) for s in sigma]}
            for name, position, sigma in zip(names, np.asarray(network.points_m), sigmas)
        ],
    }


def projection_of(c: Calibration, camera: int) -> dict[str, Any] | None:
    """Median and maximum of the projection uncertainty, and the part of the image where it is defined."""
    sigma = c.projection_sigmas_px[camera]
    if sigma is None:
        return None
    inside = sigma[np.isfinite(sigma)]
    return {
        "median_sigma_px": float(np.median(inside)) if len(inside) else None,
        "max_sigma_px": float(inside.max()) if len(inside) else None,
        "defined": len(inside) / sigma.size,
    }


def components_of(c: Calibration) -> list[dict[str, Any]]:
    """Estimated factors of the sigmas of each camera's columns and rows."""
    if c.components is None or not c.components.ok:
        return []
    return [
        {"camera": c.network.camera_names[k.camera], "axis": "columns" if k.axis == 0 else "rows",
         "factor": k.factor, "redundancy": k.redundancy}
        for k in c.components.components
    ]


def reliability_of(c: Calibration) -> dict[str, Any] | None:
    """Reliability of the used image observations."""
    s = c.statistics
    if s is None or not s.ok or not c.used.any():
        return None
    redundancy, tau = s.redundancy[c.used], np.abs(s.tau[c.used])
    return {
        "mean_redundancy": float(redundancy.mean()), "min_redundancy": float(redundancy.min()),
        "median_detectable_px": finite(np.median(s.detectable_px[c.used])),
        "worst_detectable_px": finite(s.detectable_px[c.used].max()),
        "median_external": finite(np.median(s.external[c.used])),
        "worst_tau": float(tau.max()), "tau_critical": s.tau_critical,
        "sigma0_interval": [s.sigma0_low, s.sigma0_high],
    }


def target_name(c: Calibration, observation: int) -> str:
    row = c.observations[observation]
    if row[POINT] >= 0:
        return c.network.name_of(Target.point(int(row[POINT])))
    return c.network.name_of(Target.corner(int(row[BODY]), int(row[CORNER])))
