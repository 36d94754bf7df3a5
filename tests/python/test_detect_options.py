# SPDX-License-Identifier: Apache-2.0
"""Pictures in which more than lamps is bright: the hint, and the threshold that it suggests."""

import re
from collections.abc import Callable

import numpy as np
import pytest

import libocc as occ
from libocc.cli.detect_options import background_hint

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def speckled(libocc: Run) -> str:
    """Picture of six lamps with some thousand bright specks, all below 64."""
    assert libocc("simulate", "irregular_six", "--position", 1.7, 2.1, 0.5, "--out", "room.png")[0] == 0
    pixels = np.asarray(occ.read_image("room.png")).copy()
    random = np.random.default_rng(1)
    dark = np.kron(random.random((60, 80)) < 0.3, np.pad(np.ones((4, 4)), 2)) > 0
    pixels[dark & (pixels < 20)] = 50
    occ.write_image("room.png", pixels)
    return "room.png"


@pytest.mark.parametrize("command", [["locate", "room.png", "irregular_six"],
                                     ["identify", "room.png", "--map", "irregular_six"]])
def test_the_suggested_threshold_leaves_the_lamps(libocc: Run, speckled: str, command: list[str]) -> None:
    code, _, err = libocc(*command)
    assert code == 1 and "warning: room.png: " in err and "give --threshold-dn 64, or decrease the exposure" in err
    code, out, err = libocc(*command, "--threshold-dn", 64)
    assert code == 0 and err == "" and "ok" in out


def test_detect_warns(libocc: Run, speckled: str) -> None:
    assert "blobs were detected, probably parts of the lit ceiling" in libocc("detect", speckled)[2]
    assert libocc("detect", speckled, "--threshold-dn", 64)[2] == ""


def test_a_survey_names_the_pictures_with_the_hint(libocc: Run, speckled: str) -> None:
    code, _, err = libocc("calibrate", "lamps", speckled, speckled, "--map", "irregular_six", "--out", "out")
    assert code == 2 and "identified in 0 of 2 images" in err and "give --threshold-dn 64" in err


def test_hints_depend_on_number_and_area() -> None:
    pixels = np.full((400, 400), 10, np.uint8)
    for i in range(6):
        pixels[10 * i : 10 * i + 4, 10:14] = 200
    blobs = occ.detect(pixels)
    assert len(blobs) == 6 and background_hint(pixels, blobs, None) == ""
    assert background_hint(pixels, blobs, None, lamps=1) == ""
    assert background_hint(pixels, [*blobs, *blobs], None, lamps=1).startswith("12 blobs were detected, probably")
    assert "increase it" in background_hint(pixels, [*blobs, *blobs], 20, lamps=1)
    pixels[150:310, 100:250] = 200
    assert re.match(r"a blob of \d+ px was detected, prob", background_hint(pixels, occ.detect(pixels), None))
    wide = pixels.astype(np.uint16) * 257
    assert "--threshold-dn 16384" in background_hint(wide, occ.detect(wide), None)
