# SPDX-License-Identifier: Apache-2.0
"""`libocc sweep`: what points a file means, the same result from any workers, bad input."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from small_room import SWEEP, contents, write_all

import libocc as occ
from libocc.cli import workers
from libocc.cli.sweep import run as sweep_run
from libocc.cli.sweep.paths import set_path, steps_of
from libocc.cli.sweep.plan import read_sweep, scene_and_pose
from libocc.cli.sweep.point import compute_point
from libocc.cli.sweep.ranges import values_of
from libocc.cli.sweep.run import points_of


@pytest.fixture
def run(libocc, tmp_path: Path):
    """Runs a command line in a folder with a small scene and a sweep."""
    write_all(tmp_path)
    return libocc


def test_paths():
    assert steps_of("lamps[2].centre_m[0]") == ["lamps", 2, "centre_m", 0]
    data = {"lamps": [{"power_w": 1}, {"power_w": 1}], "sensor": {}}
    set_path(data, "lamps[*].power_w", 3)
    set_path(data, "lamps[1].name", "door")
    set_path(data, "lens.veiling_glare", 0.1)
    assert data == {
        "lamps": [{"power_w": 3}, {"power_w": 3, "name": "door"}], "sensor": {}, "lens": {"veiling_glare": 0.1}
    }


@pytest.mark.parametrize("path", ["", "lamps[", "lamps[-1].x", "[0].x", "a b", "a..b", "a[0]b"])
def test_invalid_paths_are_rejected(path):
    with pytest.raises(ValueError, match="is not a path such as sensor.exposure_s"):
        steps_of(path)


def test_ranges():
    assert values_of("a", [3, "x"], 0) == [3, "x"]
    assert values_of("a", {"linear": [1, 2], "count": 3}, 0) == [1, 1.5, 2]
    assert values_of("a", {"log": [1e-5, 1e-3], "count": 3}, 0) == pytest.approx([1e-5, 1e-4, 1e-3])
    drawn = values_of("a", {"uniform": [2, 3], "count": 400}, 7)
    assert all(2 <= v < 3 for v in drawn) and np.mean(drawn) == pytest.approx(2.5, abs=0.06)
    assert drawn == values_of("a", {"uniform": [2, 3], "count": 400, "seed": 7}, 1)
    assert drawn != values_of("a", {"uniform": [2, 3], "count": 400}, 8)
    assert drawn != values_of("b", {"uniform": [2, 3], "count": 400}, 7)
    logs = np.log10(values_of("a", {"log_uniform": [1e-4, 1e-2], "count": 400}, 7))
    assert logs.mean() == pytest.approx(-3, abs=0.12) and logs.min() > -4 and logs.max() < -2
    normal = values_of("a", {"normal": [5, 0.1], "count": 400}, 7)
    assert np.mean(normal) == pytest.approx(5, abs=0.02) and np.std(normal) == pytest.approx(0.1, rel=0.15)


def test_a_grid_and_a_zip(run):
    points = points_of(read_sweep("sweep.yaml"))
    power = [point.values["lamps[*].power_w"] for point in points]
    assert len(points) == 6 and power[:3] == power[3:] and len(set(power)) == 3
    assert [p.values["sensor.exposure_s"] for p in points] == pytest.approx([5e-5] * 3 + [2e-4] * 3)
    text = SWEEP.replace("count: 3", "count: 2") + "combine: zip\n"
    Path("zip.yaml").write_text(text)
    points = points_of(read_sweep("zip.yaml"))
    assert [p.values["sensor.exposure_s"] for p in points] == pytest.approx([5e-5, 2e-4])


def test_a_point_is_the_scene_with_its_values(run):
    sweep = read_sweep("sweep.yaml")
    values = {
        "sensor.exposure_s": 2e-5, "lamps[2].centre_m[0]": 0.25, "lamps[*].power_w": 0.5,
        "pose.position_m[2]": 0.3, "effects.noise": "off", "pose.tilt_deg": 4,
    }
    scene, pose = scene_and_pose(sweep.base, values)
    assert scene.sensor.exposure_s == 2e-5 and scene.lamps[2].centre_m[0] == 0.25
    assert {lamp.power_w for lamp in scene.lamps} == {0.5} and scene.effects.use["noise"] is occ.rendering.Use.off
    assert np.linalg.inv(pose)[2, 3] == pytest.approx(0.3)
    assert math.degrees(math.acos(pose[2, 2])) == pytest.approx(4)


def test_the_result_does_not_depend_on_workers(run):
    for count in (1, 2, 3):
        code, out, err = run("sweep", "sweep.yaml", "--out", f"out{count}", "--workers", count)
        assert code == 0, err
        assert out == f"out{count}: 6 of 6 points, 6 of them new; table in out{count}/results.csv\n"
    assert contents("out1") == contents("out2") == contents("out3")


def test_a_dask_cluster_computes_the_same(run):
    distributed = pytest.importorskip("distributed")
    assert run("sweep", "sweep.yaml", "--out", "here")[0] == 0
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster:
        code, _, err = run("sweep", "sweep.yaml", "--out", "there", "--scheduler", cluster.scheduler_address)
    assert code == 0, err
    assert contents("here") == contents("there")


def test_a_scheduler_that_is_not_there(run, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "CONNECT_S", 0.3)
    code, _, err = run("sweep", "sweep.yaml", "--out", "out", "--scheduler", "tcp://127.0.0.1:1")
    assert code == 2 and "tcp://127.0.0.1:1" in err


def test_results_agree_with_the_images(run):
    assert run("sweep", "sweep.yaml", "--out", "out")[0] == 0
    rows = list(csv.DictReader(Path("out/results.csv").read_text().splitlines()))
    assert [(int(r["point"]), int(r["image"])) for r in rows] == [(p, i) for p in range(6) for i in range(2)]
    frames = []
    for row in rows:
        name = f"{int(row['point']):06d}_{int(row['image']):03d}"
        image = occ.read_image(f"out/images/{name}.png")
        truth = json.loads(Path(f"out/truth/{name}.json").read_text())
        scene, _ = scene_and_pose(
            read_sweep("sweep.yaml").base,
            {key: float(row[key]) for key in ("sensor.exposure_s", "lamps[*].power_w")},
        )
        fix = occ.locate(image, scene)
        assert row["status"] == fix.status.name and int(row["blobs"]) == len(occ.detect(image))
        if fix.ok:
            error = np.linalg.norm(np.ravel(fix.position_m) - truth["position_m"])
            assert float(row["position_error_m"]) == error
        else:
            assert row["position_error_m"] == ""
        frames.append(image)
    assert len({frame.tobytes() for frame in frames}) == len(frames), "each image has noise of its own"


def test_measures_alone_write_no_images(run):
    Path("few.yaml").write_text(SWEEP.replace("[images, truth, detect, locate]", "[locate, time]"))
    assert run("sweep", "few.yaml", "--out", "out")[0] == 0
    assert not Path("out/images").exists() and not Path("out/truth").exists()
    times = list(csv.DictReader(Path("out/times.csv").read_text().splitlines()))
    assert len(times) == 12 and all(float(row["render_s"]) > 0 for row in times)


def test_points_that_are_done_are_not_computed_again(run, monkeypatch):
    assert run("sweep", "sweep.yaml", "--out", "out")[0] == 0
    before = contents("out")
    Path("out/points/000001.json").unlink()  # as if it were broken off before this was written
    Path("out/images/000004_001.png").unlink()
    computed = []

    def compute(point):
        computed.append(point.index)
        return compute_point(point)

    monkeypatch.setattr(sweep_run, "compute_point", compute)
    assert run("sweep", "sweep.yaml", "--out", "out")[1].startswith("out: 6 of 6 points, 2 of them new")
    assert computed == [1, 4] and contents("out") == before


def test_ctrl_c_keeps_finished_results(run, monkeypatch):
    assert run("sweep", "sweep.yaml", "--out", "whole")[0] == 0

    def compute(point):
        if point.index == 3:
            raise KeyboardInterrupt
        return compute_point(point)

    with monkeypatch.context() as patch:
        patch.setattr(sweep_run, "compute_point", compute)
        code, out, err = run("sweep", "sweep.yaml", "--out", "out")
    assert code == 130 and out.startswith("out: 3 of 6 points") and "continues from here" in err
    assert len(Path("out/results.csv").read_text().splitlines()) == 1 + 3 * 2
    assert run("sweep", "sweep.yaml", "--out", "out")[0] == 0
    assert contents("out") == contents("whole")


def test_a_changed_sweep_is_rejected(run):
    assert run("sweep", "sweep.yaml", "--out", "out")[0] == 0
    before = contents("out")
    Path("sweep.yaml").write_text(SWEEP.replace("images: 2", "images: 3"))
    code, _, err = run("sweep", "sweep.yaml", "--out", "out")
    assert code == 2 and "out: contains the result of other settings" in err and "sweep file (sha256) was" in err
    Path("sweep.yaml").write_text(SWEEP)
    Path("room.yaml").write_text(Path("room.yaml").read_text().replace("0.15", "0.16"))
    code, _, err = run("sweep", "sweep.yaml", "--out", "out")
    assert code == 2 and "scene and pose (sha256) was" in err and contents("out") == before


def sweep_of(parameters: str, **more: str) -> str:
    head, tail = SWEEP.split("parameters:")
    rest = tail[tail.index("images:"):]
    lines = "".join(f"  {line}\n" for line in parameters.splitlines())
    return head + "parameters:\n" + lines + rest + "".join(f"{key}: {value}\n" for key, value in more.items())


def test_incompatible_values_are_rejected_before_the_first_point(run, monkeypatch):
    def never(point):
        raise AssertionError(f"point {point.index} was rendered")

    monkeypatch.setattr(sweep_run, "compute_point", never)
    boxes = "boxes[0].min_m[2]: [1.2, 1.4, 1.6]\nboxes[0].max_m[2]: [1.3, 1.5, 1.7]"
    Path("bad.yaml").write_text(sweep_of("boxes[0].max_m[2]: [1.6, 1.7]\nboxes[0].min_m[2]: [1.2, 1.65]"))
    code, out, err = run("sweep", "bad.yaml", "--out", "out")
    assert code == 2 and out == "" and err.count("\n") == 1 and not Path("out").exists()
    assert "bad.yaml: parameters.boxes[0].min_m[2]: 1.65: " in err and "max_m" in err

    both = "effects.walls: ['off', 'on']\neffects.interreflection: ['off', 'auto', 'on']"
    Path("bad.yaml").write_text(sweep_of(both + "\nroom: [{size_m: [4, 4, 3], wall_reflectance: 0.5}]"))
    code, out, err = run("sweep", "bad.yaml", "--out", "out")
    assert code == 2 and out == "" and not Path("out").exists(), err

    Path("bad.yaml").write_text(sweep_of(boxes.replace("1.5", "1.35"), combine="zip"))
    code, out, err = run("sweep", "bad.yaml", "--out", "out")
    assert code == 2 and "bad.yaml: point 1, {" in err and "1.35" in err and "max_m" in err
    assert not Path("out").exists()


def test_zipped_values_need_fit_only_those_of_their_point(run):
    boxes = "boxes[0].min_m[2]: [1.2, 1.4, 1.6]\nboxes[0].max_m[2]: [1.3, 1.5, 1.7]"
    Path("zip.yaml").write_text(sweep_of(boxes, combine="zip"))
    code, out, err = run("sweep", "zip.yaml", "--out", "out")
    assert code == 0 and "3 of 3 points" in out, err


EXPOSURE = "sensor.exposure_s: {log: [5e-5, 2e-4], count: 2}"


@pytest.mark.parametrize(
    "old, new, text",
    [
        (EXPOSURE, "sensor.exposur_s: [1]", "did you mean `exposure_s`"),
        (EXPOSURE, "sensr.exposure_s: [1]", "did you mean `sensor`"),
        (EXPOSURE, "pose.hedding_deg: [1]", "unknown key 'hedding_deg'; did you mean heading_deg?"),
        (EXPOSURE, "lamps[7].power_w: [1]", "lamps[7].power_w: lamps has 4 entries, [0] to [3]"),
        (EXPOSURE, "lamps.power_w: [1]", "lamps.power_w: lamps has no keys"),
        (EXPOSURE, "sensor[0]: [1]", "sensor[0]: sensor is not a list"),
        (EXPOSURE, "lens.ghosts[0].scale: [1]", "lens.ghosts is not in the file"),
        (EXPOSURE, "sensor.exposure_s: [-1]", "sensor.exposure_s"),
        (EXPOSURE, "sensor.exposure_s: [1e-4, -1, 1e-5]", "parameters.sensor.exposure_s: -1: key"),
        (EXPOSURE, "pose.position_m: [[0, 0, 0], [-0.3, -0.3, 1.25]]", "cam_from_world must be outside boxes[0]"),
        (EXPOSURE, "sensor.exposure_s: [1e-4, 1e-3, long]", "parameters.sensor.exposure_s: 'long': "),
        (EXPOSURE, "sensor.exposure_s: []", "sensor.exposure_s.values must be a list of at least one"),
        (EXPOSURE, "sensor.exposure_s: {log: [1, 1], count: 3}", "sensor.exposure_s.log is an empty range"),
        (EXPOSURE, "sensor.exposure_s: {uniform: [2, 1], count: 3}", "uniform is an empty range"),
        (EXPOSURE, "sensor.exposure_s: {linear: [1, 2], count: 0}", "count must be a whole number not below 1, got 0"),
        (EXPOSURE, "sensor.exposure_s: {linear: [1, 2]}", "count must be a whole number not below 1, got None"),
        (EXPOSURE, "sensor.exposure_s: {log: [0, 2], count: 2}", "log must be positive, got [0, 2]"),
        (EXPOSURE, "sensor.exposure_s: {linear: [.nan, 2], count: 2}", "must be two finite numbers"),
        (EXPOSURE, "sensor.exposure_s: {liner: [1, 2], count: 2}", "unknown key 'liner'; did you mean linear?"),
        (EXPOSURE, "sensor.exposure_s: {count: 2}", "must have one of values, linear"),
        (EXPOSURE, "sensor.exposure_s: {normal: [1, 0], count: 2}", "with sigma positive"),
        ("images: 2", "images: 0", "images must be a whole number not below 1, got 0"),
        ("images: 2", "combine: zipp", "combine: unknown 'zipp'; did you mean zip?"),
        ("images: 2", "combine: zip", "zip requires the same number of values for each parameter"),
        ("images: 2", "format: pnq", "unknown image format 'pnq'; did you mean png?"),
        ("images: 2", "imges: 2", "unknown key 'imges'; did you mean images?"),
        ("[images, truth", "[imags, truth", "keep: unknown 'imags'; did you mean images?"),
        ("scene: room.yaml", "scene: attic.yaml", "attic.yaml"),
        ("pose: {position_m: [0, 0, 0.1]}", "pose: {}", "pose.position_m is missing"),
        ("libocc-sweep/1", "libocc-sweep/9", "schema must be libocc-sweep/1, got 'libocc-sweep/9'"),
    ],
)
def test_bad_sweeps(run, old, new, text):
    assert old in SWEEP
    Path("bad.yaml").write_text(SWEEP.replace(old, new))
    code, out, err = run("sweep", "bad.yaml", "--out", "out")
    assert code == 2 and text in err and "bad.yaml" in err and err.count("\n") == 1, err
    assert out == "" and not Path("out").exists()
