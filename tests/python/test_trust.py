# SPDX-License-Identifier: Apache-2.0
"""`libocc trust`: its families, its statistics, its files."""

import csv
import json
import math
import signal
import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import libocc as occ
from libocc.cli.trust import judge, measure
from libocc.cli.trust.binomial import interval
from libocc.cli.trust.families import FAMILIES, Family, Problem
from libocc.cli.trust.figures import coverage_of, family_row, risk_rows, too_often_wrong
from libocc.cli.trust.judge import Record, difference, is_wrong, solved
from libocc.cli.trust.plot import MAX_SIGMAS, sigmas_of

FAST = ("--family", "coplanar_four", "--family", "outliers", "--family", "one_dark", "--family", "junk")


def without_times(data):
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if not key.startswith("time_")}
    return [without_times(value) for value in data] if isinstance(data, list) else data


@pytest.fixture(scope="module")
def six():
    """Records of a small run of all families."""
    return measure.run(list(FAMILIES.values()), 4, 3, 2, lambda steps: None)


# Reference: exact values of the binomial distribution. 0 of n and n of n have closed forms.
@pytest.mark.parametrize("trials", [1, 10, 1000])
def test_interval_without_hits_and_with_all(trials):
    high = 1 - 0.025 ** (1 / trials)
    assert interval(0, trials) == (0, pytest.approx(high, rel=1e-9))
    assert interval(trials, trials) == (pytest.approx(1 - high, rel=1e-9), 1)
    assert interval(0, 0) == (0, 1)


@pytest.mark.parametrize(("hits", "trials"), [(1, 10), (7, 9), (30, 100), (999, 1000)])
def test_each_tail_of_an_interval_has_half_of_the_rest(hits, trials):
    low, high = interval(hits, trials)

    def probability(counts, p):
        return sum(math.comb(trials, k) * p**k * (1 - p) ** (trials - k) for k in counts)

    assert probability(range(hits, trials + 1), low) == pytest.approx(0.025, rel=1e-6)
    assert probability(range(hits + 1), high) == pytest.approx(0.025, rel=1e-6)
    narrow = interval(hits, trials, 0.5)
    assert low < narrow[0] < hits / trials < narrow[1] < high


def test_interval_refuses_impossible_counts():
    with pytest.raises(ValueError, match="between 0 and 3, got 4"):
        interval(4, 3)


def candidate_at(pose, delta, sigmas):
    """Candidate whose pose is `pose` perturbed by -delta, so that the truth is `delta` away from it."""
    angle = np.linalg.norm(delta[:3])
    axis = delta[:3] / angle if angle else np.zeros(3)
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    found = np.eye(4)
    found[:3, :3] = turn.T @ pose[:3, :3]
    found[:3, 3] = turn.T @ (pose[:3, 3] - delta[3:])
    return SimpleNamespace(
        cam_from_world=found, position_m=-found[:3, :3].T @ found[:3, 3], covariance=np.diag(np.square(sigmas)),
        position_covariance_m2=np.eye(3),
    )


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 3.0, np.pi])
def test_difference_inverts_a_perturbation(pose, angle):
    delta = np.array([0, 0.6 * angle, 0.8 * angle, 0.1, -0.2, 0.3])
    found = candidate_at(pose, delta, np.ones(6))
    got = difference(pose, found.cam_from_world)
    if angle == np.pi and got[2] < 0:  # half a turn has two equal vectors
        got[:3] *= -1
    assert got == pytest.approx(delta, abs=1e-7)
    assert judge.chi2_of(found, pose) == pytest.approx(delta @ delta, rel=1e-6)


def test_a_pose_is_wrong_only_if_it_is_far_and_outside_its_covariance(pose):
    small, large = np.full(6, 1e-3), np.full(6, 1.0)
    far, turned = np.array([0, 0, 0, 0.2, 0, 0]), np.array([0, 0, 0.2, 0, 0, 0])
    for delta in (far, turned):
        assert is_wrong(candidate_at(pose, delta, small), pose)
        assert not is_wrong(candidate_at(pose, delta, large), pose)
        assert not is_wrong(candidate_at(pose, 0.05 * delta, small / 1e3), pose), "a right pose with small sigmas"
    unknown = candidate_at(pose, far, np.full(6, np.inf))
    assert not is_wrong(unknown, pose) and judge.chi2_of(unknown, pose) == 0


