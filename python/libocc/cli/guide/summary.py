# SPDX-License-Identifier: Apache-2.0
"""Summary of an experiment's runs as text and JSON, and the report of a docking test."""

import math
from typing import Any

from ...guide.docking_test import DEGREE, DockingTest
from ...guide.experiment import Experiment
from ..result_folder import table
from .runs import Run

# Key in a run's summary, name, unit and factor of the printed value.
SHOWN = (
    ("cross_track_mean_m", "cross-track mean", "mm", 1e3),
    ("cross_track_rmse_m", "cross-track RMSE", "mm", 1e3),
    ("cross_track_max_m", "cross-track max", "mm", 1e3),
    ("position_rmse_m", "position error RMSE", "mm", 1e3),
    ("position_sigma_m", "position sigma", "mm", 1e3),
    ("heading_rmse_rad", "heading error RMSE", "deg", 1 / DEGREE),
    ("final_position_error_m", "final position error", "mm", 1e3),
    ("final_heading_error_rad", "final heading error", "deg", 1 / DEGREE),
    ("availability", "availability", "%", 100),
    ("three_lamps", "images with three lamps", "%", 100),
    ("longest_outage_s", "longest outage", "s", 1),
    ("lost_s", "without a pose", "s", 1),
    ("nees", "NEES (3 expected)", "", 1),
    ("nis_per_dof", "NIS per degree (1)", "", 1),
    ("driven_m", "driven", "m", 1),
)
# Shown if an alert limit is set.
PROTECTED = (
    ("protection_level_m", "protection level", "mm", 1e3),
    ("alert_s", "stopped by an alert", "s", 1),
)
TIMED = (("frame_median_s", "time per frame, median", "us", 1e6), ("frame_p99_s", "time per frame, p99", "us", 1e6))


def spread(values: list[float]) -> dict[str, float]:
    return {"mean": sum(values) / len(values), "min": min(values), "max": max(values)}


def summarised(experiment: Experiment, runs: list[Run], test: DockingTest | None) -> dict[str, Any]:
    outcomes = [run.summary["outcome"] for run in runs]
    data: dict[str, Any] = {
        "runs": len(runs), "of": experiment.runs,
        "outcomes": {name: outcomes.count(name) for name in sorted(set(outcomes))},
        "route_m": experiment.route.length_m,
    }
    if (planned := experiment.planned) is not None:
        data["plan"] = {
            "kind": planned.kind, "status": planned.status, "message": planned.message,
            "seen_share": planned.seen_share,
        }
    shown = SHOWN + PROTECTED if experiment.options.alert_limit_m is not None else SHOWN
    data["metrics"] = {key: spread([float(run.summary[key]) for run in runs]) for key, *_ in shown}
    if test is not None:
        data["docking_test"] = docking_dict(test)
    return data


def docking_dict(test: DockingTest) -> dict[str, Any]:
    repeatability = {key: value for key, value in test.repeatability().items() if math.isfinite(value)}
    return {
        "position_limit_m": test.limits.position_m, "heading_limit_rad": test.limits.heading_rad,
        "probability": test.limits.probability, "confidence": test.limits.confidence,
        "repetitions": len(test.repetitions), "successes": test.successes,
        "needed_in_sequence": test.limits.repetitions, "longest_sequence": test.longest_sequence,
        "passed": test.passed, "probability_shown": test.probability_shown, **repeatability,
    }


def text_of(data: dict[str, Any], runs: list[Run]) -> str:
    outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in data["outcomes"].items())
    lines = [f"{data['runs']} of {data['of']} runs of {data['route_m']:.2f} m: {outcomes}"]
    if "plan" in data:
        plan = data["plan"]
        share = f"lamps in view on {100 * plan['seen_share']:.1f} % of the route"
        lines.append(f"plan ({plan['kind']}): {plan['status']}, {share}")
        lines += [plan["message"]] if plan["message"] else []
    lines.append(f"{'':24}{'mean':>10}{'min':>10}{'max':>10}")
    for key, name, unit, scale in SHOWN + PROTECTED:
        if key in data["metrics"]:
            lines.append(row(name, unit, scale, data["metrics"][key]))
    for key, name, unit, scale in TIMED:
        lines.append(row(name, unit, scale, spread([run.times[key] for run in runs])))
    if "docking_test" in data:
        lines += docking_lines(data["docking_test"])
    return "\n".join(lines)


def row(name: str, unit: str, scale: float, values: dict[str, float]) -> str:
    return f"{name:24}" + "".join(f"{scale * values[key]:10.3g}" for key in ("mean", "min", "max")) + f" {unit}"


def docking_lines(test: dict[str, Any]) -> list[str]:
    limits = f"{1e3 * test['position_limit_m']:g} mm and {test['heading_limit_rad'] / DEGREE:g} deg"
    if test["repetitions"] < test["needed_in_sequence"]:
        verdict = "too few repetitions"
    else:
        verdict = f"reached {test['longest_sequence']}: {'passed' if test['passed'] else 'not passed'}"
    return [
        f"docking (ASTM F3499-21): {test['successes']} of {test['repetitions']} within {limits}; "
        f"R = {test['probability']:g} at C = {test['confidence']:g} requires {test['needed_in_sequence']} in sequence, "
        f"{verdict}",
        f"success probability at least {test['probability_shown']:.3f} at that confidence",
    ]


def docking_table(test: DockingTest) -> bytes:
    """Table with one line per repetition, as required in the report of the test."""
    return table(
        {
            "repetition": i + 1, "docked": "yes" if one.docked else "no", "along_mm": f"{1e3 * one.along_m:.4f}",
            "across_mm": f"{1e3 * one.across_m:.4f}", "position_mm": f"{1e3 * one.position_m:.4f}",
            "heading_deg": f"{one.heading_rad / DEGREE:.5f}", "duration_s": f"{one.duration_s:.2f}",
            "success": "yes" if one.succeeds(test.limits) else "no",
        }
        for i, one in enumerate(test.repetitions)
    )
