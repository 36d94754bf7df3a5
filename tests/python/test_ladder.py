# SPDX-License-Identifier: Apache-2.0
"""`libocc ladder`, its statistics, and budgets in Python."""

import csv
import json
import math
import re
import signal
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import libocc as occ
from libocc.cli import main
from libocc.cli.files import whole_file
from libocc.cli.ladder import costs, measure, plot
from libocc.cli.ladder.experiment import Experiment, noisier
from libocc.cli.ladder.figures import Row, advice, rows_of


@pytest.fixture
def run(libocc):
    return lambda *arguments: libocc("ladder", "--min-time-us", "0.001", *arguments)


REFINED = ("centres", "rims", "rims+flux", "direct")


def test_refined_rungs_reach_their_bound_and_points_do_not(run):
    code, out, err = run("--frames", 40, "--seed", 3, "--json")
    assert code == 0, err
    data = json.loads(out)
    rows = {row["name"]: row for row in data["rungs"] if row["family"] != "PoseLib"}
    for name in REFINED:
        for ratio in ("position_over_own", "rotation_over_own"):
            assert 0.75 < rows[name][ratio] < 1.3, (name, ratio)
        assert rows[name]["failures"] == rows[name]["outliers"] == 0
    assert 0.75 < rows["direct"]["position_over_pixels"] < 1.3
    assert rows["direct"]["position_over_pixels"] < rows["rims"]["position_over_pixels"]
    for name in ("p3p", "solve_pose", "SQPNP"):
        assert rows[name]["position_over_own"] > 2, "they know nothing of ellipses"
    assert rows["dlt"]["failures"] == 1 and rows["dlt"]["position_rmse_m"] is None


