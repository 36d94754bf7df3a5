# SPDX-License-Identifier: Apache-2.0
"""Updates of maps by new pictures, from Python and from the command line, with rendered pictures."""

import json
import re

import numpy as np
import pytest
from survey_support import rendered_pictures

import libocc as occ
from libocc import samples
from libocc.cli.poses import upward_pose
from libocc.surveying import LampFate

PLACES = [
    (1.7, 2.1, 0.5, 10), (2.3, 1.8, 0.4, 90), (1.9, 2.4, 0.6, 200), (2.2, 2.2, 0.2, 300), (1.6, 1.8, 0.3, 140),
    (2.6, 2.5, 0.3, 45), (1.4, 2.4, 0.4, 250), (2.0, 1.5, 0.5, 330),
]
MORE = [(3.3, 2.0, 3), (0.6, 2.1, 3), (2.1, 0.7, 3)]  # beside the six of the scene
SIGMA_M = 0.002


@pytest.fixture(scope="module")
def room():
    """Nine lamps; each has a name."""
    scene = samples.load_scene("irregular_six")
    first = scene.lamps[0]
    lamps = [*scene.lamps, *(first.replace(id=6 + i, centre_m=at) for i, at in enumerate(MORE))]
    return scene.replace(lamps=[lamp.replace(name=f"L{lamp.id}") for lamp in lamps])


@pytest.fixture(scope="module")
def old_map(room):
    """The map of the room before the changes, with errors that it states, tags, walls and assumptions."""
    noise = np.random.default_rng(4).normal(0, SIGMA_M, (9, 3))
    lamps = [
        lamp.replace(centre_m=np.asarray(lamp.centre_m) + error, position_sigma_m=[SIGMA_M] * 3)
        for lamp, error in zip(room.lamps, noise)
    ]
    tag = occ.Tag(id=3, family="tag36h11", size_m=0.2, centre_m=[1, 0, 1], normal=[0, 1, 0], x_axis=[1, 0, 0])
    return room.replace(lamps=lamps, tags=[tag], room=occ.Room(size_m=[4, 4, 3], wall_reflectance=0.0))


@pytest.fixture(scope="module")
def pictures(room, tmp_path_factory):
    """Pictures after the changes: lamp 4 moved by 40 mm, lamp 7 is dark, a lamp is new, lamp 5 is brighter."""
    lamps = [lamp for lamp in room.lamps if lamp.id != 7]
    lamps[4] = lamps[4].replace(centre_m=np.asarray(lamps[4].centre_m) + [0.04, 0, 0])
    lamps[5] = lamps[5].replace(power_w=4.5)
    lamps.append(lamps[0].replace(id=50, centre_m=[2.6, 1.9, 3], name=""))
    return rendered_pictures(room.replace(lamps=lamps), PLACES, tmp_path_factory.mktemp("now"))


def detected(room, names):
    return [(name.name, occ.detect(occ.read_image(name), sensor=room.sensor)) for name in names]


@pytest.fixture(scope="module")
def updated(room, old_map, pictures):
    return occ.surveying.update_map(detected(room, pictures), old_map)


def test_each_lamp_has_its_verdict(updated, room):
    assert updated.ok, updated.message
    fates = {update.lamp.id: update.fate for update in updated.lamps}
    expected = {**dict.fromkeys(range(9), LampFate.unchanged), 4: LampFate.moved, 7: LampFate.gone}
    assert fates == {**expected, 5: LampFate.changed, 9: LampFate.added}, [u.reason for u in updated.lamps]
    by_id = {update.lamp.id: update for update in updated.lamps}
    assert by_id[4].displacement_m == pytest.approx([0.04, 0, 0], abs=4 * SIGMA_M)
    assert by_id[4].statistic > updated.max_statistic
    assert by_id[9].lamp.centre_m == pytest.approx([2.6, 1.9, 3], abs=3 * SIGMA_M)
    assert [change.quantity for change in by_id[5].changes] == ["power"]
    assert by_id[5].lamp.power_w == pytest.approx(4.5, rel=0.1)
    for update in updated.lamps:
        true = next((lamp for lamp in room.lamps if lamp.id == update.lamp.id), None)
        if true is not None and update.fate in (LampFate.unchanged, LampFate.changed):
            error = np.asarray(update.lamp.centre_m) - true.centre_m
            assert error @ np.linalg.solve(update.covariance_m2, error) < 21