def record(status="ok", **fields):
    return Record(status, 1e-3, **fields)


def test_risk_rows_count_ambiguous_fixes_and_nothing_else():
    records = [
        record(risk=1e-9, wrong=False), record(risk=3e-3, wrong=True), record("ambiguous", risk=0.5, wrong=True),
        record("no_pose", risk=1e-9, wrong=True), record("no_pose", risk=1.0), record(wrong=True),
    ]
    rows = {row.max_risk: row for row in risk_rows(records)}
    assert [(row.wrong.hits, row.wrong.trials) for row in rows.values()] == [(0, 1)] * 6 + [(1, 2)] * 2 + [(2, 3)]
    assert min(rows) == 1e-8 and rows[1.0].mean_risk == pytest.approx((1e-9 + 3e-3 + 0.5) / 3)
    assert risk_rows([record(wrong=True)]) == ()


def test_coverage_counts_each_axis_and_all_six():
    rows = coverage_of([record(chi2=1.0, z=(0.5, -1.5, 2.5)), record(chi2=19.0, z=(0.0, 0.0, -3.5))])
    hits = {(row.by, row.sigmas): row.inside.hits for row in rows}
    assert [hits["chi2", k] for k in (1, 2, 3)] == [1, 1, 2]
    assert [hits[axis, k] for axis in "xyz" for k in (1, 2, 3)] == [2, 2, 2, 1, 2, 2, 0, 0, 1]
    assert coverage_of([record()]) == ()


def test_a_family_is_faulty_if_its_wrong_fixes_are_significant():
    family = FAMILIES["junk"]
    wrong, right = record(wrong=True), record(wrong=False)
    assert too_often_wrong([family_row(family, [wrong, *[right] * 99])]) == ["junk"]
    assert too_often_wrong([family_row(family, [wrong, *[right] * 999])]) == []
    assert too_often_wrong([family_row(family, [])]) == []


def test_sigmas_of_a_share():
    assert [sigmas_of(p) for p in (0, 0.6826895, 1)] == pytest.approx([0, 1, MAX_SIGMAS], abs=1e-6)


def test_max_risk_changes_the_status_only():
    """The curve may read the risks of ambiguous fixes: with max_risk = 1 the same poses are ok."""
    scene = occ.Scene.load(Path(__file__).parents[2] / "data" / "scenes" / "square_four.yaml")
    image, _ = occ.simulate(scene, occ.look_at([1.9, 2.05, 0.15], [2, 2, 3], up=[0, 1, 0]), seed=1)
    strict, lax = occ.locate(image, scene), occ.locate(image, scene, max_risk=1.0)
    assert (strict.status.name, lax.status.name) == ("ambiguous", "ok")
    assert strict.risk == lax.risk and (strict.cam_from_world == lax.cam_from_world).all()


def test_a_wrong_pose_of_an_image_without_lamps_counts(monkeypatch):
    answer = SimpleNamespace(status=occ.Status.ok, risk=1e-6, candidates=[SimpleNamespace()])
    assert solved(Problem(lambda: answer, None)).wrong is True
    answer.candidates = []
    assert solved(Problem(lambda: answer, None)).wrong is None


@pytest.mark.parametrize("name", FAMILIES)
def test_every_family_is_solved(six, name):
    records = six.records[name]
    assert len(records) == 4 and all(r.time_s >= 0 for r in records)
    if name == "junk":
        assert not any(r.status == "ok" for r in records)
    else:
        assert any(r.chi2 is not None for r in records)
    if name not in ("coplanar_four", "outliers"):
        assert all(r.risk is not None for r in records)


def test_poses_of_six_lamps_are_right(six):
    assert all(r.status == "ok" and r.wrong is False and r.chi2 < 40 for r in six.records["six_lamps"])


