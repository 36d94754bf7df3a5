# SPDX-License-Identifier: Apache-2.0
"""`libocc guide`: experiments from files, result folders and errors."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import libocc as occ
from libocc.cli import main
from libocc.guide.docking_test import DEGREE, DockingLimits, DockingTest, Repetition, lower_limit
from libocc.guide.experiment import experiment_of, load_experiment
from libocc.yaml_files import parse_yaml

SHORT = """
schema: libocc-experiment/1
scene: kookmin_four_lamps
route:
  waypoints: [{x_m: 1.7, y_m: 1.7}, {x_m: 2.2, y_m: 1.7}]
  dock: {x_m: 2.5, y_m: 1.7, heading_deg: 0}
runs: 2
vehicle: {noise: {drive: 0.002, odometry: 0.001}}
"""


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(SHORT)
    return path


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, ["guide", *map(str, arguments)])
    return result.exit_code, result.stdout, result.stderr


def test_a_run_leaves_records_metrics_trajectories_and_pictures(experiment, tmp_path):
    out = tmp_path / "out"
    code, text, _ = run(experiment, "--out", out, "--json")
    assert code == 0
    summary = json.loads(text)
    assert summary["outcomes"] == {"arrived": 2}
    assert summary["docking_test"]["successes"] == 2
    assert summary["metrics"]["cross_track_rmse_m"]["max"] < 0.005
    assert json.loads((out / "summary.json").read_text()) == summary
    truth = occ.Trajectory.load(out / "runs/000_truth.tum")
    estimate = occ.Trajectory.load(out / "runs/000_estimate.tum")
    later = 1.0
    apart = truth.cam_from_world(later)[:3, 3] - estimate.cam_from_world(later)[:3, 3]
    assert np.linalg.norm(apart) < 0.003
    assert np.allclose(np.linalg.inv(truth.cam_from_world(truth.end_s))[:2, 3], [2.5, 1.7], atol=0.002)
    for name in ("paths.png", "errors.png", "dockings.png"):
        with Image.open(out / name) as picture:
            assert len(picture.getcolors(1 << 24)) > 20, name
    with Image.open(out / "run.gif") as moving:
        assert moving.n_frames > 50
    lines = (out / "docking_f3499.csv").read_text().splitlines()
    assert len(lines) == 3 and all(line.endswith(",yes") for line in lines[1:])
    assert len((out / "metrics.csv").read_text().splitlines()) == 3


def test_runs_are_added_and_any_number_of_workers_writes_the_same(experiment, tmp_path):
    for name, workers in (("a", 1), ("b", 2)):
        assert run(experiment, "--out", tmp_path / name, "--workers", workers, "--no-animation")[0] == 0
    for path in (tmp_path / "a" / "runs").iterdir():
        if "_times" not in path.name:
            assert path.read_bytes() == (tmp_path / "b" / "runs" / path.name).read_bytes(), path.name
    first = (tmp_path / "a" / "runs" / "000.json").stat().st_mtime_ns
    code, text, _ = run(experiment, "--out", tmp_path / "a", "--runs", 3, "--no-animation")
    assert code == 0 and text.startswith("3 of 3 runs")
    assert (tmp_path / "a" / "runs" / "000.json").stat().st_mtime_ns == first


def test_a_folder_of_another_experiment_is_rejected(experiment, tmp_path):
    assert run(experiment, "--out", tmp_path / "a", "--runs", 1, "--no-animation")[0] == 0
    code, _, error = run(experiment, "--out", tmp_path / "a", "--seed", 5)
    assert code == 2 and error.startswith(f"error: {tmp_path / 'a'}: ") and "seed was 0, is 5" in error


def test_the_exit_code_reports_a_run_that_does_not_arrive(tmp_path):
    path = tmp_path / "dark.yaml"
    dark = "\n".join(f"    - {{lamp: {i}, from_s: 0.5}}" for i in range(4))
    path.write_text(SHORT + "max_lost_s: 1\nfaults:\n  lamp_failures:\n" + dark)
    code, text, _ = run(path, "--out", tmp_path / "out", "--runs", 1, "--no-animation")
    assert code == 1
    assert text.startswith("1 of 1 runs of 0.50 m: 1 lost")


def test_a_protected_run_states_its_level(tmp_path):
    path = tmp_path / "protected.yaml"
    path.write_text(SHORT + "tracker: {alert_limit_m: 0.1}\n")
    out = tmp_path / "out"
    code, text, _ = run(path, "--out", out, "--runs", 1, "--no-animation")
    assert code == 0 and "protection level" in text and "stopped by an alert" in text
    header = (out / "runs/000_records.csv").read_text().splitlines()[0].split(",")
    assert {"protection_level_m", "alert"} <= set(header)
    summary = json.loads((out / "summary.json").read_text())
    assert 0 < summary["metrics"]["protection_level_m"]["max"] < 0.1


def test_a_run_that_never_has_a_level_records_its_alert(tmp_path):
    path = tmp_path / "dark.yaml"
    dark = "\n".join(f"    - {{lamp: {i}, from_s: 0}}" for i in range(4))
    path.write_text(SHORT + "max_lost_s: 1\ntracker: {alert_limit_m: 0.1}\nfaults:\n  lamp_failures:\n" + dark)
    out = tmp_path / "out"
    code, _, _ = run(path, "--out", out, "--runs", 1, "--no-animation")
    assert code == 1
    header, *rows = (line.split(",") for line in (out / "runs/000_records.csv").read_text().splitlines())
    assert {row[header.index("alert")] for row in rows} == {"1"}
    assert {row[header.index("protection_level_m")] for row in rows} == {"inf"}


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("schema: libocc-experiment/1", "schema: libocc-experiment/9"), "schema must be libocc-experiment/1"),
        (("scene: kook", "scene: cook"), "cookmin_four_lamps"),
        (("runs: 2", "runs: 0"), "runs must be a whole number above 0, got 0"),
        (("runs: 2", "rums: 2"), "experiment: unknown key 'rums'; did you mean runs?"),
        (("noise: {drive: 0.002", "noise: {drive: fast"), "vehicle.noise: drive: unsuitable value 'fast'"),
        (("noise: {drive: 0.002", "noise: {drive: -1"), "vehicle.noise.drive"),
        (("vehicle: {", "vehicle: {drive: hover, "), "vehicle.drive: unknown 'hover'"),
        (("x_m: 1.7", "x_m: wide"), "route.waypoints[0].x_m must be a finite number, got 'wide'"),
        (("x_m: 1.7, y_m: 1.7}, {", "x_m: 0.1, y_m: 1.7}, {"), "a wall"),
        (("heading_deg: 0", "heading_deg: north"), "route.dock.heading_deg must be a number in degrees"),
        (("heading_deg: 0", "heading_dge: 0"), "did you mean heading_deg?"),
        (("runs: 2", "faults: {frame_loss: 2}"), "frame_loss"),
        (("runs: 2", "faults: {lamp_failures: [{lamp: 77}]}"), "lamp_failures[0]"),
        (("runs: 2", "faults: {lamp_failures: 3}"), "faults.lamp_failures must be a list, got 3"),
        (("runs: 2", "plan: {kind: magic}"), "plan.kind must be route or pan_tilt, got 'magic'"),
        (("runs: 2", "plan: {kind: pan_tilt, pans: many}"), "plan"),
        (("runs: 2", "docking_test: {probability: 1}"), "docking_test.probability must be between 0 and 1"),
        (("runs: 2", "controller: {kind: pid}"), "controller.kind: unknown 'pid'"),
        (("runs: 2", "tracker: {coast: 1}"), "tracker: unknown key 'coast'"),
    ],
)
def test_errors_name_file_key_and_value(tmp_path, change, complaint):
    path = tmp_path / "wrong.yaml"
    path.write_text(SHORT.replace(*change))
    code, _, error = run(path, "--out", tmp_path / "out", "--no-animation")
    assert code == 2, error
    assert error.startswith(f"error: {path}: ") and complaint in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out" / "runs").exists()


def test_a_full_disk_keeps_existing_files(experiment, tmp_path, monkeypatch):
    from libocc.cli import result_folder

    real = result_folder.whole_file

    def full(path: str):
        if path.endswith("001_records.csv"):
            raise OSError(28, "No space left on device", path)
        return real(path)

    monkeypatch.setattr(result_folder, "whole_file", full)
    code, _, error = run(experiment, "--out", tmp_path / "out", "--no-animation")
    assert code == 2 and "001_records.csv: cannot be written" in error
    monkeypatch.undo()
    assert (tmp_path / "out/runs/000.json").is_file() and not (tmp_path / "out/runs/001.json").exists()
    assert run(experiment, "--out", tmp_path / "out", "--no-animation")[0] == 0


@pytest.mark.parametrize("name", ["four_lamps", "lamp_failure", "narrow_fixed", "narrow_pan_tilt", "narrow_route"])
def test_the_sample_experiments_are_complete(root, name):
    loaded = load_experiment(str(root / "data" / "experiments" / f"{name}.yaml"))
    assert loaded.route.length_m > 3
    assert loaded.planned is None or loaded.planned.ok
    assert (loaded.planned is not None) == (name in ("narrow_pan_tilt", "narrow_route"))


def test_angles_are_in_degrees(tmp_path):
    text = SHORT + "camera: {place_m: [0.1, 0, 1.2], tilt_deg: 20}\ncontroller: {kind: stanley, turn_on_spot_deg: 45}\n"
    options = experiment_of(parse_yaml(text), tmp_path).options
    assert math.isclose(options.camera_tilt_rad, math.radians(20))
    assert options.follower == occ.guide.Follower.stanley
    assert math.isclose(options.stanley.turn_on_spot_rad, math.pi / 4)
    assert np.allclose(options.camera_place_m, [0.1, 0, 1.2])


def repetition(along_m: float, docked: bool = True) -> Repetition:
    return Repetition(docked, along_m, 0.0, 0.0, 10.0)


def test_the_docking_test_counts_successes_in_sequence():
    limits = DockingLimits()
    assert limits.repetitions == 29  # 0.9^29 = 0.047
    assert DockingLimits(probability=0.5, confidence=0.875).repetitions == 3  # exactly
    good, bad = repetition(0.001), repetition(0.003)
    assert DockingTest(limits, [good] * 29).passed
    assert not DockingTest(limits, [good] * 28).passed
    assert not DockingTest(limits, [good] * 20 + [bad] + [good] * 28).passed
    assert not repetition(0.0, docked=False).succeeds(limits)
    assert not Repetition(True, 0.0, 0.0, 0.11 * DEGREE, 10.0).succeeds(limits)


def test_the_probability_shown_is_clopper_and_pearsons():
    assert lower_limit(0, 10, 0.95) == 0
    assert math.isclose(lower_limit(30, 30, 0.95), 0.05 ** (1 / 30), rel_tol=1e-6)
    # Tables of the binomial distribution: 8 of 10 at 95 %.
    assert math.isclose(lower_limit(8, 10, 0.95), 0.4930987, rel_tol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["narrow_fixed", "narrow_pan_tilt", "narrow_route"])
def test_a_long_lens_needs_a_plan(root, tmp_path, name):
    path = root / "data" / "experiments" / f"{name}.yaml"
    code, text, _ = run(path, "--out", tmp_path / "out", "--no-animation", "--json")
    summary = json.loads(text)
    assert code == (1 if name == "narrow_fixed" else 0)
    if name == "narrow_fixed":
        assert summary["metrics"]["availability"]["max"] < 0.5
    else:
        assert summary["metrics"]["availability"]["min"] >= 0.99
