# SPDX-License-Identifier: Apache-2.0
"""Codes in Python and `libocc decode`: ids, bad input, stripes, videos."""

import json
from pathlib import Path

import numpy as np
import pytest

import libocc as occ

FRAMES = 38


@pytest.fixture(scope="module")
def room(root: Path) -> occ.Scene:
    return occ.Scene.load(root / "data" / "scenes" / "ufsook_four.yaml")


@pytest.fixture(scope="module")
def view() -> np.ndarray:
    return occ.look_at([1.8, 2.1, 0.3], [1.9, 2.0, 3], up=[0, 1, 0])


@pytest.fixture(scope="module")
def images(room: occ.Scene, view: np.ndarray) -> list[np.ndarray]:
    renderer = occ.Renderer(room)
    return [renderer.render(view, frame=i, start_s=i / 30)[0].copy() for i in range(FRAMES)]


@pytest.fixture(scope="module")
def times_s() -> list[float]:
    return [i / 30 for i in range(FRAMES)]


@pytest.fixture
def folder(tmp_path: Path, room: occ.Scene, images: list[np.ndarray]) -> Path:
    """Folder as written by `libocc sequence`."""
    (tmp_path / "set" / "images").mkdir(parents=True)
    (tmp_path / "set" / "truth").mkdir()
    room.save(tmp_path / "set" / "scene.yaml")
    for i, image in enumerate(images):
        occ.write_image(tmp_path / "set" / "images" / f"{i:06d}.png", image)
        (tmp_path / "set" / "truth" / f"{i:06d}.json").write_text(json.dumps({"time_s": i / 30}))
    return tmp_path / "set"


def test_the_waveform_of_a_lamp_follows_from_its_code(room):
    lamp = room.lamps[0]
    wave = occ.codes.encode_id(lamp.id, lamp.code.code)
    assert lamp.waveform == wave.chips[0]
    assert lamp.frequency_hz == wave.frequency_hz
    bare = occ.Lamp(id=1, centre_m=[0, 0, 3], radius_m=0.1, code=occ.codes.LampCode(code=lamp.code.code, id=1))
    assert bare.waveform == lamp.waveform
    with pytest.raises(ValueError, match="id must be below 256"):
        bare.replace(code=occ.codes.LampCode(code=lamp.code.code, id=256), waveform=[])


def test_four_lamps_are_named_and_the_camera_is_found(room, view, images, times_s):
    found = occ.codes.decode(images, times_s, room.sensor, room.lamps[0].code.code, map=room, join_frames=0)
    assert found.ok
    assert sorted(blob.lamp_id for blob in found.blobs) == [1, 2, 3, 4]
    centres = {lamp.id: lamp.centre_m for lamp in room.lamps}
    points = np.array([centres[blob.lamp_id] for blob in found.blobs])
    fix = occ.solve_pose(points, [blob.centroid_px for blob in found.blobs], room.camera, sigma_px=0.1)
    assert fix.ok
    assert np.linalg.norm(fix.position_m - [1.8, 2.1, 0.3]) < 0.01


def test_budget_and_samples():
    code = occ.codes.Code()
    assert occ.codes.code_budget(code, rows=100, row_time_s=2e-5, exposure_s=2e-5).fits
    assert "12 chips" in occ.codes.code_budget(code, rows=60, row_time_s=2e-5, exposure_s=2e-5).message
    silent = occ.codes.decode_samples(code, [], 1e-5, [], 0.1)
    assert silent.status is occ.codes.CodeStatus.no_signal and silent.id is None
    with pytest.raises(ValueError, match="values must be as many as start_s"):
        occ.codes.decode_samples(code, [0.0, 1.0], 1e-5, [0.5], 0.1)


def test_frames_out_of_order_are_rejected(room, images):
    code = room.lamps[0].code.code
    with pytest.raises(ValueError, match=r"times_s\[2\] must be after the frame before it, at 0.2, got 0.1"):
        occ.codes.decode(images[:3], [0, 0.2, 0.1], room.sensor, code)
    with pytest.raises(ValueError, match=r"times_s\[1\] must be after"):
        occ.codes.decode(images[:2], [0.1, 0.1], room.sensor, code)
    with pytest.raises(ValueError, match="times_s must be as many as images, 2"):
        occ.codes.decode(images[:2], [0.1], room.sensor, code)
    with pytest.raises(ValueError, match=r"frames\[1\] must be like the first"):
        occ.codes.decode([images[0], images[1][:, :600].copy()], [0, 1], room.sensor, code)
    with pytest.raises(ValueError, match="frames must be one at least"):
        occ.codes.decode([], [], room.sensor, code)


