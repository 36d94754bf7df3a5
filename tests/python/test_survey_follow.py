# SPDX-License-Identifier: Apache-2.0
"""Surveys by recordings: lamps without rims that are followed, ids that lamps transmit, and bags."""

import json

import numpy as np
import pytest
from stream_support import write_bag

import libocc as occ
from libocc.cli.survey.follow import blob_at
from libocc.network.starts import similarity

CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=420, fy_px=420, cx_px=319.5, cy_px=239.5)
PLACES_M = [(0.7, 0.8, 2.6), (2.9, 0.6, 2.6), (1.6, 1.4, 2.6), (0.6, 2.3, 2.4), (2.6, 2.1, 2.6), (1.7, 2.8, 2.6),
            (3.2, 1.3, 2.6)]
CODE = occ.codes.Code(kind=occ.codes.CodeKind.ufsook)


def room(radius_m, ids=None):
    lamps = [
        occ.Lamp(id=k, centre_m=at, radius_m=radius_m, power_w=0.5,
                 code=None if ids is None else occ.codes.LampCode(code=CODE, id=ids[k]))
        for k, at in enumerate(PLACES_M)
    ]
    return occ.Scene(camera=CAMERA, lamps=lamps)


def pose_at(time_s, speed=1.0):
    at = np.array([1.9 + 0.6 * np.sin(0.5 * speed * time_s), 1.6 + 0.5 * np.sin(0.4 * speed * time_s + 1), 0.3])
    turn = 0.3 * np.sin(0.3 * speed * time_s)
    target = at + [0.15 * np.sin(0.7 * speed * time_s), 0, 2]
    return occ.look_at(at, target, up=[np.cos(turn), np.sin(turn), 0])


def recorded(scene, count, folder, speed=1.0):
    """Frames at 30 frames/s as files of a folder."""
    folder.mkdir()
    renderer = occ.Renderer(scene)
    for k in range(count):
        image, _ = renderer.render(pose_at(k / 30, speed), frame=k, start_s=k / 30)
        occ.write_image(folder / f"{k:04d}.png", image)
    return folder


def errors_m(scene, made):
    """Errors of the places after the best similarity, with the lamps in the order of their distances."""
    from itertools import permutations

    true, found = (np.array([lamp.centre_m for lamp in s.lamps]) for s in (scene, made))
    shape = np.linalg.norm(found[:, None] - found[None], axis=2)
    shape /= shape.mean()

    def misfit(order):
        other = np.linalg.norm(true[list(order)][:, None] - true[list(order)][None], axis=2)
        return np.abs(other / other.mean() - shape).max()

    order = list(min(permutations(range(len(true)), len(found)), key=misfit))
    scale, rotation, shift = similarity(found, true[order])
    return np.linalg.norm(scale * found @ rotation.T + shift - true[order], axis=1), order


def test_lamps_without_rims_are_followed(libocc, tmp_path):
    scene = room(0.006)
    scene.save(tmp_path / "room.yaml")
    recorded(scene, 90, tmp_path / "walk", speed=2.0)
    code, text, errors = libocc("survey", "walk", "--fps", 30, "--camera", "room.yaml", "--out", "out")
    assert code == 0, errors
    made = occ.Scene.load(tmp_path / "out" / "scene.yaml")
    assert len(made.lamps) >= 6 and all(lamp.shape == occ.LampShape.point for lamp in made.lamps)
    off_m, _ = errors_m(scene, made)
    assert off_m.max() < 0.01, text


def test_ids_are_read_and_kept(libocc, tmp_path):
    ids = [7, 10, 13, 16, 19, 22, 25]
    scene = room(0.06, ids)
    scene.save(tmp_path / "room.yaml")
    recorded(scene, 80, tmp_path / "walk", speed=0.6)
    code, text, errors = libocc(
        "survey", "walk", "--fps", 30, "--camera", "room.yaml", "--code", "ufsook", "--out", "out"
    )
    assert code == 0, errors
    made = occ.Scene.load(tmp_path / "out" / "scene.yaml")
    off_m, order = errors_m(scene, made)
    assert off_m.max() < 0.02, text  # 2.7 s of a slow motion: a short baseline
    coded = [(lamp.code.id, ids[k]) for lamp, k in zip(made.lamps, order) if lamp.code is not None]
    assert len(coded) >= 3 and all(read == true for read, true in coded)
    listed = json.loads((tmp_path / "out" / "result.json").read_text())["lamps"]
    assert sum(lamp["code_id"] is not None for lamp in listed) == len(coded)
    assert "transmits" in text


