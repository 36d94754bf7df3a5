# SPDX-License-Identifier: Apache-2.0
"""Runs of an experiment and their files: records, metrics, trajectories. Finished runs are not repeated."""

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import LoopMetrics, LoopResult, PlanarPose, Trajectory, closed_loop
from ...guide.docking_test import Repetition
from ...guide.experiment import Experiment, experiment_of
from ...guide.sections import fields_of
from ..progress import Advance
from ..result_folder import ResultFolder, json_bytes, table
from ..workers import run_jobs

WITH_POSE = (1, 2)  # values of LoopResult.records["state"]: tracking, coasting
# Computing times differ between runs and are written to a separate file.
TIMES = ("frame_mean_s", "frame_median_s", "frame_p99_s")


@dataclass(frozen=True)
class Job:
    data: Any  # content of the experiment file
    folder: str  # folder of relative file names
    index: int


def name_of(index: int) -> str:
    return f"runs/{index:03d}"


def compute_run(job: Job) -> dict[str, bytes]:
    experiment = experiment_of(job.data, Path(job.folder))
    return run_files(experiment, job.index)


def run_files(experiment: Experiment, index: int, observer: Any = None) -> dict[str, bytes]:
    """Files of a run by name; the last one marks the run as done."""
    result = closed_loop(experiment.scene, experiment.route, experiment.of_run(index), observer)
    name, records = name_of(index), result.records
    return {
        f"{name}_records.csv": column_table(record_rows(records)),
        f"{name}_frames.csv": column_table(frame_rows(result.frames)),
        f"{name}_truth.tum": tum(records, "true_"),
        f"{name}_estimate.tum": tum(records, "", np.isin(records["state"], WITH_POSE)),
        f"{name}_times.json": json_bytes({key: getattr(result.metrics, key) for key in TIMES}),
        f"{name}.json": json_bytes(summary_of(result)),
    }


def summary_of(result: LoopResult) -> dict[str, Any]:
    metrics = {key: getattr(result.metrics, key) for key in fields_of(LoopMetrics) if key not in TIMES}
    error: PlanarPose = metrics.pop("final_error")
    last = {"along_m": error.x_m, "across_m": error.y_m, "heading_rad": error.heading_rad}
    return {"outcome": result.outcome.name, "message": result.message, "final_error": last, **metrics}


def record_rows(records: dict[str, Any]) -> dict[str, Any]:
    dropped = {"covariance"}
    # With an alert limit, a step without a level is an alert.
    if not (np.isfinite(records["protection_level_m"]) | records["alert"]).any():
        dropped |= {"protection_level_m", "alert"}
    columns = {key: value for key, value in records.items() if key not in dropped}
    sigmas = np.sqrt(np.diagonal(records["covariance"], axis1=1, axis2=2))
    names = ("sigma_x_m", "sigma_y_m", "sigma_heading_rad")
    return columns | dict(zip(names, sigmas.T, strict=True))


def frame_rows(frames: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in frames.items() if key != "taken_s"}


def column_table(columns: dict[str, Any]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    plain = [np.asarray(v, int) if np.asarray(v).dtype == bool else np.asarray(v) for v in columns.values()]
    for row in zip(*(column.tolist() for column in plain), strict=True):
        writer.writerow([f"{v:.9g}" if isinstance(v, float) else v for v in row])
    return text.getvalue().encode()


def tum(records: dict[str, Any], prefix: str, there: NDArray[np.bool_] | None = None) -> bytes:
    """Poses of the vehicle in the world in TUM format. there: records that have a pose."""
    kept = np.ones(len(records["time_s"]), bool) if there is None else there
    columns = [records["time_s"], *(records[f"{prefix}{key}"] for key in ("x_m", "y_m", "heading_rad"))]
    rows = np.stack(columns, axis=1)[kept]
    if len(rows) == 0:
        return b""
    poses = [PlanarPose(x_m=x, y_m=y, heading_rad=h).body_from_world() for _, x, y, h in rows]
    return Trajectory(rows[:, 0].tolist(), poses).format().encode()


def is_done(folder: ResultFolder, index: int) -> bool:
    return folder.has(f"{name_of(index)}.json")


def run_all(folder: ResultFolder, jobs: list[Job], workers: int, advance: Advance) -> bool:
    """Computes runs; returns True after Ctrl-C, which keeps finished runs. Raises: OSError, ValueError."""
    return folder.keep(run_jobs(compute_run, jobs, workers, None, lambda: advance(0)), advance)


@dataclass(frozen=True)
class Run:
    """Results of a run, read from its files."""

    index: int
    summary: dict[str, Any]
    times: dict[str, float]

    @property
    def arrived(self) -> bool:
        return bool(self.summary["outcome"] == "arrived")

    def repetition(self) -> Repetition:
        error = self.summary["final_error"]
        return Repetition(
            self.arrived, error["along_m"], error["across_m"], error["heading_rad"], self.summary["duration_s"]
        )


def done_runs(folder: ResultFolder, count: int) -> list[Run]:
    return [
        Run(i, folder.read_json(f"{name_of(i)}.json"), folder.read_json(f"{name_of(i)}_times.json"))
        for i in range(count)
        if is_done(folder, i)
    ]


def columns_of(folder: ResultFolder, index: int, kind: str) -> dict[str, NDArray[np.float64]]:
    """Columns of a table of a run. kind: records or frames."""
    path = folder.path / f"{name_of(index)}_{kind}.csv"
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    return {name: rows[:, i] for i, name in enumerate(names)} if rows.size else {n: np.zeros(0) for n in names}


def metrics_table(runs: list[Run]) -> bytes:
    rows = [
        {"run": run.index, **{k: v for k, v in run.summary.items() if k != "final_error"},
         **{f"final_{k}": v for k, v in run.summary["final_error"].items()}, **run.times}
        for run in runs
    ]
    return table(rows)


def job_data(data: Any) -> Any:
    """Plain copy of the data, which can be sent to another process."""
    return json.loads(json.dumps(data))