def test_json_and_csv_hold_the_same_rows(run):
    options = ("--frames", 3, "--rung", "p3p", "--rung", "rims", "--csv", "table.csv")
    code, out, _ = run(*options, "--json", "--lamps", 5, "--noise", 2)
    data = json.loads(out)
    assert code == 0 and data["frames"] == 3 and data["interrupted"] is False
    assert data["experiment"]["lamps"] == 5 and data["experiment"]["noise"] == 2
    assert data["detect_median_s"] > 0 and data["advice"] is None and data["missing"] == []
    names = [field.name for field in fields(Row)]
    with open("table.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert [list(row) for row in (*data["rungs"], *table)] == [names] * 4
    for plain, text in zip(data["rungs"], table):
        assert float(text["position_rmse_m"]) == plain["position_rmse_m"] > 0
        assert 0 < plain["time_median_s"] <= plain["time_p95_s"]
        assert text["name"] == plain["name"] and text["pareto"] == str(plain["pareto"])


def test_one_rectangle_has_the_rungs_of_its_shape(run):
    code, out, _ = run("panels_and_tubes", "--lamps", 1, "--frames", 4, "--tilt-deg", 20, "--json")
    rows = {row["name"]: row for row in json.loads(out)["rungs"]}
    assert code == 0 and set(rows) == {"v_p4l", "corners", "lc_vlp", "rims", "rims+flux", "direct"}
    assert rows["v_p4l"]["family"] == "literature" and rows["v_p4l"]["peer"]
    assert rows["direct"]["position_rmse_m"] < rows["v_p4l"]["position_rmse_m"]
    code, out, _ = run("panels_and_tubes", "--lamps", 1, "--frames", 1)
    assert code == 0 and "panels_and_tubes: 1 lamp at 2.5 m" in out


def test_the_same_seed_gives_the_same_errors(run):
    def errors(seed):
        _, out, _ = run("--frames", 3, "--rung", "rims", "--json", "--seed", seed)
        return json.loads(out)["rungs"][0]["position_rmse_m"]

    assert errors(1) == errors(1) != errors(2)


def test_text_lists_every_rung_and_a_recommendation(run):
    code, out, _ = run("square_four", "--frames", 2, "--target-mm", 50, "--budget-ms", 1e6)
    assert code == 0
    for name in ("posit_coplanar", "homography", "solve_pose", *REFINED, "wrong", "square_four: 4 lamps"):
        assert name in out
    assert "recommended for 50 mm in 1e+06 ms: " in out
    code, out, _ = run("--frames", 2, "--rung", "rims", "--budget-ms", 1e-7)
    assert code == 1 and "no rung meets 1e-07 ms" in out


@pytest.mark.parametrize("name", ["ladder.png", "ladder.svg"])
def test_plots_are_pictures(run, name):
    code, _, err = run("--frames", 2, "--plot", name)
    assert code == 0, err
    if name.endswith("png"):
        assert occ.read_image(name).std() > 5
    else:
        assert "<svg" in Path(name).read_text()


def test_labels_do_not_overlap():
    """Labels do not overlap even for close rungs."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation, Text

    rows = [row_of(f"rung_{i}", 1e-5 * 1.25**i, 1e-3 * 1.02 ** (i % 4)) for i in range(12)]
    figure = Figure(figsize=(8.6, 5.2), dpi=150)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.1, 0.2, 0.88, 0.7))
    plot._frame(axes, rows)
    canvas.draw()
    plot._labels(axes, canvas.get_renderer(), rows)
    labels = [text for text in axes.texts if isinstance(text, Annotation)]
    assert len(labels) == len(rows)
    canvas.draw()
    boxes = [Text.get_window_extent(text, canvas.get_renderer()) for text in labels]
    for i, box in enumerate(boxes):
        assert not any(plot._area(box, other) > 2 for other in boxes[:i]), labels[i].get_text()


def test_measured_costs_can_be_used_by_locate(run):
    code, out, err = run("--frames", 1, "--rung", "rims", "--costs", "costs.yaml")
    assert code == 0 and "costs.yaml" in err, err
    table = occ.bench.RungCosts.load("costs.yaml")
    assert table.rims.per_rim_point_s > 0 and table.direct.per_pixel_s + table.direct.per_lamp_s > 0
    room = ["simulate", "irregular_six", "--position", 1.7, 2.1, 0.5, "--out", "room.png"]
    assert CliRunner().invoke(main, [str(a) for a in room]).exit_code == 0
    locate = ["locate", "room.png", "irregular_six", "--costs", "costs.yaml"]
    given = CliRunner().invoke(main, [*locate, "--budget-ms", "1e6"])
    assert given.exit_code == 0 and "rung      direct is the most accurate" in given.stdout
    given = CliRunner().invoke(main, [*locate, "--target-mm", "1e-6", "--json"])
    data = json.loads(given.stdout)
    assert given.exit_code == 1 and data["status"] == "budget_not_met"
    choice = data["choice"]
    assert choice["rung"] == "direct" and choice["met"] is False and choice["reason"] == data["message"]
    # Cheapest first, with costs measured on this machine.
    times = [f["predicted_s"] for f in choice["alternatives"]]
    assert times == sorted(times)
    assert {f["rung"] for f in choice["alternatives"]} == {"points", "centres", "rims", "direct"}


def test_costs_are_fitted_without_negative_ones():
    work = [np.array([1.0, lamps, points, 0]) for lamps in (3, 6) for points in (100, 300)]
    exact = [(w, 2e-6 * w[1] + 3e-7 * w[2]) for w in work]
    cost = costs._fitted(occ.Rung.rims, exact)
    assert (cost.fixed_s, cost.per_lamp_s, cost.per_rim_point_s) == pytest.approx((0, 2e-6, 3e-7), abs=1e-12)
    falling = [(w, 1e-4 - 1e-6 * w[1]) for w in work]
    assert costs._fitted(occ.Rung.points, falling).per_lamp_s == 0
    with pytest.raises(ValueError, match="direct"):
        costs._fitted(occ.Rung.direct, [])


def test_ctrl_c_keeps_finished_results(run, monkeypatch):
    image = Experiment.image

    def interrupted(self, frame, pose):
        if frame == 2:
            signal.raise_signal(signal.SIGINT)
        return image(self, frame, pose)

    monkeypatch.setattr(Experiment, "image", interrupted)
    code, out, _ = run("--frames", 50, "--rung", "rims", "--csv", "t.csv")
    assert code == 130 and "2 frames before Ctrl-C" in out and "rims" in out
    assert len(Path("t.csv").read_text().splitlines()) == 2


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("nosuch.yaml",), "nosuch.yaml"),
        (("text.yaml",), "text.yaml"),
        (("kookmin_one_lamp",), "three lamps or a rectangle"),
        (("--lamps", 2), "irregular_six.*three lamps or a rectangle, got 2"),
        (("--lamps", 7), "irregular_six.*6 lamps.*7"),
        (("--range", 0.5), "irregular_six.*0.5 m.*increase the range"),
        (("--rung", "nosuch"), "'nosuch' is not one of p3p, "),
        (("--rung", "homography"), "irregular_six.*no selected rung"),
        (("--plot", "plot.txt"), "plot.txt.*png"),
        (("--plot", "nowhere/p.png"), "nowhere/p.png"),
        (("--csv", "nowhere/t.csv"), "nowhere/t.csv"),
        (("--csv", "folder"), "folder"),
        (("--costs", "nowhere/c.yaml"), "nowhere/c.yaml"),
        (("--gain-dn-per-e", math.inf), "gain_dn_per_e"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(run, arguments, text):
    Path("text.yaml").write_text("not: a scene\n")
    Path("folder").mkdir()
    code, out, err = run("--frames", 1, *arguments)
    assert code == 2 and out == ""
    assert re.fullmatch(rf"error: .*{text}.*\n", err), err


@pytest.mark.parametrize("option", ["--frames", "--range", "--noise", "--min-time-us", "--target-mm"])
def test_numbers_out_of_range_are_rejected(run, option):
    code, out, err = run(option, 0)
    assert code == 2 and out == "" and option in err


def row_of(name, time_s, error_m, *, failures=0.0, outliers=0.0, peer=False):
    ratio = error_m / 1e-4
    return Row(
        name, "OpenCV" if peer else "libocc", "", 10, time_s, time_s, error_m, error_m, ratio, ratio,
        ratio, ratio, failures, outliers, peer,
    )


def test_advice_is_the_fastest_that_meets_the_target_within_the_budget():
    rows = [
        row_of("wrong_at_times", 1e-6, 1e-4, outliers=0.1), row_of("quick", 1e-5, 1e-2),
        row_of("foreign", 2e-5, 1e-4, peer=True), row_of("good", 1e-4, 1e-3), row_of("best", 1e-2, 1e-4),
    ]
    assert advice(rows, 5e-3, None).name == "good"
    assert advice(rows, 5e-4, None).name == "best"
    assert advice(rows, None, 1e-3).name == "good"
    assert advice(rows, 5e-2, 1e-3).name == "quick"
    assert advice(rows, 5e-4, 1e-3) is None and advice(rows, None, 1e-9) is None


def test_statistics_exclude_and_count_outliers():
    rung = measure.Rung("some", "libocc", "")
    rung.time_s, rung.answered = [1e-6] * 3 + [9e-6], [True, True, True, False]
    rung.error = [(1e-3, 1e-3), (1e-3, 1e-3), (1e-3, 1.0)]
    rung.bound = [(5e-4, 1e-3)] * 3
    rung.expected = rung.bound
    rung.all_pixels = [(2.5e-4, 5e-4)] * 3
    (row,) = rows_of(measure.Run([rung, measure.Rung("unsuited", "libocc", "")]))
    assert row.position_rmse_m == pytest.approx(1e-3) and row.rotation_rmse_rad == pytest.approx(1e-3)
    assert row.position_over_own == pytest.approx(2) and row.position_over_pixels == pytest.approx(4)
    assert row.outliers == 0.25 and row.failures == 0.25 and row.time_median_s == 1e-6
    assert not row.reliable and not row.pareto


def test_the_pareto_front_has_the_reliable_rungs():
    def rung(name, time_s, error_m, answered=10):
        made = measure.Rung(name, "libocc", "", time_s=[time_s] * 10)
        made.answered = [True] * answered + [False] * (10 - answered)
        made.error = [(error_m, 1e-3)] * answered
        made.bound = made.expected = made.all_pixels = [(error_m, 1e-3)] * answered
        return made

    rungs = [rung("a", 1e-6, 1e-2), rung("b", 2e-6, 2e-2), rung("c", 3e-6, 1e-3), rung("d", 2e-6, 1e-4, 5)]
    assert [row.name for row in rows_of(measure.Run(rungs)) if row.pareto] == ["a", "c"]


def test_views_have_the_given_tilt_and_show_every_lamp(scene):
    for tilt in (0, 10, 25):
        experiment = Experiment(scene, range_m=3.0, tilt_deg=tilt)
        pose = experiment.pose(4)
        centroid = np.mean([lamp.centre_m for lamp in scene.lamps], axis=0)
        seen = pose[:3, :3] @ centroid + pose[:3, 3]
        assert seen == pytest.approx([0, 0, 3.0], abs=1e-9)
        assert np.degrees(np.arccos(pose[2, 2])) == pytest.approx(tilt, abs=1e-5)
        assert not np.allclose(pose, experiment.pose(5))


def test_noise_scales_and_brightness_stays(scene, pose):
    def noise(sensor):
        lit = scene.replace(sensor=sensor)
        clean = occ.simulate(lit, pose, noise=False)[0].astype(float)
        noisy = occ.simulate(lit, pose)[0].astype(float) - clean
        return clean, noisy[clean > 0.9 * clean.max()].std()

    (clean, sigma), (same, larger) = noise(scene.sensor), noise(noisier(scene.sensor, 3))
    assert np.abs(clean - same).max() <= 1
    assert larger / sigma == pytest.approx(3, rel=0.1)


def test_a_file_is_complete_or_missing(tmp_path: Path):
    path = tmp_path / "a.txt"
    with whole_file(str(path)) as file:
        file.write(b"first")
    with pytest.raises(RuntimeError):
        with whole_file(str(path)) as file:
            file.write(b"half")
            raise RuntimeError
    assert path.read_bytes() == b"first" and [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_locate_explains_its_choice(scene, image):
    fix = occ.locate(image, scene)
    assert fix.choice.rung is occ.Rung.rims and fix.choice.met and "options" in fix.choice.reason
    assert fix.choice.predicted_sigma_m == pytest.approx(
        np.sqrt(np.trace(fix.position_covariance_m2)), rel=0.2
    )
    assert occ.locate(image, scene, budget_s=1e3).choice.rung is occ.Rung.direct
    late = occ.locate(image, scene, budget_s=1e-9)
    assert late.status is occ.Status.budget_not_met and late.choice.rung is occ.Rung.points
    dear = occ.bench.RungCosts(direct=occ.bench.RungCost(fixed_s=1e6))
    assert occ.locate(image, scene, budget_s=1e3, costs=dear).choice.rung is occ.Rung.rims
    assert occ.locate(image, scene, target_sigma_m=0.1).choice.rung is occ.Rung.points
    with pytest.raises(ValueError, match="budget_s must be positive, got 0"):
        occ.locate(image, scene, budget_s=0)
    with pytest.raises(ValueError, match="target_sigma_m"):
        occ.locate(image, scene, target_sigma_m=math.nan)


def test_costs_are_values_and_files(tmp_path: Path):
    table = occ.bench.RungCosts(rims=occ.bench.RungCost(per_rim_point_s=1e-6))
    table.save(tmp_path / "costs.yaml")
    loaded = occ.bench.RungCosts.load(tmp_path / "costs.yaml")
    evaluated = eval(repr(table), {**vars(occ), **vars(occ.bench)})
    assert repr(loaded) == repr(table) == repr(evaluated) != repr(occ.bench.RungCosts())
    with pytest.raises(FileNotFoundError):
        occ.bench.RungCosts.load(tmp_path / "nosuch.yaml")
    (tmp_path / "bad.yaml").write_text("schema: libocc-costs/1\npoints: 3\n")
    with pytest.raises(ValueError, match=r"bad\.yaml:2: points must be a mapping"):
        occ.bench.RungCosts.load(tmp_path / "bad.yaml")
    with pytest.raises(ValueError, match="costs.rims.fixed_s"):
        occ.bench.RungCosts(rims=occ.bench.RungCost(fixed_s=-1))


def test_pose_bound_of_points_and_scenes(scene, pose, image):
    points = np.array([lamp.centre_m for lamp in scene.lamps])
    one = occ.bench.pose_bound(points, scene.camera, pose, 0.1)
    assert one.ok and one.rank == 6 and one.lamps == 6 and one.covariance.shape == (6, 6)
    each = occ.bench.pose_bound(points, scene.camera, pose, [0.2] * 6)
    assert np.allclose(each.covariance, 4 * one.covariance)
    expected = occ.smoothing.position_covariance(pose, one.covariance)
    assert np.allclose(one.position_covariance_m2, expected)
    direct = occ.bench.pose_bound(scene, pose)
    rims = occ.bench.pose_bound(scene, pose, occ.Rung.rims)
    assert 0 < np.trace(direct.position_covariance_m2) < np.trace(rims.position_covariance_m2)
    fix = occ.locate(image, scene, rung=occ.Rung.direct)
    assert np.allclose(np.diag(fix.covariance), np.diag(direct.covariance), rtol=0.1)
    none = occ.bench.pose_bound(points[:2], scene.camera, pose, 0.1)
    assert none.status is occ.Status.too_few_lamps and none.rank == 4
    assert np.isinf(np.diag(none.covariance)).all()
    with pytest.raises(ValueError, match="sigma"):
        occ.bench.pose_bound(points, scene.camera, pose, -1)