def test_the_scene_keeps_all_but_the_lamps(updated, old_map):
    scene = occ.surveying.updated_scene(updated, old_map)
    assert [lamp.id for lamp in scene.lamps] == [0, 1, 2, 3, 4, 5, 6, 8, 9]
    for kept in ("tags", "room", "camera", "sensor", "lens"):
        assert repr(getattr(scene, kept)) == repr(getattr(old_map, kept)), kept
    assert [lamp.name for lamp in scene.lamps][:3] == ["L0", "L1", "L2"]
    joint = np.asarray(updated.covariance_m2)
    for i, lamp in enumerate(scene.lamps):
        variance = np.asarray(lamp.position_sigma_m) ** 2 + (np.asarray(lamp.shared_errors_m) ** 2).sum(axis=0)
        assert variance == pytest.approx(np.diag(joint)[3 * i : 3 * i + 3], rel=1e-6)


def test_the_updated_map_locates_pictures(updated, old_map, pictures):
    scene = occ.surveying.updated_scene(updated, old_map)
    fix = occ.locate(occ.read_image(pictures[0]), scene)
    assert fix.ok, fix.message
    assert fix.position_m == pytest.approx(PLACES[0][:3], abs=0.01)


def test_an_update_can_be_pickled(updated):
    import pickle

    copy = pickle.loads(pickle.dumps(updated))
    assert [update.reason for update in copy.lamps] == [update.reason for update in updated.lamps]
    assert np.array_equal(copy.covariance_m2, updated.covariance_m2) and copy.ways[0].picture == "p0.png"


def test_a_failed_update_has_no_scene(old_map):
    failed = occ.surveying.update_map([("a.png", [])], old_map)
    assert failed.status == occ.Status.too_few_lamps
    with pytest.raises(ValueError, match="update must have the status ok, got too_few_lamps"):
        occ.surveying.updated_scene(failed, old_map)


def test_the_command_writes_the_whole_folder(libocc, old_map, pictures, tmp_path, root):
    old_map.save(tmp_path / "map.yaml")
    out = tmp_path / "updated"
    call = ("survey", *pictures, "--update", "map.yaml", "--out", out)
    code, text, errors = libocc(*call)
    assert code == 0, errors
    for name in ("scene.yaml", "plan.png", "report.html", "result.json", "trajectory.tum"):
        assert (out / name).stat().st_size > 0, name
    assert re.search(r"lamp 4 \(L4\) moved by \d+\.\d mm, sigma ", text)
    assert "lamp 7 (L7) gone: should be in " in text and "lamp 9 new: " in text
    assert "6 unchanged, 1 changed, 1 moved, 1 gone, 0 not seen, 1 new; 8 of 8 pictures" in text
    data = json.loads((out / "result.json").read_text())
    assert [lamp["fate"] for lamp in data["lamps"]].count("unchanged") == 6
    assert all(lamp["reason"] for lamp in data["lamps"])
    gone = data["lamps"][7]
    assert gone["centre_m"] is None and not gone["seen"] and len(gone["missed"]) >= 3
    assert len(occ.Scene.load(out / "scene.yaml").lamps) == 9
    from test_json_documents import described, keys, sections

    known = described(sections(root / "docs" / "formats" / "json.md")["`libocc survey`"])
    assert set(keys(data)) - known == set()


def test_a_far_move_is_gone_and_new(room, old_map, pictures):
    found = occ.surveying.update_map(detected(room, pictures), old_map, max_move_m=0.01)
    fates = {update.lamp.id: update for update in found.lamps}
    assert fates[4].fate == LampFate.gone and "max_move_m" in fates[4].reason
    assert sum(update.fate == LampFate.added for update in found.lamps) == 2


def test_pictures_of_another_room_are_refused(libocc, room, old_map, tmp_path):
    at = np.random.default_rng(7).uniform([0.6, 0.6, 2.9], [3.4, 3.4, 3.0], (9, 3))
    other = room.replace(lamps=[lamp.replace(centre_m=place) for lamp, place in zip(room.lamps, at)])
    old_map.save(tmp_path / "map.yaml")
    pictures = rendered_pictures(other, PLACES, tmp_path)
    code, text, errors = libocc("survey", *pictures, "--update", "map.yaml", "--out", tmp_path / "out")
    assert code == 1, text
    assert "no_pose: " in errors
    data = json.loads((tmp_path / "out" / "result.json").read_text())
    assert data["status"] == "no_pose" and len(data["omissions"]) == 8 and data["lamps"] == []
    assert not (tmp_path / "out" / "scene.yaml").exists()


