# SPDX-License-Identifier: Apache-2.0
"""The catalogue's files: complete, read strictly, and the same problems every time."""

import inspect
from pathlib import Path

import numpy as np
import pytest
from problems import CASES, problems

from libocc.cli.hard_cases.cases import FOLDER, GENERATORS, KINDS, catalogue, read_case
from libocc.cli.hard_cases.instances import instances
from libocc.cli.hard_cases.judge import Outcome

SOURCE = Path(__file__).resolve().parents[2] / "data" / "hard_cases"

GOOD = (FOLDER / "danger_cylinder.yaml").read_text()


def test_every_generator_is_used_and_documented():
    assert {case.generator for case in CASES.values()} == set(GENERATORS)
    text = (SOURCE / "README.md").read_text()
    for name, generator in GENERATORS.items():
        line = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        for parameter in list(inspect.signature(generator).parameters)[2:]:
            assert f"`{parameter}`" in line, (name, parameter)


def test_the_readme_lists_every_key_and_outcome():
    text = (SOURCE / "README.md").read_text()
    assert [key for key in (*KINDS, "schema") if f"`{key}`" not in text] == []
    assert [outcome.name for outcome in Outcome if f"| {outcome.name} |" not in text] == []


def test_the_installed_catalogue_is_that_of_the_source():
    assert {p.name: p.read_text() for p in FOLDER.glob("*.yaml")} == {
        p.name: p.read_text() for p in SOURCE.glob("*.yaml")
    }


def test_the_catalogue_has_every_kind():
    wanted = """ceiling_triple_tilted ceiling_square_level ceiling_triple_on_axis ceiling_square_under_lamp
        ceiling_square_symmetry_plane equilateral_on_axis isosceles_on_axis danger_cylinder
        danger_cylinder_mate near_collinear collinear_three camera_in_plane_three weak_perspective_four
        world_offset_three scene_scale_six telephoto_three grazing_three half_turn_axis_three
        half_turn_any_three identity_three behind_camera_three depth_range_three near_planar
        duplicates_three no_triangle bad_numbers_three two_points no_points cube_face_on"""
    assert set(wanted.split()) <= set(CASES)
    assert [float(v) for v in CASES["danger_cylinder"].sweep["aside"]] == [0, 1e-9, 1e-6, 1e-3]


@pytest.mark.parametrize(
    "change, message",
    [
        (("verdict: solved", "verdict: perhaps"), "verdict: 'perhaps' is not one of either, error"),
        (("points: 3", "points: three"), "points: 'three' is not a int"),
        (("points: 3", "points: -3"), "points: -3 must not be negative"),
        (("count: 20", "count: 0"), "count: 0 must be at least 1"),
        (("seed:", "sed: 1\nseed:"), "key: 'sed' is not one of count, "),
        (("seed:", "seed: 1\nseed:"), "key 'seed' is given twice"),
        (("title:", "heading:"), "title: is missing"),
        (("/1", "/2"), "schema: 'libocc-hard-case/2' is not 'libocc-hard-case/1'"),
        (("generator: danger_cylinder", "generator: magic"), "generator: 'magic' is not one of bad_input, "),
        (("aside:", "beside:"), "sweep of danger_cylinder: 'beside' is not one of aside"),
        (("[0, 1e-9, 1e-6, 1e-3]", "1e-3"), "sweep: aside: 0.001 is not a list of values"),
        (("verdict: solved", "verdict: either"), "reason: is missing"),
        (("points: 3", "points: [3"), "is not valid YAML: "),
        (("points: 3", "points: 3\nparameters: {tilt: 1}"), "parameters of danger_cylinder: 'tilt' is not"),
    ],
)
def test_errors_of_a_bad_file_name_file_key_and_value(tmp_path, change, message):
    path = tmp_path / "bad.yaml"
    assert change[0] in GOOD
    path.write_text(GOOD.replace(*change, 1))
    with pytest.raises(ValueError) as refused:
        read_case(path)
    assert str(refused.value).startswith(f"{path}: ") and message in str(refused.value)


def test_no_mapping_no_file_no_folder(tmp_path):
    (tmp_path / "list.yaml").write_text("- 1\n")
    with pytest.raises(ValueError, match="must be a mapping"):
        read_case(tmp_path / "list.yaml")
    with pytest.raises(OSError):
        read_case(tmp_path / "missing.yaml")
    with pytest.raises(OSError, match="contains no hard cases"):
        catalogue(tmp_path / "empty")


def test_the_same_problems_every_time_and_more_of_them_first():
    case = CASES["ceiling_triple_tilted"]
    few, many = (list(instances(case, case.parameters, n)) for n in (3, 5))
    for a, b in zip(few, many):
        assert np.array_equal(a.bearings, b.bearings) and np.array_equal(a.points, b.points)
    assert not np.array_equal(many[3].points, many[4].points)


@pytest.mark.parametrize("name", [n for n, c in CASES.items() if c.verdict == "solved"])
def test_a_solvable_problem_has_a_tolerance(name):
    for _, of_row in problems(name, 3):
        for instance in of_row:
            assert instance.truth is not None
            assert 0 < instance.truth.allowed(CASES[name].tolerance_factor) < 1e-5
            from_nominal = instance.truth.error(instance.nominal, long_mean(instance.points))
            assert (from_nominal < 1e-5) == (CASES[name].truth == "view")
            assert np.abs(np.linalg.norm(instance.bearings, axis=1) - 1).max() < 4e-16


def long_mean(points):
    return points.astype(np.longdouble).mean(0)


def test_generators_reject_unknown_words():
    rng = np.random.default_rng(0)
    for name, key in (("ceiling", "where"), ("cloud", "rotation"), ("bad_input", "kind")):
        with pytest.raises(ValueError, match="must be .*, got nowhere"):
            GENERATORS[name](rng, 3, **{key: "nowhere"})
