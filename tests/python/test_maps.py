# SPDX-License-Identifier: Apache-2.0
"""Received power and power maps: compared with single calls, closed forms and the written files."""

import csv
import json
import math
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import libocc as occ
from libocc.maps import looking_up, plane_of, power_map, with_focal_length
from libocc.samples import load_scene

BOX = "boxes: [{min_m: [1.2, 1.2, 2], max_m: [2.4, 2.4, 2.2]}]\n"


@pytest.fixture(scope="module")
def four() -> occ.Scene:
    return load_scene("kookmin_four_lamps")


@pytest.fixture(scope="module")
def boxed(four: occ.Scene) -> occ.Scene:
    return occ.Scene.parse(four.format() + BOX)


@pytest.fixture
def run(libocc):
    return lambda *arguments: libocc("map", *arguments)


# Convention of the rotation

def axis_of(rotation_deg):
    return looking_up([0, 0, 0], rotation_deg)[2, :3]


def test_the_unturned_camera_has_the_worlds_axes():
    pose = looking_up([1, 2, 3])
    assert np.array_equal(pose[:3, :3], np.eye(3)) and pose[:3, 3].tolist() == [-1, -2, -3]
    assert occ.guide.heading_rad(pose) == 0


@pytest.mark.parametrize(
    "rotation_deg, axis",
    [
        ((30, 0, 0), (0, -0.5, math.sqrt(0.75))),
        ((0, 30, 0), (0.5, 0, math.sqrt(0.75))),
        ((0, 0, 70), (0, 0, 1)),
        ((0, 30, 90), (0, 0.5, math.sqrt(0.75))),
        ((90, 90, 0), (0, -1, 0)),
        ((180, 0, 0), (0, 0, -1)),
    ],
)
def test_roll_leans_to_minus_y_pitch_to_x_and_yaw_turns_it(rotation_deg, axis):
    assert axis_of(rotation_deg) == pytest.approx(axis, abs=1e-12)


def test_yaw_is_the_heading_whatever_the_roll():
    for yaw in (-120, 0, 45):
        pose = looking_up([0, 0, 0], (25, 0, yaw))
        assert np.degrees(occ.guide.heading_rad(pose)) == pytest.approx(yaw)


def test_poses_are_rigid_with_the_given_position():
    positions = np.random.default_rng(1).normal(size=(2, 5, 3))
    poses = looking_up(positions, (20, -35, 110))
    assert poses.shape == (2, 5, 4, 4)
    assert np.allclose(np.linalg.inv(poses)[..., :3, 3], positions, atol=1e-12)
    rotation = poses[0, 0, :3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) > 0.999


# Received power

def test_many_poses_are_each_of_them(four):
    poses = looking_up(np.random.default_rng(2).uniform(0.2, 2.9, (20, 3)), (10, 20, 30))
    many = occ.received_power(four, poses)
    assert many.lamp_power_w.shape == many.whole.shape == (20, 4)
    assert many.power_w.shape == many.visible.shape == (20,)
    for i, pose in enumerate(poses):
        one = occ.received_power(four, pose)
        assert one.power_w.shape == () and np.array_equal(one.lamp_power_w, many.lamp_power_w[i])
        assert one.power_w == many.power_w[i] == pytest.approx(one.lamp_power_w.sum())
        assert one.visible == many.visible[i] == np.count_nonzero(one.lamp_power_w)
        assert np.array_equal(one.whole, many.whole[i])
    assert len(set(many.visible.tolist())) > 2


@pytest.mark.parametrize("shape", [(3, 4), (2, 2, 4, 4), (4,)])
def test_other_shapes_are_rejected(four, shape):
    with pytest.raises(ValueError, match=re.escape(str(shape))):
        occ.received_power(four, np.zeros(shape))


def test_errors_name_a_matrix_that_is_not_rigid(four):
    poses = looking_up(np.zeros((3, 3)))
    poses[1, 0, 0] = 2
    with pytest.raises(ValueError, match=r"cam_from_world\[1\]"):
        occ.received_power(four, poses)