def test_a_recording_updates_its_map_and_no_other(libocc, tmp_path):
    assert libocc("sequence", "irregular_six", "walk", "--out", "walk", "--fps", 4)[0] == 0
    code, text, errors = libocc("survey", "walk", "--update", "irregular_six", "--out", tmp_path / "right")
    assert code == 0 and "6 unchanged, 0 changed, 0 moved, 0 gone, 0 not seen, 0 new; 8 of 8 pictures" in text
    assert "warning: the map does not state the errors of 6 lamps: sigma 5 mm per axis is assumed" in text
    for other in ("square_four", "kookmin_four_lamps"):  # the camera of the second is another one, too
        code, text, errors = libocc("survey", "walk", "--update", other, "--out", tmp_path / other)
        assert code == 1 and "no_pose" in errors, text + errors


def test_a_wrong_focal_length_is_a_warning(libocc, old_map, pictures, tmp_path):
    """A plane of lamps is alike for any focal length; lamps at two heights contradict it."""
    camera = occ.Camera.pinhole(width=640, height=480, fx_px=330, fy_px=330, cx_px=319.5, cy_px=239.5)
    old_map.save(tmp_path / "map.yaml")
    old_map.replace(camera=camera).save(tmp_path / "wrong.yaml")
    code, text, errors = libocc(
        "survey", *pictures, "--update", "map.yaml", "--camera", "wrong.yaml", "--out", tmp_path / "out"
    )
    assert code == 0, errors
    assert "warning: the pictures contradict each other" in text and "check that the camera's calibration" in text
    data = json.loads((tmp_path / "out" / "result.json").read_text())
    assert any("contradicts the other pictures" in omission["reason"] for omission in data["omissions"])


def test_a_regular_map_is_ambiguous_and_a_prior_decides(libocc, room, tmp_path):
    at = [(1.0 * i, 1.0 * j, 3.0) for i in range(1, 4) for j in range(1, 3)]
    grid = room.replace(lamps=[room.lamps[0].replace(id=i, centre_m=place) for i, place in enumerate(at)])
    grid.save(tmp_path / "grid.yaml")
    frames = tmp_path / "frames"
    frames.mkdir()
    for i in range(12):
        pose = upward_pose([1.6 + 0.07 * i, 1.4, 0.3 + 0.02 * i], 20 + 3 * i, 3, 40)
        occ.write_image(frames / f"f{i:02}.png", occ.simulate(grid, pose, seed=i)[0])
    call = ("survey", "frames", "--ordered", "--update", "grid.yaml")
    code, text, errors = libocc(*call, "--out", tmp_path / "a")
    assert code == 1
    assert "ambiguous: the pictures match the map in 2 ways" in errors
    assert errors.count("way: frames/f00.png at ") == 2
    ways = json.loads((tmp_path / "a" / "result.json").read_text())["ways"]
    turned = abs(ways[0]["heading_deg"] - ways[1]["heading_deg"])
    assert min(turned, 360 - turned) == pytest.approx(180, abs=1)
    code, text, errors = libocc(*call, "--prior-heading-deg", 20, "--out", tmp_path / "b")
    assert code == 0, errors
    assert "6 unchanged" in text
    code, text, errors = libocc(*call, "--prior-position", 7, 7, 0.3, "--out", tmp_path / "c")
    assert code == 1 and "contradict the prior" in errors


def test_a_map_without_lamps_is_refused(libocc, old_map, pictures, tmp_path):
    old_map.replace(lamps=[]).save(tmp_path / "empty.yaml")
    code, text, errors = libocc("survey", *pictures, "--update", "empty.yaml", "--out", tmp_path / "out")
    assert code in (1, 2)
    assert "lamps" in errors


def test_a_camera_of_another_size_is_named(libocc, old_map, pictures, tmp_path):
    camera = occ.Camera.pinhole(width=480, height=640, fx_px=422.5, fy_px=422.5, cx_px=239.5, cy_px=319.5)
    old_map.replace(camera=camera).save(tmp_path / "turned.yaml")
    code, text, errors = libocc("survey", *pictures, "--update", "turned.yaml", "--out", tmp_path / "out")
    assert code == 2
    assert "p0.png: its size is 640 x 480 px, that of the camera is 480 x 640 px" in errors


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--update", "irregular_six", "--radius", "0.085"], "--radius: is not used with --update"),
        (["--update", "nowhere.yaml"], "nowhere.yaml"),
        (["--update", "irregular_six", "--map-sigma", "0"], "--map-sigma"),
        (["--camera", "irregular_six", "--max-move", "0.2"], "--max-move: is used with --update only"),
        (["--camera", "irregular_six", "--prior-height", "1"], "--prior-...: is used with --update only"),
        ([], "--camera: is missing"),
    ],
)
def test_bad_options_are_named(libocc, pictures, tmp_path, options, message):
    code, text, errors = libocc("survey", *pictures, *options, "--out", tmp_path / "out")
    assert code == 2
    assert message in errors
