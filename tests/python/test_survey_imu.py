# SPDX-License-Identifier: Apache-2.0
"""Surveys whose scale is that of an inertial measurement unit, as a table or in a bag."""

import json

import numpy as np
import pytest
from stream_support import write_bag
from test_survey_follow import PLACES_M, errors_m

import libocc as occ
from libocc.cli.survey.imu import COLUMNS, EUROC_COLUMNS, read_imu

CAM_FROM_IMU = np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]])
CLOCK_S = 12.34  # of the unit, at the first frame
FRAMES, FPS, RATE_HZ = 36, 4, 100


def room():
    camera = occ.Camera.pinhole(width=640, height=480, fx_px=280, fy_px=280, cx_px=319.5, cy_px=239.5)
    lamps = [occ.Lamp(id=k, centre_m=at, radius_m=0.08, power_w=0.5) for k, at in enumerate(PLACES_M)]
    return occ.Scene(camera=camera, lamps=lamps)


def pose_at(time_s):
    """Hand that walks slowly and shakes."""
    at = np.array([1.9 + 0.6 * np.sin(0.5 * time_s) + 0.03 * np.sin(5 * time_s),
                   1.6 + 0.5 * np.sin(0.4 * time_s + 1) + 0.03 * np.cos(4 * time_s), 0.3 + 0.1 * np.sin(1.3 * time_s)])
    turn = 0.4 * np.sin(0.6 * time_s)
    target = at + [0.3 * np.sin(0.9 * time_s), 0.25 * np.sin(1.1 * time_s + 2), 2]
    return np.asarray(occ.look_at(at, target, up=[np.cos(turn), np.sin(turn), 0]))


def imu_rows():
    """Samples (n, 7) from a second before the first frame to a second after the last."""
    h, rows = 2e-3, []

    def world_from_imu(time_s):
        pose = pose_at(time_s)
        return pose[:3, :3].T @ CAM_FROM_IMU, -pose[:3, :3].T @ pose[:3, 3]

    random = np.random.default_rng(1)
    for time_s in np.arange(-1, FRAMES / FPS + 1, 1 / RATE_HZ):
        (before, p0), (now, p1), (after, p2) = (world_from_imu(time_s + k * h) for k in (-1, 0, 1))
        turn = (now.T @ (after - before)) / (2 * h)
        force = now.T @ ((p2 - 2 * p1 + p0) / h**2 + [0, 0, 9.81])
        rate = [turn[2, 1], turn[0, 2], turn[1, 0]] + random.normal(0.01, 0.001, 3)
        rows.append([time_s + CLOCK_S, *rate, *(force + random.normal(0.02, 0.02, 3))])
    return np.array(rows)


def write_table(path, columns=COLUMNS, rows=None, unit_s=1.0):
    rows = imu_rows() if rows is None else rows
    lines = [",".join([f"{row[0] / unit_s:.9g}" if unit_s == 1 else f"{row[0] / unit_s:.0f}",
                       *(f"{value:.9g}" for value in row[1:])]) for row in rows]
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    return path


@pytest.fixture(scope="module")
def frames():
    scene = room()
    renderer = occ.Renderer(scene)
    return [(k / FPS, np.asarray(renderer.render(pose_at(k / FPS), frame=k, start_s=k / FPS)[0]), pose_at(k / FPS))
            for k in range(FRAMES)]


@pytest.fixture
def recording(frames, tmp_path):
    (tmp_path / "walk").mkdir()
    for k, (_, image, _) in enumerate(frames):
        occ.write_image(tmp_path / "walk" / f"{k:04d}.png", image)
    scene = room()
    scene.save(tmp_path / "room.yaml")
    return scene


def check(found, scene, text):
    off_m, order = errors_m(scene, found)
    assert len(found.lamps) == 7 and off_m.max() < 0.003
    true, made = (np.array([lamp.centre_m for lamp in s.lamps]) for s in (scene, found))
    spread = [np.linalg.norm(at - at.mean(axis=0)) for at in (made, true[order])]
    assert "scale of the inertial measurements to " in text
    assert abs(spread[0] / spread[1] - 1) < 3.5 * found.map_scale_sigma
    assert found.map_scale_sigma < 0.02


