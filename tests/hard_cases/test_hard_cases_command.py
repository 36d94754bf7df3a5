# SPDX-License-Identifier: Apache-2.0
"""`libocc hard-cases`: what it prints, writes and returns."""

import csv
import importlib.util
import json
import re

import numpy as np
import pytest
from problems import CASES

import libocc as occ
from libocc.cli.commands import hard_cases as module
from libocc.cli.hard_cases.cases import read_case
from libocc.cli.hard_cases.methods import Method, peer_methods

FEW = ("--case", "no_triangle", "--case", "ceiling_triple_tilted", "--count", "2")


@pytest.fixture
def run(libocc):
    return lambda *arguments: libocc("hard-cases", *arguments)


def test_table_has_cases_solvers_and_signs(run):
    code, out, _ = run(*FEW)
    assert code == 0
    for pattern in (r"^ *ceiling_triple_tilted +●", r"^ *no_triangle +○"):
        assert re.search(pattern, out, re.M)
    assert "libocc: 1 auto, 2 " in out and "× wrong pose without warning" in out
    assert "auto and p3p: a correct answer or a justified refusal in all of 8 problems" in out


def test_json_and_csv_have_every_count(run, tmp_path):
    code, out, _ = run(*FEW, "--solver", "p3p", "--json", "--csv", "cells.csv")
    cells = json.loads(out)
    assert code == 0 and {c["case"] for c in cells} == {"no_triangle", "ceiling_triple_tilted"}
    solved = next(c for c in cells if c["case"] == "ceiling_triple_tilted")
    assert solved["solved"] == solved["problems"] == solved["right"] == 2 and solved["wrong"] == 0
    assert 0 <= solved["error_over_allowed"] < 1
    rows = list(csv.DictReader((tmp_path / "cells.csv").open()))
    assert [row["case"] for row in rows] == [c["case"] for c in cells] and rows[0]["problems"] == "2"


def test_sweep_shows_each_value(run):
    _, out, _ = run("--case", "world_offset_three", "--count", "1", "--solver", "p3p", "--sweep")
    assert len(re.findall(r"world_offset_three offset_m=1", out)) == 4


def test_plot_is_a_picture(run, tmp_path):
    code, _, _ = run(*FEW, "--plot", "matrix.png")
    pixels = occ.read_image(tmp_path / "matrix.png")
    assert code == 0 and pixels.ndim == 3 and min(pixels.shape[:2]) > 150 and pixels.std() > 5


def test_peers_are_run_or_reported_as_missing(run):
    code, out, err = run(*FEW, "--peers")
    assert code == 0
    for package, module_name, family in (
        ("opencv-python-headless", "cv2", "OpenCV"), ("poselib", "poselib", "PoseLib")
    ):
        there = importlib.util.find_spec(module_name) is not None
        assert (family in out) == there
        assert (f"not installed, not used: {package}" in err) == (not there)


def test_peers_that_are_not_installed_are_named(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr("libocc.cli.hard_cases.methods.importlib.import_module", missing)
    assert peer_methods() == ([], ["opencv-python-headless", "poselib"])


@pytest.mark.parametrize("answer", [np.eye(4), np.full((4, 4), np.nan)])
def test_a_harmful_own_solver_ends_in_exit_code_1(run, monkeypatch, answer):
    monkeypatch.setattr(module, "own_methods", lambda: [Method("p3p", "libocc", lambda instance: [answer])])
    code, out, _ = run(*FEW)
    assert code == 1
    assert "a wrong answer without warning: p3p on ceiling_triple_tilted; p3p on no_triangle" in out


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--case", "nowhere"), "--case: 'nowhere' is not one of bad_numbers_six, "),
        (("--solver", "magic"), "--solver: 'magic' is not one of auto, "),
        (("--solver", "p3p", "--case", "cube_face_on"), "accepts the number of points"),
        ((*FEW, "--plot", "no/folder/matrix.png"), "no/folder/matrix.png"),
        ((*FEW, "--plot", "matrix.nothing"), "matrix.nothing"),
        ((*FEW, "--csv", "no/folder/cells.csv"), "no/folder/cells.csv"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(run, arguments, message):
    code, _, err = run(*arguments)
    assert code == 2 and err.startswith("error: ") and message in err and err.count("\n") == 1


def test_a_bad_file_in_the_catalogue_is_named(run, tmp_path, monkeypatch):
    path = tmp_path / "odd.yaml"
    path.write_text("schema: 1\n")
    monkeypatch.setattr(module, "catalogue", lambda: [read_case(path)])
    code, _, err = run()
    assert code == 2 and "odd.yaml: title: is missing" in err


def test_every_case_is_named_in_the_table(run):
    _, out, _ = run("--count", "1", "--solver", "auto")
    assert [name for name in CASES if name not in out] == []
