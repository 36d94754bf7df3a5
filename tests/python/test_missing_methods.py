# SPDX-License-Identifier: Apache-2.0
"""Commands in a build without OpenCV's or OpenGV's solvers."""

import pytest

from libocc import bench, pose
from libocc.cli import Failure
from libocc.cli.build import missing_note, require_in_build
from libocc.cli.commands import hard_cases, ladder

MISSING = {"ippe": "LIBOCC_OPENCV", "epnp": "LIBOCC_OPENGV", "sqpnp": "LIBOCC_OPENCV"}


def test_a_note_lists_the_methods_of_each_option():
    assert missing_note({}) == ""
    assert missing_note(MISSING) == (
        "not in this build, not used: ippe, sqpnp (LIBOCC_OPENCV=OFF)\n"
        "not in this build, not used: epnp (LIBOCC_OPENGV=OFF)\n"
    )


def test_a_wanted_method_that_is_missing_names_the_option():
    require_in_build("--solver", ["p3p", "nosuch"], MISSING)
    with pytest.raises(Failure, match="--solver: 'epnp' is not in this build .* -DLIBOCC_OPENGV=ON"):
        require_in_build("--solver", ["p3p", "epnp"], MISSING)


def test_missing_methods_have_an_option():
    for missing in (pose.missing_solvers(), bench.missing_ladder_steps()):
        assert set(missing.values()) <= {"LIBOCC_OPENCV", "LIBOCC_OPENGV"}
    assert not set(bench.missing_ladder_steps()) & {step.name for step in bench.ladder_steps()}


def test_commands_report_what_the_build_lacks(libocc, monkeypatch):
    monkeypatch.setattr(hard_cases, "missing_solvers", lambda: MISSING)
    monkeypatch.setattr(ladder, "missing_ladder_steps", lambda: {"AP3P": "LIBOCC_OPENCV"})
    few = ("hard-cases", "--case", "no_triangle", "--count", "1")
    code, _, err = libocc(*few)
    assert code == 0 and "epnp (LIBOCC_OPENGV=OFF)" in err
    code, _, err = libocc(*few, "--solver", "ippe")
    assert code == 2 and "'ippe' is not in this build" in err and "-DLIBOCC_OPENCV=ON" in err
    code, _, err = libocc("ladder", "--frames", 1, "--rung", "AP3P")
    assert code == 2 and "--rung: 'AP3P' is not in this build" in err
    code, _, err = libocc("ladder", "--frames", 1)
    assert code == 0 and "not used: AP3P (LIBOCC_OPENCV=OFF)" in err