def test_dbm_accepts_numbers_and_arrays():
    assert occ.photometry.dbm(1e-3) == 0 and np.array_equal(occ.photometry.dbm(np.array([1.0, 0.0])), [30, -math.inf])
    with pytest.raises(ValueError, match="power_w"):
        occ.photometry.dbm(-1)


# Maps

@pytest.mark.parametrize("rotation_deg", [(0, 0, 0), (15, -20, 60)])
def test_a_map_is_made_of_single_calls(boxed, rotation_deg):
    made = power_map(boxed, height_m=1, step_m=0.5, rotation_deg=rotation_deg, focal_mm=1.2)
    scene = with_focal_length(boxed, 1.2)
    assert made.visible.shape == (9, 9) and made.focal_mm == pytest.approx(1.2)
    for row, column in np.ndindex(9, 9):
        pose = looking_up([0.5 * column, 0.5 * row, 1], rotation_deg)
        one = occ.received_power(scene, pose)
        assert np.array_equal(made.lamp_power_w[row, column], one.lamp_power_w)
        assert made.visible[row, column] == one.visible
        seen = scene.replace(lamps=[lamp for lamp, whole in zip(scene.lamps, one.whole) if whole])
        bound = occ.bench.pose_bound(seen, pose, rung=occ.Rung.centres)
        if bound.ok:
            assert made.bound_m[row, column] == pytest.approx(np.trace(bound.position_covariance_m2) ** 0.5)
        else:
            assert made.bound_m[row, column] == math.inf
    assert 0 < np.isfinite(made.bound_m).sum() < 81


def test_a_box_hides_lamps_from_power_count_and_bound(four, boxed):
    here = {"height_m": 0.5, "step_m": 0.25, "extent_m": (1, 3, 1, 3)}
    free, hidden = power_map(four, **here), power_map(boxed, **here)
    assert (hidden.lamp_power_w <= free.lamp_power_w * (1 + 1e-4)).all()
    assert (hidden.visible < free.visible).any() and (hidden.bound_m >= free.bound_m * (1 - 1e-9)).all()
    below = 3, 3  # (1.75, 1.75): the box hides lamp 0
    assert hidden.lamp_power_w[below][0] == 0 and hidden.visible[below] == free.visible[below] - 1


def test_the_footprint_of_an_upright_camera_is_its_field_of_view():
    scene = load_scene("kookmin_one_lamp")
    scene = scene.replace(lamps=[scene.lamps[0].replace(shape=occ.LampShape.point)])
    for focal_mm, half_x_m, half_y_m in ((1.4, 2.43, 1.83), (3, 1.14, 0.85)):
        made = power_map(scene, step_m=0.01, focal_mm=focal_mm, rung=None)
        lit = made.power_w > 0
        x_m, y_m = made.plane.x_m[lit.any(axis=0)], made.plane.y_m[lit.any(axis=1)]
        assert np.ptp(x_m) / 2 == pytest.approx(min(half_x_m, 2), abs=0.011)
        assert np.ptp(y_m) / 2 == pytest.approx(half_y_m, abs=0.011)
        assert lit.sum() == lit.any(axis=0).sum() * lit.any(axis=1).sum(), "a rectangle"
        assert np.isinf(made.bound_m).all()


def test_a_leaning_camera_sees_the_lamp_from_the_other_side():
    scene = load_scene("kookmin_one_lamp")
    for rotation_deg, direction in (((0, 30, 0), (-1, 0)), ((30, 0, 0), (0, 1)), ((0, 30, 90), (0, -1))):
        made = power_map(scene, step_m=0.1, focal_mm=3, rotation_deg=rotation_deg, rung=None)
        lit = made.power_w > 0
        x_m, y_m = np.meshgrid(made.plane.x_m, made.plane.y_m)
        off = x_m[lit].mean() - 2, y_m[lit].mean() - 2
        assert np.dot(off, direction) > 0.4 and abs(off[0] * direction[1] - off[1] * direction[0]) < 0.05


