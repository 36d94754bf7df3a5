# SPDX-License-Identifier: Apache-2.0
"""Videos whose frames show too few whole lamps, which an AprilTag links."""

import json

import numpy as np
import pytest
from test_survey_follow import errors_m

import libocc as occ

CAMERA = occ.Camera.pinhole(width=640, height=360, fx_px=520, fy_px=520, cx_px=319.5, cy_px=179.5)
PLACES_M = [(1, 1, 2.7), (3, 1, 2.7), (1, 2.5, 2.7), (3, 2.5, 2.7)]
TAG = occ.Tag(id=7, family="tag36h11", size_m=0.3, centre_m=[2, 1.9, 2.7], normal=[0, 0, -1], x_axis=[1, 0, 0])
FRAMES = 40


def pose_at(part):
    """Pose on a closed path below the lamps; part: 0 to 1."""
    turn = 2 * np.pi * part
    at = np.array([2 + 0.5 * np.cos(turn), 1.75 + 0.5 * np.sin(turn), 0.4 + 0.15 * np.sin(2 * turn)])
    heading = 0.5 * np.sin(turn)
    return np.asarray(occ.look_at(at, [2, 1.75 + 0.1 * np.cos(turn), 2.7], up=[np.sin(heading), np.cos(heading), 0]))


def write_walk(scene, folder):
    """Frames of a walk below the lamps and the tag; number of whole lamps of each."""
    folder.mkdir()
    renderer, whole = occ.Renderer(scene), []
    for k in range(FRAMES):
        pose = pose_at(k / FRAMES)
        image, truth = renderer.render(pose, frame=k)
        whole.append(sum(lamp.whole for lamp in truth.lamps))
        tags = occ.targets.TargetRenderer(
            CAMERA, pose, tags=[TAG], black_dn=12, white_dn=120, ground_dn=8, noise_dn=1, seed=k
        )
        occ.write_image(folder / f"{k:04d}.png", np.maximum(image, tags.window(0, 0, width=640, height=360)))
    return whole


def test_a_tag_links_frames_of_few_lamps(libocc, tmp_path):
    lamps = [occ.Lamp(id=k, centre_m=at, radius_m=0.08, power_w=0.6) for k, at in enumerate(PLACES_M)]
    scene = occ.Scene(camera=CAMERA, lamps=lamps)
    scene.save(tmp_path / "room.yaml")
    whole = write_walk(scene, tmp_path / "walk")
    assert max(whole) < 4
    options = ("walk", "--fps", 10, "--camera", "room.yaml")
    # Without its size, the tag links nothing: bright parts of it count as lamps, and most frames are left out.
    code, _, errors = libocc("survey", *options, "--radius", 0.08, "--out", "undeclared")
    assert code == 0, errors
    undeclared = occ.Scene.load(tmp_path / "undeclared" / "scene.yaml")
    first, second = (np.array(lamp.centre_m) for lamp in undeclared.lamps if lamp.shape == occ.LampShape.disc)
    assert np.linalg.norm(first - second) == pytest.approx(2.5, rel=3 * undeclared.map_scale_sigma)
    assert len(json.loads((tmp_path / "undeclared" / "result.json").read_text())["pictures"]) < 0.5 * FRAMES
    code, text, errors = libocc("survey", *options, "--tag-size", TAG.size_m, "--out", "room")
    assert code == 0, errors
    off_m, order = errors_m(scene, occ.Scene.load(tmp_path / "room" / "scene.yaml"))
    assert sorted(order) == [0, 1, 2, 3] and off_m.max() < 0.003
    assert text.count("parts of AprilTags") == 1
    data = json.loads((tmp_path / "room" / "result.json").read_text())
    assert data["scale"] == "tags" and len(data["pictures"]) > 0.8 * FRAMES
    # The scene has the tag, which alone gives the pose in the frame of the lamps.
    made = occ.Scene.load(tmp_path / "room" / "scene.yaml")
    (tag,) = made.tags
    assert (tag.id, tag.family, tag.size_m) == (7, "tag36h11", pytest.approx(TAG.size_m))
    made_m, true_m = (sorted(np.linalg.norm(np.subtract(places, middle), axis=1)) for places, middle in (
        ([lamp.centre_m for lamp in made.lamps], tag.centre_m), (PLACES_M, TAG.centre_m)))
    assert made_m == pytest.approx(true_m, abs=0.003)
    assert np.dot(tag.normal, [0, 0, -1]) > 0.999
    assert "  - \"the tags count as exact\"" in made.format()

    # An update links the frames by the tags of the map, too. Its four lamps are alike after half a turn.
    first = (tmp_path / "room" / "trajectory.tum").read_text().splitlines()[1].split()[1:4]
    update = ("survey", "walk", "--fps", 10, "--prior-position", *map(float, first), "--prior-position-sigma", 0.2)
    code, text, errors = libocc(*update, "--update", "room/scene.yaml", "--out", "updated")
    assert code == 0, errors
    assert "4 unchanged, 0 changed, 0 moved" in text
    assert len(occ.Scene.load(tmp_path / "updated" / "scene.yaml").tags) == 1
    made.replace(tags=[]).save(tmp_path / "untagged.yaml")
    code, text, errors = libocc(*update, "--update", "untagged.yaml", "--out", "untagged")
    assert code == 1 and "too few" in errors.replace("_", " ")