def test_the_scale_is_that_of_a_table(libocc, recording, tmp_path):
    write_table(tmp_path / "imu.csv")
    code, text, errors = libocc(
        "survey", "walk", "--fps", FPS, "--camera", "room.yaml", "--imu", "imu.csv", "--out", "made"
    )
    assert code == 0, errors
    check(occ.Scene.load(tmp_path / "made" / "scene.yaml"), recording, text)
    data = json.loads((tmp_path / "made" / "result.json").read_text())
    assert data["scale"] == "imu"
    assert data["inertial"]["time_offset_s"] == pytest.approx(CLOCK_S, abs=2e-3)
    assert data["inertial"]["cam_from_imu"] == pytest.approx(CAM_FROM_IMU, abs=0.01)
    assert "deg from the vertical" in data["assumed"][1]
    times_s = occ.Trajectory.load(tmp_path / "made" / "trajectory.tum").times_s
    assert times_s[1] - times_s[0] == pytest.approx(1 / FPS)


def test_the_scale_is_that_of_a_topic(libocc, frames, tmp_path):
    pytest.importorskip("rosbags")
    scene = room()
    scene.save(tmp_path / "room.yaml")
    for name in ("walk.bag", "walk2"):
        write_bag(tmp_path / name, [(1 + time_s, image, pose) for time_s, image, pose in frames], imu=imu_rows())
        code, text, errors = libocc("survey", name, "--camera", "room.yaml", "--imu", "/imu", "--out", name + "-out")
        assert code == 0, errors
        check(occ.Scene.load(tmp_path / (name + "-out") / "scene.yaml"), scene, text)
    code, _, errors = libocc("survey", "walk2", "--camera", "room.yaml", "--imu", "/other", "--out", "out")
    assert code == 2 and "is no file, and no topic of walk2" in errors and "/imu" in errors


def test_tables_of_euroc_are_read(tmp_path):
    rows = imu_rows()[:5]
    path = write_table(tmp_path / "data.csv", EUROC_COLUMNS, rows, 1e-9)
    assert read_imu(str(path), "walk.mp4") == pytest.approx(rows, rel=1e-8)


def test_the_motion_of_another_recording_gives_no_scale(libocc, recording, tmp_path):
    rows = imu_rows()
    rows[:, 1:4] = rows[::-1, 1:4]
    write_table(tmp_path / "imu.csv", rows=rows)
    code, text, errors = libocc(
        "survey", "walk", "--fps", FPS, "--camera", "room.yaml", "--imu", "imu.csv", "--out", "made"
    )
    assert code == 0, errors
    assert "the inertial measurements give no scale: the camera turns by" in text
    assert "scale free" in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows[:1], "fewer than two samples"),
        (lambda rows: rows[[0, 2, 1]], "sample 2: its time"),
        (lambda rows: rows * [1, 1, 1, 1, 0.1, 0.1, 0.1], "it must contain gravity, in m/s^2"),
    ],
)
def test_invalid_samples_are_named(libocc, recording, tmp_path, change, message):
    write_table(tmp_path / "imu.csv", rows=change(imu_rows()))
    code, _, errors = libocc(
        "survey", "walk", "--fps", FPS, "--camera", "room.yaml", "--imu", "imu.csv", "--out", "made"
    )
    assert code == 2
    assert "imu.csv" in errors and message in errors


def test_samples_need_a_recording(libocc, recording, tmp_path):
    write_table(tmp_path / "imu.csv")
    code, _, errors = libocc("survey", "walk", "--camera", "room.yaml", "--imu", "imu.csv", "--out", "made")
    assert code == 2 and "--imu: needs a recording" in errors
    code, _, errors = libocc(
        "survey", "walk", "--fps", FPS, "--camera", "room.yaml", "--imu", "none.csv", "--out", "made"
    )
    assert code == 2 and "none.csv" in errors