def test_one_lamp_alone_bounds_no_position():
    scene = load_scene("kookmin_one_lamp")
    for rung in (occ.Rung.centres, occ.Rung.direct):
        assert np.isinf(power_map(scene, step_m=1, rung=rung).bound_m).all()


def test_the_bound_of_more_of_the_image_is_smaller(four):
    here = {"height_m": 1.2, "step_m": 0.4, "extent_m": (1.6, 2.4, 1.6, 2.4)}
    centres, direct = (power_map(four, rung=rung, **here).bound_m for rung in (occ.Rung.centres, occ.Rung.direct))
    assert np.isfinite(centres).all() and (direct < centres).all()


def test_the_grid_covers_the_extent(four):
    plane = plane_of(four, step_m=0.1)
    assert plane.height_m == 1.5 and len(plane.x_m) == len(plane.y_m) == 41
    assert plane.x_m[0] == 0 and plane.x_m[-1] == pytest.approx(4)
    plane = plane_of(four, 1, 0.3, (1, 2, 3, 3))
    assert plane.x_m.tolist() == pytest.approx([1, 1.3, 1.6, 1.9]) and plane.y_m.tolist() == [3]


def test_another_lens_keeps_the_rest(four):
    camera = occ.Camera.pinhole(
        width=640, height=480, fx_px=200, fy_px=190, cx_px=310, cy_px=240, skew_px=2, distortion=[0.1, 0, 0, 0]
    )
    longer = with_focal_length(four.replace(camera=camera), 2.84).camera
    assert (longer.fx_px, longer.fy_px, longer.skew_px) == pytest.approx((400, 380, 4))
    assert (longer.cx_px, longer.cy_px) == (310, 240) and longer.distortion == camera.distortion


@pytest.mark.parametrize(
    "options, text",
    [
        ({"height_m": 3.5}, "height_m must be inside the room, 0 to 3, got 3.5"),
        ({"height_m": math.nan}, "height_m"),
        ({"step_m": 0}, "step_m must be positive, got 0"),
        ({"step_m": math.inf}, "step_m"),
        ({"step_m": 1e-4}, "step_m must give at most"),
        ({"extent_m": (1, 0, 0, 1)}, "extent_m"),
        ({"extent_m": (0, 1, 0)}, "extent_m"),
        ({"extent_m": (0, 5, 0, 1)}, "extent_m must be inside the room"),
        ({"focal_mm": 0}, "focal_mm must be positive, got 0"),
        ({"rotation_deg": (0, 0)}, "rotation_deg"),
        ({"rotation_deg": (0, 0, math.nan)}, "rotation_deg"),
    ],
)
def test_errors_name_the_invalid_argument(four, options, text):
    with pytest.raises(ValueError, match=text):
        power_map(four, **options)


def test_without_a_room_the_plane_must_be_given(scene):
    bare = occ.Scene(camera=scene.camera, lamps=scene.lamps)
    with pytest.raises(ValueError, match="no room"):
        power_map(bare, height_m=1)
    assert power_map(bare, height_m=-7, step_m=2, extent_m=(-9, 9, -9, 9)).visible.shape == (10, 10)


# The contribution's figures

def test_check_values_are_the_expected_ones(root):
    tool = runpy.run_path(str(root / "tools" / "reproduce_kookmin"))
    rows = list(tool["values"]())
    assert len(rows) == 13 and [row for row in rows if row[1] != row[2]] == []
    written = (root / "data" / "kookmin" / "check_values.md").read_text().splitlines()[2:]
    assert written == [f"| {' | '.join(row)} |" for row in rows]


def test_the_contributions_pictures_are_compact(root):
    sizes = {path.name: path.stat().st_size for path in (root / "data" / "kookmin").glob("*.png")}
    assert set(sizes) == {"images.png", "maps_four_lamps.png", "maps_one_lamp.png", "response.png"}
    assert max(sizes.values()) < 150_000


# Command line

