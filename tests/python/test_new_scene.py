# SPDX-License-Identifier: Apache-2.0
"""`libocc new-scene` writes a scene that can be used at once and that documents each of its keys."""

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from exif_pictures import (
    EXPOSURE_TIME,
    F_NUMBER,
    FOCAL,
    FOCAL_35MM,
    HEIC_HEAD,
    PLANE_UNIT,
    PLANE_X,
    ZOOM,
    save_with_exif,
)

import libocc as occ

Run = Callable[..., tuple[int, str, str]]
SHAPES = ["disc", "rectangle", "lame", "polygon", "point"]
KEY = re.compile(r"^ *(?:- )?(#?)(?:- )?(\w+):")
SMALL = occ.Camera.pinhole(width=640, height=480, fx_px=450, fy_px=451, cx_px=318, cy_px=241, distortion=[0.1, 0, 0, 0])


def with_optional_keys(text: str) -> str:
    """The scene with all optional keys in use."""
    return re.sub(r"^( *)#(?=[\w-])", r"\1", text, flags=re.MULTILINE)


def parsed(tmp_path: Path, text: str) -> occ.Scene:
    (tmp_path / "parsed.yaml").write_text(text)
    return occ.Scene.load(tmp_path / "parsed.yaml")


def test_the_scene_renders_and_locates_as_it_is(libocc: Run) -> None:
    occ.write_camera("camera.yaml", SMALL)
    for lamps in range(4, 11):
        out = f"room{lamps}.yaml"
        assert libocc("new-scene", "--out", out, "--lamps", lamps, "--camera", "camera.yaml")[0] == 0
        scene = occ.Scene.load(out)
        assert len(scene.lamps) == lamps and scene.camera.fx_px == 450
        pose = occ.look_at(position_m=[2.1, 1.9, 0.2], target_m=[2.1, 1.9, 3], up=[0, 1, 0])
        image, _ = occ.simulate(scene, pose, seed=1)
        assert 100 < image.max() < 255  # as a phone's picture should be: bright, not saturated
        fix = occ.locate(image, scene)
        assert fix.ok, (lamps, fix.message)
        np.testing.assert_allclose(fix.position_m, [2.1, 1.9, 0.2], atol=1e-3)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_loads_and_renders(libocc: Run, shape: str) -> None:
    occ.write_camera("camera.yaml", SMALL)
    code, _, err = libocc(
        "new-scene", "--out", "a.yaml", "--shape", shape, "--size", 6, 5, 2.5, "--camera", "camera.yaml"
    )
    assert code == 0, err
    scene = occ.Scene.load("a.yaml")
    assert {lamp.shape.name for lamp in scene.lamps} == {shape}
    assert all(
        lamp.centre_m[2] == 2.5 and 0 < lamp.centre_m[0] < 6 and 0 < lamp.centre_m[1] < 5 for lamp in scene.lamps
    )
    assert scene.room is not None and scene.room.size_m.tolist() == [6, 5, 2.5]
    code, out, err = libocc("simulate", "a.yaml", "--position", 3, 2.5, 0.5)
    assert code == 0 and "none" not in out, err


def test_the_commands_in_its_comments_work(libocc: Run) -> None:
    assert libocc("new-scene", "--out", "room.yaml", "--size", 5, 4, 2.6)[0] == 0
    commands = re.findall(r"^#   libocc (.*)$", Path("room.yaml").read_text(), re.MULTILINE)
    assert len(commands) == 2
    for command in commands:
        code, _, err = libocc(*command.split())
        assert code == 0, err


@pytest.mark.parametrize("shape", SHAPES)
def test_optional_keys_can_be_used(libocc: Run, tmp_path: Path, shape: str) -> None:
    libocc("new-scene", "--out", "room.yaml", "--shape", shape, "--lamps", 2)
    text = Path("room.yaml").read_text()
    scene = parsed(tmp_path, with_optional_keys(text))
    assert len(scene.boxes) == 1 and len(scene.tags) == 1 and scene.sensor.row_time_s == 1e-5
    assert scene.lamps[0].frequency_hz == 2000 and scene.lamps[1].frequency_hz is None
    assert with_optional_keys(text) != text


@pytest.mark.parametrize("shape", SHAPES)
def test_every_key_has_a_comment_above_it(libocc: Run, shape: str) -> None:
    libocc("new-scene", "--out", "room.yaml", "--shape", shape)
    lines = Path("room.yaml").read_text().splitlines()
    keys = [(i, found) for i, found in enumerate(map(KEY.match, lines)) if found]
    assert len(keys) > 30
    documented = False
    for i, found in keys:
        above = lines[i - 1].strip()
        documented = above.startswith("# ") or (documented and KEY.match(above) is not None)
        assert documented, lines[i]
    optional = [found[2] for _, found in keys if found[1]]
    text = "\n".join(lines)
    assert text.count("If omitted:") + text.count("Optional") >= len(optional)
    assert max(map(len, lines)) <= 110


