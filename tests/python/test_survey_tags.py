# SPDX-License-Identifier: Apache-2.0
"""Videos whose frames show too few whole lamps, which an AprilTag links."""

import json

import numpy as np
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


def test_a_tag_links_frames_of_few_lamps(libocc, tmp_path):
    lamps = [occ.Lamp(id=k, centre_m=at, radius_m=0.08, power_w=0.6) for k, at in enumerate(PLACES_M)]
    scene = occ.Scene(camera=CAMERA, lamps=lamps)
    scene.save(tmp_path / "room.yaml")
    (tmp_path / "walk").mkdir()
    renderer, whole = occ.Renderer(scene), []
    for k in range(FRAMES):
        pose = pose_at(k / FRAMES)
        image, truth = renderer.render(pose, frame=k)
        whole.append(sum(lamp.whole for lamp in truth.lamps))
        tags = occ.targets.TargetRenderer(
            CAMERA, pose, tags=[TAG], black_dn=12, white_dn=120, ground_dn=8, noise_dn=1, seed=k
        )
        occ.write_image(tmp_path / "walk" / f"{k:04d}.png", np.maximum(image, tags.window(0, 0, width=640, height=360)))
    assert max(whole) < 4
    options = ("walk", "--fps", 10, "--camera", "room.yaml")
    code, _, errors = libocc("survey", *options, "--radius", 0.08, "--out", "refused")
    assert code == 1 and "do not determine a map" in errors
    code, text, errors = libocc("survey", *options, "--tag-size", TAG.size_m, "--out", "room")
    assert code == 0, errors
    off_m, order = errors_m(scene, occ.Scene.load(tmp_path / "room" / "scene.yaml"))
    assert sorted(order) == [0, 1, 2, 3] and off_m.max() < 0.003
    assert text.count("parts of AprilTags") == 1
    data = json.loads((tmp_path / "room" / "result.json").read_text())
    assert data["scale"] == "tags" and len(data["pictures"]) > 0.8 * FRAMES
