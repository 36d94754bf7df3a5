# SPDX-License-Identifier: Apache-2.0
"""Measured emission of lamps in Python: reading, lamps, scenes, pickling, errors."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import libocc as occ
from libocc.cli.sweep.plan import read_sweep, scene_and_pose
from libocc.photometry import EmissionProfile, OpeningShape, PhotometricDistribution

CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
POSE = occ.look_at(position_m=[1.2, 2.5, 0.5], target_m=[2, 2, 3], up=[0, 1, 0])


def cosine_file(folder: Path, order: float, opening: str = "-0.2 -0.2 0") -> Path:
    gamma_deg = np.arange(0, 90.1, 2.5)
    candela = 1000 * np.cos(np.radians(gamma_deg)).clip(0) ** order
    lines = ["IESNA:LM-63-2002", "[TEST] cosine", "TILT=NONE", f"1 3000 1 {len(gamma_deg)} 1 1 2 {opening}", "1 1 30"]
    lines += [" ".join(f"{x:.9g}" for x in row) for row in (gamma_deg, [0], candela)]
    path = folder / "lamp.ies"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_file_becomes_a_distribution_with_arrays(tmp_path):
    path = cosine_file(tmp_path, 1)
    read = occ.read_photometry(path)
    assert isinstance(read, PhotometricDistribution)
    assert read.vertical_rad.shape == (37,) and read.horizontal_rad.tolist() == [0]
    assert read.intensities_cd.shape == (37, 1) and read.intensities_cd[0, 0] == 1000
    assert read.flux_lm() == pytest.approx(1000 * np.pi, rel=1e-3)
    assert (read.file, read.source_format, read.lamp_lm, read.input_w) == (str(path), "LM-63-2002", 3000, 30)
    assert read.keywords == [("TEST", "cosine")]
    assert read.opening is OpeningShape.ellipse and read.size_m.tolist() == [0.2, 0.2]


def test_a_lamp_takes_a_path_a_distribution_or_a_profile(tmp_path):
    path = cosine_file(tmp_path, 2)
    for given in (path, str(path), occ.read_photometry(path), EmissionProfile(path)):
        lamp = occ.Lamp(id=0, centre_m=[2, 2, 3], photometry=given)
        assert lamp.shape is occ.LampShape.disc and lamp.radius_m == pytest.approx(0.1)
        assert isinstance(lamp.photometry, EmissionProfile)
        assert lamp.photometry.equivalent_order == pytest.approx(2, abs=0.02)
        assert not lamp.photometry.depends_on_c
    assert lamp.replace(photometry=None).photometry is None
    assert occ.Lamp(id=0, centre_m=[2, 2, 3], radius_m=0.3, photometry=path).radius_m == 0.3


def test_the_power_is_that_of_a_lambertian_lamp(tmp_path):
    lamp = occ.Lamp(id=0, centre_m=[2, 2, 3], power_w=5, photometry=cosine_file(tmp_path, 1.7))
    half_power_rad = float(np.arccos(2 ** (-1 / 1.7)))
    lambertian = occ.Lamp(id=0, centre_m=[2, 2, 3], power_w=5, radius_m=0.1, half_power_rad=half_power_rad)
    powers = [
        float(occ.received_power(occ.Scene(camera=CAMERA, lamps=[one]), POSE).power_w) for one in (lamp, lambertian)
    ]
    assert powers[0] == pytest.approx(powers[1], rel=1e-3)


def test_density_takes_one_direction_or_many(tmp_path):
    profile = EmissionProfile(cosine_file(tmp_path, 1))
    directions = np.array([[0, 0, 1], [1, 0, 1], [0, -2, 2], [0, 0, -1], [1, 0, 0]])
    expected = np.array([1, 0.5**0.5, 0.5**0.5, 0, 0]) / np.pi
    assert profile.density(directions) == pytest.approx(expected, rel=1e-3)
    assert profile.density([0, 0, 1]) == pytest.approx(1 / np.pi, rel=1e-3)
    with pytest.raises(ValueError, match=r"directions must be of shape \(3,\) or \(n, 3\), got \(2,\)"):
        profile.density([0, 1])


def test_a_distribution_can_be_made_of_arrays():
    gamma = np.radians(np.arange(0, 91, 5))
    made = PhotometricDistribution(
        vertical_rad=gamma, horizontal_rad=[0], intensities_cd=np.cos(gamma).clip(0)[:, None]
    )
    lamp = occ.Lamp(id=4, centre_m=[0, 0, 3], radius_m=0.1, photometry=made)
    assert lamp.photometry.distribution.intensities_cd.shape == (19, 1)
    with pytest.raises(ValueError, match="lamp 4: photometry must be from a file"):
        occ.Scene(camera=CAMERA, lamps=[lamp]).format()
    with pytest.raises(ValueError, match=r"intensities_cd must be 19 x 1, got 2 x 1"):
        made.replace(intensities_cd=np.ones((2, 1)))


def test_a_scene_keeps_the_file(tmp_path):
    lamp = occ.Lamp(id=0, centre_m=[2, 2, 3], photometry=cosine_file(tmp_path, 1))
    scene = occ.Scene(camera=CAMERA, lamps=[lamp])
    (tmp_path / "scenes").mkdir()
    scene.save(tmp_path / "scenes" / "room.yaml")
    assert 'photometry: {file: "../lamp.ies"}' in (tmp_path / "scenes" / "room.yaml").read_text()
    loaded = occ.Scene.load(tmp_path / "scenes" / "room.yaml")
    assert loaded.lamps[0].photometry.density([0, 1, 1]) == lamp.photometry.density([0, 1, 1])


def test_a_sweep_finds_the_file_beside_the_scene(tmp_path):
    cosine_file(tmp_path, 1)
    scene = occ.Scene(camera=CAMERA, lamps=[occ.Lamp(id=0, centre_m=[2, 2, 3], photometry=tmp_path / "lamp.ies")])
    scene.save(tmp_path / "room.yaml")
    assert '{file: "lamp.ies"}' in (tmp_path / "room.yaml").read_text()
    (tmp_path / "sweep.yaml").write_text(
        "schema: libocc-sweep/1\nscene: room.yaml\npose: {position_m: [2, 2, 0.5]}\n"
        "parameters: {sensor.exposure_s: [1e-5, 2e-5]}\n"
    )
    sweep = read_sweep(str(tmp_path / "sweep.yaml"))
    at, _ = scene_and_pose(sweep.base, {"lamps[0].power_w": 2.5})
    assert at.lamps[0].power_w == 2.5 and at.lamps[0].photometry.equivalent_order == pytest.approx(1, abs=0.02)


def test_values_can_be_pickled_and_copied(tmp_path):
    path = cosine_file(tmp_path, 1)
    lamp = occ.Lamp(id=0, centre_m=[2, 2, 3], photometry=path)
    scene = occ.Scene(camera=CAMERA, lamps=[lamp])
    for again in (pickle.loads(pickle.dumps(lamp)), copy.deepcopy(lamp), pickle.loads(pickle.dumps(scene)).lamps[0]):
        assert again.radius_m == lamp.radius_m
        assert again.photometry.density([0, 1, 2]) == lamp.photometry.density([0, 1, 2])
    assert pickle.loads(pickle.dumps(occ.read_photometry(path))).lamp_lm == 3000
    assert repr(lamp.photometry) == f"<EmissionProfile: '{path}', 37 x 1 intensities>"


def test_errors_are_those_of_files(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.ies: cannot be read"):
        occ.read_photometry(tmp_path / "none.ies")
    with pytest.raises(FileNotFoundError, match=r"none\.ies: cannot be read"):
        occ.Lamp(id=0, centre_m=[0, 0, 0], photometry=tmp_path / "none.ies")
    bad = tmp_path / "bad.ies"
    bad.write_text("IESNA91\nTILT=NONE\n1 1 1 2 1 1 1 0 0 0\n1 1 1\n0 90\n0\n1 -1\n")
    with pytest.raises(ValueError, match=r"bad\.ies:7: candela value 2 of plane 1 must not be negative, got -1"):
        occ.read_photometry(bad)
    with pytest.raises(TypeError):
        occ.Lamp(id=0, centre_m=[0, 0, 0], photometry=3)