def test_defaults_in_the_comments_are_those_of_the_library(libocc: Run, tmp_path: Path) -> None:
    """Removes each key that has a default in its comment, and compares."""
    libocc("new-scene", "--out", "room.yaml")
    lines = with_optional_keys(Path("room.yaml").read_text()).splitlines(keepends=True)
    camera, lamp = "{width_px: 9, height_px: 9, fx_px: 9}", "{id: 0, centre_m: [0, 0, 3], radius_m: 0.1}"
    default = parsed(tmp_path, f"schema: libocc-scene/1\ncamera: {camera}\nlamps: [{lamp}]\n")
    checked = 0
    for i, line in enumerate(lines):
        key = re.match(r"^( +)(\w+):", line)
        before = i
        while key and lines[before - 1].strip().startswith("# "):
            before -= 1
        comment = " ".join(part.strip().removeprefix("# ") for part in lines[before:i])
        stated = re.search(r"If omitted: ([\d.e-]+?)[.,]?(?:\s|$)", comment)
        if not key or not stated:
            continue
        values = [getattr(part, key[2], None) for part in (default.sensor, default.lamps[0])]
        if key[2] == "half_power_deg":
            values = [np.degrees(default.lamps[0].half_power_rad)]
        known = [value for value in values if isinstance(value, float)]
        if known:
            assert known == [pytest.approx(float(stated[1]))], key[2]
            checked += 1
    assert checked >= 7


def test_a_camera_file_is_named_relative_to_the_scene(libocc: Run, tmp_path: Path) -> None:
    for folder in ("calibrated", "my room: 1"):
        Path(folder).mkdir()
    occ.write_camera("calibrated/camera.yaml", SMALL)
    code, out, _ = libocc("new-scene", "--out", "my room: 1/room.yaml", "--camera", "calibrated/camera.yaml")
    assert code == 0 and "640 x 480" in out
    assert occ.Scene.load("my room: 1/room.yaml").camera.cx_px == 318
    occ.write_camera("my room: 1/the camera: #2.yaml", SMALL)
    code, _, _ = libocc("new-scene", "--out", "room.yaml", "--camera", "my room: 1/the camera: #2.yaml")
    assert code == 0 and occ.Scene.load("room.yaml").camera.cx_px == 318


def test_a_picture_gives_size_exposure_and_focal_length(libocc: Run, tmp_path: Path) -> None:
    black = np.zeros((300, 400), np.uint8)
    save_with_exif(tmp_path / "a.jpg", black, {FOCAL_35MM: 26, EXPOSURE_TIME: 0.002, F_NUMBER: 1.5}, orientation=6)
    code, out, err = libocc("new-scene", "--out", "room.yaml", "--picture", "a.jpg")
    assert code == 0 and "400 x 300" in out and not err
    scene = occ.Scene.load("room.yaml")
    assert occ.read_image("a.jpg").shape == (scene.camera.height, scene.camera.width)  # not rotated
    assert scene.camera.fx_px == pytest.approx(26 * 500 / 43.267, rel=1e-4)
    sigmas = np.sqrt(scene.camera.parameter_covariance.diagonal()[:4])
    np.testing.assert_allclose(sigmas, [0.05 * scene.camera.fx_px] * 2 + [4, 4], rtol=1e-2)
    assert (scene.sensor.exposure_s, scene.sensor.f_number) == (0.002, 1.5)
    text = Path("room.yaml").read_text()
    assert "From a.jpg (EXIF FocalLengthIn35mmFilm 26 mm), accurate to about 5 %" in text
    save_with_exif(tmp_path / "b.jpg", black, {FOCAL: 4.0, PLANE_X: 2540.0, PLANE_UNIT: 2, FOCAL_35MM: 20})
    assert libocc("new-scene", "--out", "b.yaml", "--picture", "b.jpg")[0] == 0
    assert occ.Scene.load("b.yaml").camera.fx_px == pytest.approx(400)