def test_darkness_is_a_status(room):
    dark = [np.full((480, 640), 2, np.uint8)] * 3
    found = occ.codes.decode(dark, [0, 1, 2], room.sensor, room.lamps[0].code.code, map=room)
    assert found.status is occ.Status.no_lamps
    assert not found.lamps


def test_command_decodes_lamps_and_draws(libocc, folder: Path, tmp_path: Path):
    picture = tmp_path / "ids.png"
    code, out, err = libocc("decode", folder, "--still", "--overlay", picture)
    assert code == 0, err
    assert [line.split()[4] for line in out.splitlines()[1:5]]
    assert {line.split()[4] for line in out.splitlines()[1:5]} == {"1", "2", "3", "4"}
    assert "position 1.8" in out
    assert occ.read_image(picture).size > 10000
    code, out, _ = libocc("decode", folder, "--still", "--json")
    decoded = json.loads(out)
    assert sorted(lamp["lamp"] for lamp in decoded["lamps"]) == [1, 2, 3, 4]
    assert np.linalg.norm(np.array(decoded["position_m"]) - [1.8, 2.1, 0.3]) < 0.01


def test_missing_frames_do_no_harm(libocc, folder: Path):
    for i in (1, 2):  # whose bits are repeated by 35 and 36
        (folder / "images" / f"{i:06d}.png").unlink()
    code, out, _ = libocc("decode", folder, "--still")
    assert code == 0 and {line.split()[4] for line in out.splitlines()[1:5]} == {"1", "2", "3", "4"}
    for i in (10, 11):  # not repeated by another frame
        (folder / "images" / f"{i:06d}.png").unlink()
    assert ": more frames are needed" in libocc("decode", folder, "--still")[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["set", "--code", "ufsok"], "unknown code 'ufsok'; did you mean ufsook?"),
        (["set", "--line", "4b5b"], "--line: unknown '4b5b'; did you mean 4b6b?"),
        (["set", "--id-bits", "7"], "id_bits must be"),
        (["none"], "none: has no scene.yaml"),
        (["none", "--map", "ufsook_four"], "none: no such folder or video"),
        (["set", "--map", "irregular_six"], "--code must be given because no lamp of the map has a code"),
        (["empty", "--map", "ufsook_four"], "contains no images"),
    ],
)
def test_bad_input_is_one_line(libocc, folder: Path, monkeypatch, arguments, message):
    monkeypatch.chdir(folder.parent)
    (folder.parent / "empty").mkdir()
    code, _, err = libocc("decode", *arguments)
    assert code == 2
    assert message in err and err.count("\n") == 1


def test_times_must_be_known(libocc, folder: Path):
    (folder / "truth" / "000005.json").unlink()
    code, _, err = libocc("decode", folder)
    assert code == 2 and "000005.json: no such file, so the times of the frames are unknown: give --fps" in err
    assert libocc("decode", folder, "--still", "--fps", 30)[0] == 0
    (folder / "truth" / "000005.json").write_text("{}")
    code, _, err = libocc("decode", folder)
    assert code == 2 and "key `time_s`" in err


def test_a_code_that_lamps_cannot_hold_is_not_tried(libocc, folder: Path):
    code, out, _ = libocc("decode", folder, "--code", "c_ook", "--still")
    assert code == 1
    assert "not tried: the exposure is 2 of the chips" in out


def test_stripes(libocc, root: Path, tmp_path: Path):
    (tmp_path / "striped").mkdir()
    image = occ.read_image(root / "data" / "images" / "coded_four_1.png")
    for i in range(2):
        occ.write_image(tmp_path / "striped" / f"{i}.png", image)
    line = ["decode", tmp_path / "striped", "--code", "stripe", "--map", "coded_four", "--fps", 30]
    code, out, err = libocc(*line, "--json")
    assert code == 0, err
    assert [lamp["lamp"] for lamp in json.loads(out)] == [0, 1, 2, 3]
    assert "2" in libocc(*line)[1]


def test_a_video(libocc, folder: Path, images, tmp_path: Path, monkeypatch):
    cv2 = pytest.importorskip("cv2")
    path = str(tmp_path / "seen.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"FFV1"), 30, (640, 480))
    if not writer.isOpened():
        pytest.skip("this OpenCV writes no lossless video")
    for image in images:
        writer.write(cv2.merge([image] * 3))
    writer.release()
    code, out, err = libocc("decode", path, "--map", "ufsook_four", "--still")
    assert code == 0, err
    assert {line.split()[4] for line in out.splitlines()[1:5]} == {"1", "2", "3", "4"}