def test_files_hold_the_map(run, four):
    code, out, err = run(
        "kookmin_four_lamps", "--height", 1, "--step", 0.5, "--rotation", 0, 0, 0, "--rotation", 5, 10, 20,
        "--focal-mm", 1.4, "--focal-mm", 2, "--out", "a/b",
    )
    assert code == 0, err
    stems = [f"a/b/f{f}_{turn}" for f in ("1.4", "2") for turn in ("roll0_pitch0_yaw0", "roll5_pitch10_yaw20")]
    files = sorted(map(str, Path("a/b").iterdir()))
    assert files == sorted(stem + ending for stem in stems for ending in (".png", ".csv", ".npz"))
    assert [line.split(".png")[0].strip() for line in out.splitlines()[1::2]] == stems

    made = power_map(four, height_m=1, step_m=0.5, rotation_deg=(5, 10, 20), focal_mm=2)
    with np.load(stems[3] + ".npz") as arrays:
        assert np.array_equal(arrays["lamp_power_w"], made.lamp_power_w)
        assert np.array_equal(arrays["bound_m"], made.bound_m) and arrays["x_m"][-1] == 4
        assert arrays["rotation_deg"].tolist() == [5, 10, 20] and arrays["focal_mm"] == pytest.approx(2)
        assert occ.Scene.parse(str(arrays["scene"])) == made.scene
    with open(stems[3] + ".csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 81 and list(lines[0])[6:] == [f"lamp_{i}_dbm" for i in range(4)]
    for line, power_dbm, bound_m in zip(lines, made.power_dbm.flat, made.bound_m.flat):
        assert float(line["power_dbm"]) == pytest.approx(power_dbm, abs=1e-3)
        assert float(line["bound_m"]) == pytest.approx(bound_m, rel=1e-4)
    assert float(lines[10]["x_m"]) == 0.5 and float(lines[10]["y_m"]) == 0.5 and lines[10]["z_m"] == "1"
    for stem in stems:
        assert occ.read_image(stem + ".png").std() > 20


def test_json_has_the_results(run):
    code, out, err = run("kookmin_four_lamps", "--step", 1, "--bound", "none", "--json", "--rotation", 180, 0, 0)
    assert code == 0, err
    (data,) = json.loads(out)
    assert data["points"] == 25 and data["lit"] == 0 and data["power_dbm"] is None and data["bound_m"] is None
    assert Path(data["files"] + ".png").exists(), "a map of nothing is a map"


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("nosuch.yaml",), "nosuch.yaml"),
        (("kookmin_four_lamps", "--step", 0), "kookmin_four_lamps: step_m must be positive, got 0"),
        (("kookmin_four_lamps", "--step", "nan"), "step_m"),
        (("kookmin_four_lamps", "--height", 9), "height_m must be inside the room, 0 to 3, got 9"),
        (("kookmin_four_lamps", "--focal-mm", 2, "--focal-mm", -3), "focal_mm must be positive, got -3"),
        (("kookmin_four_lamps", "--rotation", 0, "inf", 0), "rotation_deg"),
        (("kookmin_four_lamps", "--out", "file"), "file: "),
        (("kookmin_four_lamps", "--out", "/proc/nowhere"), "/proc/nowhere: "),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(run, arguments, text):
    Path("file").write_text("here")
    code, out, err = run(*arguments)
    assert code == 2 and out == ""
    assert err.startswith("error: ") and text in err and err.count("\n") == 1
    assert not Path("map").exists(), "nothing was made"


def test_finished_files_remain_after_an_interruption(run, monkeypatch):
    import libocc.cli.commands.map as command

    calls = []

    def once(*arguments, **options):
        calls.append(options)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return power_map(*arguments, **options)

    monkeypatch.setattr(command, "power_map", once)
    code, out, err = run("kookmin_four_lamps", "--step", 1, "--focal-mm", 1.4, "--focal-mm", 3)
    assert code == 130 and "1 of 2 maps are in map" in err and "f1.4" in out
    assert sorted(path.suffix for path in Path("map").iterdir()) == [".csv", ".npz", ".png"]
