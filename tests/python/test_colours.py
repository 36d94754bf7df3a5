# SPDX-License-Identifier: Apache-2.0
"""Colours of lamps in Python and on the command line."""

import json
from pathlib import Path

import numpy as np
import pytest

import libocc as occ

GREEN = [0.05, 1, 0.6]
STORED = np.array([20, 200, 130])  # of the green lamp, in sRGB
LIGHT = ((STORED / 255 + 0.055) / 1.055) ** 2.4


@pytest.fixture
def picture() -> np.ndarray:
    """A green lamp that touches a white one."""
    image = np.full((120, 200, 3), 10, np.uint8)
    image[30:90, 20:80] = 230
    image[50:70, 80:110] = STORED
    return image


def test_a_blob_has_the_colour_of_its_light(picture):
    (blob,) = occ.detect(picture, colours=[GREEN])
    assert blob.centroid_px == pytest.approx([94.5, 59.5], abs=0.1)
    assert isinstance(blob.colour, occ.rendering.BlobColour)
    assert blob.colour.share == pytest.approx(LIGHT / LIGHT.sum(), abs=0.01)
    assert blob.colour.clipped == [False, False, False]
    assert len(occ.detect(picture)) == 1 and occ.detect(picture)[0].x0 == 20
    assert occ.detect(picture[..., 1], colours=[GREEN])[0].colour is None
    linear = occ.Sensor(response=occ.Response.linear, black_level_dn=10)
    (blob,) = occ.detect(picture, sensor=linear, colours=[GREEN])
    assert blob.colour.share == pytest.approx((STORED - 10) / (STORED - 10).sum(), abs=0.01)


def test_red_and_blue_are_not_exchanged(tmp_path: Path):
    image = np.full((100, 100, 3), 10, np.uint8)
    image[40:60, 40:60] = [220, 30, 30]
    occ.write_image(tmp_path / "red.png", image)
    again = occ.read_image(tmp_path / "red.png")
    assert occ.detect(again, colours=[[1, 0.1, 0.1]])[0].colour.share[0] > 0.8
    assert occ.detect(again, colours=[[0.1, 0.1, 1]]) == []


def test_invalid_colours_are_named(picture):
    with pytest.raises(ValueError, match=r"colours\[1\] must be three numbers, zero or positive.*got \[0, 0, 0\]"):
        occ.detect(picture, colours=[GREEN, [0, 0, 0]])
    with pytest.raises(ValueError, match="lamp 3: colour_sigma must be positive"):
        occ.Lamp(id=3, centre_m=[0, 0, 3], radius_m=0.1, colour_sigma=0)


def test_commands_use_the_colours_of_the_scene(picture, tmp_path: Path, libocc):
    camera = occ.Camera.pinhole(width=200, height=120, fx_px=150, fy_px=150, cx_px=99.5, cy_px=59.5)
    lamps = [occ.Lamp(id=i, centre_m=[i, i % 2, 3], radius_m=0.1, colour=GREEN) for i in range(4)]
    occ.Scene(camera=camera, lamps=lamps).save(tmp_path / "green.yaml")
    occ.write_image(tmp_path / "picture.png", picture)
    code, out, _ = libocc("detect", tmp_path / "picture.png", "--scene", tmp_path / "green.yaml", "--json")
    assert code == 0
    (blob,) = json.loads(out)
    assert blob["box_px"] == [80, 50, 109, 69]
    assert blob["colour"]["share"] == pytest.approx(LIGHT / LIGHT.sum(), abs=0.01)
    without = json.loads(libocc("detect", tmp_path / "picture.png", "--json")[1])
    assert without[0]["box_px"][0] == 20