def test_a_picture_without_focal_length_or_with_zoom_is_a_warning(libocc: Run, tmp_path: Path) -> None:
    occ.write_image("a.png", np.zeros((300, 400), np.uint8))
    code, _, err = libocc("new-scene", "--out", "a.yaml", "--picture", "a.png")
    assert code == 0 and "a.png: has no focal length in its EXIF data; camera.fx_px is a guess" in err
    assert occ.Scene.load("a.yaml").camera.width == 400 and "GUESS" in Path("a.yaml").read_text()
    save_with_exif(tmp_path / "b.jpg", np.zeros((300, 400), np.uint8), {FOCAL_35MM: 52, ZOOM: 2.0})
    code, _, err = libocc("new-scene", "--out", "b.yaml", "--picture", "b.jpg")
    assert code == 0 and "b.jpg: was taken with a digital zoom of 2" in err
    for tags in ({FOCAL_35MM: 0}, {FOCAL: 4.0, PLANE_X: 0.0}, {FOCAL: 4.0, PLANE_X: 2540.0, PLANE_UNIT: 9}):
        save_with_exif(tmp_path / "c.jpg", np.zeros((300, 400), np.uint8), tags)
        _, _, err = libocc("new-scene", "--out", "c.yaml", "--force", "--picture", "c.jpg")
        assert "no focal length" in err, tags


def test_measured_lamps_are_written(libocc: Run) -> None:
    lamps = [[0.76, 0.74, 2.49], [2.695, 0.81, 2.48], [1, 2, 2.5]]
    options = [argument for centre in lamps for argument in ("--lamp", *centre)]
    code, out, err = libocc("new-scene", "--out", "room.yaml", "--size", 3, 3, 2.5, "--radius", 0.06, *options)
    assert code == 0 and out.startswith("room.yaml: 3 lamps"), err
    scene = occ.Scene.load("room.yaml")
    assert [lamp.centre_m.tolist() for lamp in scene.lamps] == lamps
    assert [lamp.radius_m for lamp in scene.lamps] == [0.06] * 3
    assert scene.map_sigma_m is not None and scene.map_sigma_m.tolist() == [0.01] * 3  # a tape's
    assert libocc("new-scene", "--out", "examples.yaml")[0] == 0
    assert occ.Scene.load("examples.yaml").map_sigma_m is None  # positions that were not measured


def test_an_existing_file_is_replaced_only_by_force(libocc: Run) -> None:
    Path("room.yaml").write_text("mine")
    code, _, err = libocc("new-scene", "--out", "room.yaml")
    assert code == 2 and err == "error: room.yaml: exists already; --force replaces it\n"
    assert Path("room.yaml").read_text() == "mine"
    assert libocc("new-scene", "--out", "room.yaml", "--force")[0] == 0
    assert occ.Scene.load("room.yaml").lamps


@pytest.mark.parametrize(
    "options, text",
    [
        (["--out", "no/room.yaml"], "no/room.yaml: cannot be written"),
        (["--out", "room.yaml", "--camera", "absent.yaml"], "absent.yaml: cannot be read"),
        (["--out", "room.yaml", "--picture", "absent.jpg"], "absent.jpg"),
        (["--out", "room.yaml", "--picture", "text.jpg"], "text.jpg: is not an image that can be read"),
        (
            ["--out", "room.yaml", "--picture", "phone.heic"],
            "phone.heic: is a HEIC/HEIF picture, which cannot be read; set",
        ),
        (["--out", "room.yaml", "--camera", "camera.yaml", "--picture", "a.png"], "a.png: its size is 8 x 6 px"),
        (["--out", "room.yaml", "--size", "4", "4", "0"], "--size"),
        (["--out", "room.yaml", "--size", "4", "nan", "3"], "--size"),
        (["--out", "room.yaml", "--size", "4", "inf", "3"], "--size"),
        (["--out", "room.yaml", "--lamps", "0"], "--lamps"),
        (["--out", "room.yaml", "--shape", "round"], "--shape"),
        (["--out", "room.yaml", "--lamp", "1", "5", "3"], "--lamp 1 5 3: is outside the room of 4 x 4 x 3 m"),
        (["--out", "room.yaml", "--lamp", "1", "nan", "3"], "--lamp 1 nan 3: is outside"),
        (["--out", "room.yaml", "--lamp", "1", "1", "3", "--lamp", "1", "1", "3"], "have the same centre"),
        (["--out", "room.yaml", "--radius", "0"], "--radius"),
    ],
)
def test_wrong_input_writes_nothing(libocc: Run, options: list[str], text: str) -> None:
    occ.write_camera("camera.yaml", SMALL)
    occ.write_image("a.png", np.zeros((6, 8), np.uint8))
    Path("text.jpg").write_text("no picture")
    Path("phone.heic").write_bytes(HEIC_HEAD)
    before = sorted(os.listdir())
    code, _, err = libocc("new-scene", *options)
    assert code == 2 and text in err, err
    assert sorted(os.listdir()) == before
