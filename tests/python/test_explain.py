# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np
import pytest

import libocc as occ
from libocc import samples
from libocc.cli.poses import facing_pose

SCENE = """\
schema: libocc-scene/1
camera: {width_px: 160, height_px: 120, fx_px: 110}
ambient_w_m2: 0.02
effects: {default: auto, psf: off}
room: {size_m: [4, 4, 3]}
lamps:
  - {id: 0, centre_m: [1, 1, 2.9], radius_m: 0.1}
  - {id: 1, centre_m: [3, 1, 2.9], radius_m: 0.1}
  - {id: 2, centre_m: [2, 3, 2.9], radius_m: 0.1}
"""


@pytest.fixture
def run(libocc, tmp_path):
    (tmp_path / "room.yaml").write_text(SCENE)
    return lambda *arguments: libocc("explain", *arguments)


def test_json_has_the_values_of_the_api(run):
    code, out, err = run("room.yaml", "--json", "--repetitions", 0)
    assert code == 0, err
    data = json.loads(out)
    scene = occ.Scene.load("room.yaml")
    pose = facing_pose(scene)
    assert np.allclose(data["cam_from_world"], pose)
    explained = occ.explain(scene, pose, repetitions=0)
    assert [e["effect"] for e in data["effects"]] == [e.effect for e in explained.effects]
    for printed, effect in zip(data["effects"], explained.effects, strict=True):
        assert printed["bound_dn"] == effect.bound_dn and printed["applied"] == effect.applied
        assert printed["cost_s"] is None
    plan = occ.rendering.plan_render(scene, pose)
    assert [e.applied for e in plan] == [e.applied for e in explained.effects]
    by_name = {e.effect: e for e in explained.effects}
    assert by_name["psf"].called_for and not by_name["psf"].applied and by_name["psf"].reason == "off"
    assert by_name["extent"].applied and by_name["extent"].reason == "more than the tolerances"


def test_table_has_a_line_for_every_effect_and_measured_times(run):
    code, out, err = run("room.yaml", "--position", 2, 2, 0.5)
    assert code == 0, err
    lines = out.splitlines()
    assert lines[0] == "camera at 2.000 2.000 0.500 m, looks along 0.000 0.000 1.000"
    names = [line.split()[0] for line in lines[2:-1]]
    assert names == list(occ.Effects().use)
    assert lines[-1].startswith("one image: ")
    ambient = next(line for line in lines if line.startswith("ambient"))
    assert ambient.split()[1:3] == ["auto", "yes"]


def test_the_default_pose_sees_all_lamps_from_inside_the_room():
    for name in ("irregular_six", "square_four", "coded_four", "kookmin_four_lamps"):
        scene = samples.load_scene(name)
        pose = facing_pose(scene)
        if scene.room is None:
            assert all(lamp.whole for lamp in occ.simulate(scene, pose, noise=False)[1].lamps)
        else:
            position = -pose[:3, :3].T @ pose[:3, 3]
            assert (position > 0).all() and (position < scene.room.size_m).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nowhere.yaml",), "nowhere.yaml"),
        (("room.yaml", "--tilt-deg", 5), "--position"),
        (("room.yaml", "--position", 1, 1, 1, "--pose", "x.json"), "either"),
        (("room.yaml", "--pose", "x.json"), "x.json"),
        (("room.yaml", "--position", "nan", 1, 1), "room.yaml: "),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(run, arguments, message):
    code, _, err = run(*arguments)
    assert code == 2 and message in err and err.count("\n") == 1, err


def test_an_unknown_effect_and_bad_tolerances_are_rejected(run, tmp_path):
    for line, message in (
        ("effects: {vigneting: off}", "vignetting"),
        ("effects: {tolerance_dn: 0}", "tolerance_dn"),
        ("effects: {walls: off, interreflection: on}\nroom: {wall_reflectance: 0.5}", "interreflection"),
    ):
        text = SCENE.replace("effects: {default: auto, psf: off}\nroom: {size_m: [4, 4, 3]}", line)
        (tmp_path / "odd.yaml").write_text(text)
        code, _, err = run("odd.yaml")
        assert code == 2 and message in err and "odd.yaml" in err, err