def test_figures_depend_on_the_seed_only(libocc):
    def figures(*arguments):
        code, out, err = libocc("trust", *FAST, "--count", 6, "--json", *arguments)
        assert code in (0, 1), err
        return without_times(json.loads(out))

    first = figures("--seed", 5, "--threads", 1)
    assert first == figures("--seed", 5, "--threads", 3) != figures("--seed", 6)
    alone = libocc("trust", "--family", "junk", "--count", 6, "--json", "--seed", 5)[1]
    assert without_times(json.loads(alone))["families"] == [f for f in first["families"] if f["family"] == "junk"]


def test_text_and_files(libocc):
    code, out, err = libocc("trust", *FAST, "--count", 8, "--out", "result")
    assert code == 0, err
    assert "0 of" in out and "coplanar_four" in out and "risk up to" in out
    files = sorted(path.name for path in Path("result").iterdir())
    assert files == ["families.csv", "risk.csv", "trust.json", "trust.png"]
    assert occ.read_image("result/trust.png").std() > 5
    data = json.loads(Path("result/trust.json").read_text())
    with open("result/families.csv", newline="") as file:
        table = list(csv.DictReader(file))
    for family, row in zip(data["families"], table, strict=True):
        assert row["family"] == family["family"] and int(row["ok"]) == family["ok"]
        assert family["problems"] == family["ok"] + family["ambiguous"] + family["no_pose"] + family["other"] == 8


def test_bad_input(libocc):
    code, _, err = libocc("trust", "--family", "sofa")
    assert code == 2 and "'sofa' is not one of six_lamps" in err
    Path("file").write_text("")
    code, _, err = libocc("trust", "--family", "junk", "--count", 1, "--out", "file")
    assert code == 2 and "file" in err


def test_wrong_fixes_give_exit_code_1(libocc, monkeypatch):
    answer = SimpleNamespace(status=occ.Status.ok, risk=1e-6, candidates=[SimpleNamespace()])
    faulty = Family("faulty", "faulty", "a wrong pose for no lamp", lambda *_: Problem(lambda: answer, None))
    monkeypatch.setitem(FAMILIES, "faulty", faulty)
    code, out, _ = libocc("trust", "--family", "faulty", "--count", 5)
    assert code == 1 and "5 of 5 fixes that are ok are wrong; significantly more than 1e-4: faulty" in out


def test_an_error_of_a_problem_is_raised(libocc, monkeypatch):
    def build(*_):
        raise ValueError("no such lamp")

    monkeypatch.setitem(FAMILIES, "broken", Family("broken", "broken", "", build))
    code, _, err = libocc("trust", "--family", "broken", "--count", 3, "--threads", 2)
    assert code == 2 and "no such lamp" in err


def test_an_interrupt_keeps_the_solved_problems(libocc, monkeypatch):
    answer = SimpleNamespace(status=occ.Status.no_pose, risk=1.0, candidates=[])

    def build(number, _):
        if number == 3:
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            threading.Event().wait(0.3)  # the run ends before the next problem
        return Problem(lambda: answer, None)

    monkeypatch.setitem(FAMILIES, "stopped", Family("stopped", "stopped", "", build))
    run = ("trust", "--family", "stopped", "--count", 1000, "--threads", 1, "--out", "kept", "--json")
    code, out, _ = libocc(*run)
    data = json.loads(out)
    assert code == 130 and data["interrupted"] and 4 <= data["families"][0]["problems"] < 1000
    assert json.loads(Path("kept/trust.json").read_text()) == data
    assert occ.read_image("kept/trust.png").std() > 1


@pytest.mark.slow
def test_verdicts_of_many_problems():
    """No fix that is ok is wrong, and risks are honest (docs/results/how_sure_is_it.md)."""
    families = list(FAMILIES.values())
    result = measure.run(families, 300, 11, 2, lambda steps: None)
    rows = [family_row(family, result.records[family.name]) for family in families]
    assert too_often_wrong(rows) == []
    for risk in risk_rows([record for records in result.records.values() for record in records]):
        assert risk.wrong.band[0] <= risk.max_risk
    for row in rows:
        for item in row.coverage:
            assert item.sigmas > 1 or item.inside.band[0] < 0.75 and item.inside.band[1] > 0.6, (row.family.name, item)
