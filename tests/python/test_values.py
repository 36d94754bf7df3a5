# SPDX-License-Identifier: Apache-2.0
"""Cameras, lamps, sensors, priors and scenes as Python values."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import libocc as occ


def camera(**changes):
    values = dict(width=640, height=480, fx_px=400, fy_px=410, cx_px=319.5, cy_px=239.5)
    return occ.Camera.pinhole(**{**values, **changes})


def translated(translation):
    pose = np.eye(4)
    pose[:3, 3] = translation
    return pose


def test_camera_projects_by_the_pinhole_equation():
    pixel = camera().project([0.1, -0.2, 2])
    assert pixel == pytest.approx([319.5 + 400 * 0.05, 239.5 - 410 * 0.1], abs=1e-12)
    assert camera().project([0, 0, -1]) is None


def test_unproject_inverts_project():
    distorted = camera(distortion=[-0.2, 0.05, 0.001, -0.002])
    point = np.array([0.3, 0.2, 1.0])
    bearing = distorted.unproject(distorted.project(point))
    assert bearing == pytest.approx(point / np.linalg.norm(point), abs=1e-12)


def test_cameras_are_values():
    assert camera() == camera() and camera() != camera(fx_px=401)
    assert hash(camera()) == hash(camera())
    assert eval(repr(camera(distortion=[0.1, 0, 0, 0])), vars(occ)) == camera(distortion=[0.1, 0, 0, 0])


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"width": 0}, "width"),
        ({"fx_px": -1}, "fx_px"),
        ({"cy_px": math.nan}, "cy_px"),
        ({"distortion": [1, 2, 3]}, "distortion"),
    ],
)
def test_camera_errors_name_the_argument(changes, text):
    with pytest.raises(ValueError, match=text):
        camera(**changes)


def test_lamp_has_its_documented_keywords_and_units():
    lamp = occ.Lamp(
        id=3,
        centre_m=[1, 2, 3],
        normal=[0, 0, -2],
        radius_m=0.085,
        power_w=1.5,
        half_power_rad=math.radians(70),
        frequency_hz=2000,
    )
    assert lamp.normal.tolist() == [0, 0, -1]
    assert lamp.frequency_hz == 2000 and lamp.shape is occ.LampShape.disc
    assert eval(repr(lamp), vars(occ)).centre_m.tolist() == [1, 2, 3]


def test_values_do_not_change():
    lamp = occ.Lamp(id=3, centre_m=[1, 2, 3], radius_m=0.1)
    with pytest.raises(AttributeError):
        lamp.radius_m = 0.2
    with pytest.raises(ValueError, match="read-only"):
        lamp.centre_m[0] = 5
    with pytest.raises(AttributeError):
        occ.Scene(camera=camera(), lamps=[lamp]).lamps.append(lamp)


def test_replace_changes_only_the_given_fields():
    lamp = occ.Lamp(id=3, centre_m=[1, 2, 3], radius_m=0.1)
    other = lamp.replace(radius_m=0.2, frequency_hz=100)
    assert (other.id, other.radius_m, other.frequency_hz) == (3, 0.2, 100)
    assert (lamp.radius_m, lamp.frequency_hz) == (0.1, None)
    with pytest.raises(ValueError, match="radius_m must be .*got -1"):
        lamp.replace(radius_m=-1)
    with pytest.raises(TypeError, match="radius"):
        lamp.replace(radius=1)
    with pytest.raises(TypeError, match="radius_m.*'wide'"):
        lamp.replace(radius_m="wide")


@pytest.mark.parametrize(
    "value",
    [
        occ.Lamp(id=3, centre_m=[1, 2, 3], radius_m=0.1, frequency_hz=5, name="door"),
        occ.Sensor(exposure_s=1e-3, response=occ.Response.srgb),
        occ.Room(size_m=[5, 6, 3]),
        occ.Prior(heading_rad=1.0, gravity_in_cam=[0, 0, 1]),
        occ.Prior(height_m=1.0, last_pose=(translated([0, 0, -1]), 0.01 * np.eye(6))),
        occ.Blob(centroid_px=[3, 4], rim=np.ones((2, 5)), flux_dn=8),
        camera(distortion=[0.1, 0, 0, 0]),
    ],
)
def test_pickling_keeps_every_field(value):
    copied = pickle.loads(pickle.dumps(value))
    assert repr(copied) == repr(value)


def test_pickled_blob_keeps_its_rim():
    blob = occ.Blob(centroid_px=[3, 4], rim=np.arange(10.0).reshape(2, 5))
    assert pickle.loads(pickle.dumps(blob)).rim.tolist() == [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: occ.Lamp(id=1, centre_m=[0, 0, 3], radius_m=-0.1), "radius_m.*-0.1"),
        (lambda: occ.Lamp(id=1, centre_m=[0, 0, 3], radius_m=0.1, normal=[0, 0, 0]), "normal"),
        (lambda: occ.Lamp(id=1, centre_m=[0, math.nan, 3], radius_m=0.1), "centre_m"),
        (lambda: occ.Sensor(exposure_s=0), "exposure_s"),
        (lambda: occ.Prior(heading_rad=0.0, heading_sigma_rad=-1), "heading_sigma_rad.*-1"),
        (lambda: occ.Prior(gravity_in_cam=[0, 0, 0]), "gravity_in_cam"),
        (
            lambda: occ.Prior(height_m=2.0, last_pose=(translated([0, 0, -1]), 1e-4 * np.eye(6))),
            "height_m and prior.last_pose contradict",
        ),
    ],
)
def test_bad_values_name_field_and_value(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_two_lamps_with_one_id_are_rejected():
    lamp = occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)
    with pytest.raises(ValueError, match="7"):
        occ.Scene(camera=camera(), lamps=[lamp, lamp])


def test_scene_survives_saving(scene: occ.Scene, tmp_path: Path):
    scene.save(tmp_path / "room.yaml")
    assert occ.Scene.load(tmp_path / "room.yaml") == scene
    assert occ.Scene.load(str(tmp_path / "room.yaml")) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert scene.replace(lamps=scene.lamps[:3]) != scene


@pytest.mark.parametrize(
    "change, text",
    [
        (("radius_m", "radius_mm"), "radius_mm"),
        (("radius_m: 0.085", "radius_m: -0.085"), r"radius_m.*-0\.085"),
        (("normal: [0, 0, -1]", "normal: [0, 0, 0]"), "normal"),
        (("id: 1", "id: 0"), "id"),
        (("schema: libocc-scene/1", "schema: libocc-scene/99"), "schema"),
    ],
)
def test_bad_scene_files_name_file_line_and_key(scene, tmp_path: Path, change, text):
    written = scene.format()
    changed = written.replace(*change)
    assert changed != written
    path = tmp_path / "bad.yaml"
    path.write_text(changed)
    with pytest.raises(ValueError, match=rf"bad\.yaml(?s:.)*{text}"):
        occ.Scene.load(path)
    with pytest.raises(ValueError, match=text):
        occ.Scene.parse(changed)


def test_scene_file_that_is_absent_or_a_folder(tmp_path: Path):
    with pytest.raises(FileNotFoundError, match="nosuch.yaml"):
        occ.Scene.load(tmp_path / "nosuch.yaml")
    with pytest.raises(OSError, match=str(tmp_path)):
        occ.Scene.load(tmp_path)


def test_scene_cannot_be_written_into_a_missing_folder(scene, tmp_path: Path):
    with pytest.raises(OSError, match="nowhere"):
        scene.save(tmp_path / "nowhere" / "room.yaml")


def test_read_camera_accepts_a_scene_file(scene, root: Path):
    assert occ.read_camera(root / "data" / "scenes" / "irregular_six.yaml") == scene.camera


def test_reprs_have_the_main_values(scene, pose, rendered):
    image, truth = rendered
    fix = occ.locate(image, scene)
    for value in (scene, truth, truth.lamps[0], fix, fix.candidates[0], fix.timing_s, fix.blobs[0]):
        text = repr(value)
        assert "object at 0x" not in text and type(value).__name__ in text
    assert "ok" in repr(fix) and "lamps [0, 1, 2, 3, 4, 5]" in repr(fix)


def test_lamps_may_be_lame_curves():
    lamp = occ.Lamp(
        id=3, centre_m=[1, 2, 3], shape=occ.LampShape.lame, size_m=[0.2, 0.1], exponent=2.5
    )
    assert eval(repr(lamp), vars(occ)).exponent == 2.5
    with pytest.raises(ValueError, match="exponent must be .*got 0.5"):
        lamp.replace(exponent=0.5)
