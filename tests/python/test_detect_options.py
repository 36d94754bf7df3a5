# SPDX-License-Identifier: Apache-2.0
"""Pictures in which more than lamps is bright: the hint, and the threshold that it suggests."""

import json
import re
from collections.abc import Callable

import numpy as np
import pytest

import libocc as occ
from libocc.cli.detect_options import background_hint, threshold_above_ceiling

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def speckled(libocc: Run) -> str:
    """Picture of six lamps with some thousand bright specks, all below 64."""
    assert libocc("simulate", "irregular_six", "--position", 1.7, 2.1, 0.5, "--out", "room.png")[0] == 0
    pixels = np.asarray(occ.read_image("room.png")).copy()
    random = np.random.default_rng(1)
    dark = np.kron(random.random((60, 80)) < 0.45, np.pad(np.ones((4, 4)), 2)) > 0
    pixels[dark & (pixels < 20)] = 40
    occ.write_image("room.png", pixels)
    return "room.png"


def test_locate_finds_the_lamps_among_specks(libocc: Run, speckled: str) -> None:
    code, out, _ = libocc("locate", speckled, "irregular_six", "--json")
    fix = json.loads(out)
    assert code == 0 and fix["risk"] < 1e-6
    assert np.abs(np.array(fix["position_m"]) - [1.7, 2.1, 0.5]).max() < 2e-3


def test_the_suggested_threshold_leaves_the_lamps(libocc: Run, speckled: str) -> None:
    command = ["identify", speckled, "--map", "irregular_six"]
    code, _, err = libocc(*command)
    assert code == 1 and "warning: room.png: " in err and "give --threshold-dn auto (here 62), or expose less" in err
    for threshold in ("auto", 64):
        code, out, err = libocc(*command, "--threshold-dn", threshold)
        assert code == 0 and err == "" and "ok" in out


def test_detect_warns(libocc: Run, speckled: str) -> None:
    assert "blobs were detected; if the ceiling is bright" in libocc("detect", speckled)[2]
    assert libocc("detect", speckled, "--threshold-dn", "auto")[2] == ""


def test_a_survey_names_the_pictures_with_the_hint(libocc: Run, speckled: str) -> None:
    code, _, err = libocc("calibrate", "lamps", speckled, speckled, "--map", "irregular_six", "--out", "out")
    assert code == 2 and "identified in 0 of 2 images" in err and "give --threshold-dn auto" in err


def test_hints_depend_on_number_and_area() -> None:
    pixels = np.full((400, 400), 10, np.uint8)
    for i in range(6):
        pixels[10 * i : 10 * i + 4, 10:14] = 200
    blobs = occ.detect(pixels)
    assert len(blobs) == 6 and background_hint(pixels, blobs, None) == ""
    assert background_hint(pixels, blobs, None, lamps=6) == ""
    assert background_hint(pixels, [*blobs, *blobs], None, lamps=6).startswith("12 blobs were detected for 6 lamps;")
    assert "with --threshold-dn 20; try another" in background_hint(pixels, blobs, 20, lamps=1)
    pixels[150:310, 100:250] = 200
    assert re.match(r"a blob of \d+ px was detected; if", background_hint(pixels, occ.detect(pixels), None))


def test_the_automatic_threshold_lies_between_ceiling_and_lamps() -> None:
    pixels = np.full((100, 100), 120, np.uint8)
    pixels[20:30, 20:60] = 240  # four parts in a hundred
    assert threshold_above_ceiling(pixels) == pytest.approx(144)
    assert threshold_above_ceiling(np.dstack([pixels] * 3).astype(np.uint16) * 257) == pytest.approx(144 * 257)
    with_alpha = np.dstack([pixels, pixels, pixels, np.full_like(pixels, 255)])
    assert threshold_above_ceiling(with_alpha) == pytest.approx(144)


@pytest.mark.parametrize("value", ["nan", "inf", "bright"])
def test_a_wrong_threshold_is_an_error(libocc: Run, value: str) -> None:
    code, _, err = libocc("locate", "irregular_six_1", "irregular_six", "--threshold-dn", value)
    assert code == 2 and f"--threshold-dn: must be a number or auto, got '{value}'" in err