def test_a_bag_is_a_recording(libocc, tmp_path):
    pytest.importorskip("rosbags")
    scene = room(0.06)
    scene.save(tmp_path / "room.yaml")
    frames = []
    for k in range(12):
        pose = np.asarray(pose_at(k / 3))
        image, _ = occ.simulate(scene, pose, seed=k)
        frames.append((k / 3, np.asarray(image), pose))
    for name in ("walk.bag", "walk2"):
        write_bag(tmp_path / name, frames)
        code, _, errors = libocc("survey", name, "--camera", "room.yaml", "--radius", 0.06, "--out", name + "-out")
        assert code == 0, errors
        off_m, _ = errors_m(scene, occ.Scene.load(tmp_path / (name + "-out") / "scene.yaml"))
        assert off_m.max() < 0.005


@pytest.mark.parametrize(
    ("camera", "options", "message"),
    [
        ("camera.yaml", ["--fps", 30], "give a scene as --camera"),
        ("room.yaml", [], "needs a recording"),
    ],
)
def test_codes_need_times_and_a_recording(libocc, tmp_path, camera, options, message):
    scene = room(0.06)
    scene.save(tmp_path / "room.yaml")
    (tmp_path / "camera.yaml").write_text(occ.network.format_camera(CAMERA))
    recorded(scene, 2, tmp_path / "walk")
    code, _, errors = libocc(
        "survey", "walk", *options, "--camera", camera, "--code", "ufsook", "--out", tmp_path / "out"
    )
    assert code == 2 and message in errors


def test_a_blob_is_at_a_point_of_its_box():
    image, _ = occ.simulate(room(0.06), pose_at(0), seed=1)
    blobs = list(occ.detect(image))
    for number, blob in enumerate(blobs):
        assert blob_at(blobs, np.asarray(blob.centroid_px) + [2, -1]) == number
    assert blob_at(blobs, np.array([-50.0, -50.0])) is None


def test_tracks_join_blobs_and_refuse_times_that_repeat():
    scene = room(0.06)
    rows = []
    for k in range(6):
        image, _ = occ.simulate(scene, pose_at(k / 30), seed=k)
        rows.append((k / 30, list(occ.detect(image))))
    tracks = occ.surveying.track_blobs(rows)
    assert [len(of_frame) for of_frame in tracks] == [len(blobs) for _, blobs in rows]
    first = {track: blob.centroid_px for track, blob in zip(tracks[0], rows[0][1])}
    for track, blob in zip(tracks[5], rows[5][1]):
        assert np.linalg.norm(first[track] - blob.centroid_px) < 30
    with pytest.raises(ValueError, match="time"):
        occ.surveying.track_blobs([rows[0], rows[0]])


def test_surveys_refuse_tracks_of_another_count():
    blobs = list(occ.detect(occ.simulate(room(0.06), pose_at(0), seed=1)[0]))
    with pytest.raises(ValueError, match="one list for each picture"):
        occ.surveying.survey([("a", blobs)], CAMERA, tracks=[[], []])
    with pytest.raises(ValueError, match="one for each blob"):
        occ.surveying.survey([("a", blobs)], CAMERA, tracks=[[1]])


def test_a_cut_to_another_room_gives_no_mixture(libocc, tmp_path):
    one = room(0.006)
    other_m = [(y, 3.3 - x, z) for x, y, z in PLACES_M[:4]] + [(2.2, 0.9, 2.5), (1.1, 1.2, 2.6), (2.9, 2.7, 2.6)]
    other = occ.Scene(camera=CAMERA, lamps=[
        occ.Lamp(id=k, centre_m=at, radius_m=0.006, power_w=0.5) for k, at in enumerate(other_m)
    ])
    one.save(tmp_path / "room.yaml")
    recorded(one, 90, tmp_path / "walk", speed=2.0)
    for number, path in enumerate(sorted(recorded(other, 30, tmp_path / "later", speed=2.0).iterdir())):
        path.rename(tmp_path / "walk" / f"{1000 + number}.png")
    code, text, errors = libocc("survey", "walk", "--fps", 30, "--camera", "room.yaml", "--out", "out")
    assert code == 0, errors
    off_m, _ = errors_m(one, occ.Scene.load(tmp_path / "out" / "scene.yaml"))
    assert off_m.max() < 0.01, text
    assert "not used: 10" in text
