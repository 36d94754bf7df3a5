# SPDX-License-Identifier: Apache-2.0
"""Output, files, exit codes and errors of the command line."""

import json
import re
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

import libocc as occ
from libocc.cli import COMMANDS, main
from libocc.cli.prior_options import given

TIMES = re.compile(r"\d+\.\d+(?= ms)|(?<=detect )\d+\.\d+|(?<=identify )\d+\.\d+|(?<=refine )\d+\.\d+")


def comparable(text):
    """Text without times, which vary, and without column widths, which depend on them."""
    text = re.sub(r"─+", "─", TIMES.sub("#", text))
    return "\n".join(" ".join(line.split()) for line in text.strip().splitlines())


@pytest.fixture
def run(libocc):
    return libocc


@pytest.fixture
def room(run):
    code, _, _ = run("simulate", "irregular_six", "--position", 1.7, 2.1, 0.5, "--out", "room.png")
    assert code == 0
    return "room.png"


def is_picture(path):
    pixels = occ.read_image(path)
    return pixels.ndim == 3 and min(pixels.shape[:2]) > 300 and pixels.std() > 5


def example_of(command):
    """Command lines with their expected output at the start of a help text."""
    text = "\n".join(line.strip() for line in command.help.replace("\b", "").strip().splitlines())
    block = text.split("\n\n")[0]
    assert block.startswith("$ libocc"), "help opens with an example"
    parts = re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]
    return [part.rstrip().partition("\n")[::2] for part in parts]


# `camera` and `panorama` are tested in test_calibrate_pictures.py.
@pytest.mark.parametrize("name", [*COMMANDS, "calibrate lamps", "calibrate network"])
def test_help_starts_with_an_example_with_its_actual_output(name, run):
    command = main
    for word in name.split():
        command = command.get_command(click.Context(command), word)
    for line, expected in example_of(command):
        code, out, err = run(*line.split()[1:])
        assert code == 0, err
        printed, expected = comparable(out), comparable(expected)
        if expected.endswith("..."):
            assert printed.startswith(expected.removesuffix("..."))
        else:
            assert printed == expected


def test_identify_assigns_every_lamp(run, room):
    code, out, _ = run("identify", room, "--map", "irregular_six", "--json", "--overlay", "named.png")
    found = json.loads(out)
    assert code == 0 and found["status"] == "ok" and found["risk"] <= 1e-4
    assert found["poses"][0]["probability"] == pytest.approx(1 - found["risk"], abs=1e-6)
    assert sorted(found["poses"][0]["lamp_of_blob"].values()) == [0, 1, 2, 3, 4, 5]
    np.testing.assert_allclose(found["poses"][0]["position_m"], [1.7, 2.1, 0.5], atol=0.01)
    assert Path("named.png").read_bytes()[:4] == b"\x89PNG"
    code, out, _ = run("identify", room, "--map", "irregular_six")
    assert code == 0 and out.splitlines()[0] == "status  ok" and len(out.splitlines()) == 4


def test_identify_lists_all_poses_of_a_square(run):
    assert run("simulate", "square_four", "--position", 1.7, 1.8, 0.3, "--out", "s.png")[0] == 0
    code, out, _ = run("identify", "s.png", "--map", "square_four")
    assert code == 1 and "ambiguous" in out and len(out.splitlines()) == 4 + 4
    assert run("identify", "s.png", "--map", "square_four", "--prior-heading-deg", 10)[0] == 0


def test_identify_reports_the_symmetry(run):
    assert run("simulate", "square_four", "--position", 1.7, 1.8, 0.3, "--out", "s.png")[0] == 0
    _, out, _ = run("identify", "s.png", "--map", "square_four")
    assert "rotation by 180 deg about the vertical axis through (2, 2)" in out
    _, out, _ = run("identify", "s.png", "--map", "square_four", "--json")
    best, *rivals = json.loads(out)["poses"]
    assert best["symmetry"] is None
    for rival in rivals:
        assert rival["symmetry"]["kind"] == "rotation" and rival["symmetry"]["misfit_m"] < 1e-6
        moved = np.array(rival["symmetry"]["world_from_world"]) @ [*best["position_m"], 1]
        np.testing.assert_allclose(moved[:3], rival["position_m"], atol=0.01)


def test_a_last_fix_is_a_prior(run):
    assert run("simulate", "square_four", "--position", 1.6, 1.7, 0.3, "--out", "a.png")[0] == 0
    assert run("simulate", "square_four", "--position", 1.7, 1.8, 0.3, "--out", "b.png")[0] == 0
    code, out, _ = run("locate", "a.png", "square_four", "--prior-heading-deg", 10, "--json")
    assert code == 0
    Path("fix.json").write_text(out)
    last = ("--prior-last-pose", "fix.json")
    code, out, _ = run("locate", "b.png", "square_four", "--json", *last)
    assert code == 0
    np.testing.assert_allclose(json.loads(out)["position_m"], [1.7, 1.8, 0.3], atol=2e-3)
    code, _, err = run("identify", "b.png", "--map", "square_four", *last, "--prior-height", 2.5)
    assert code == 2 and "prior.height_m and prior.last_pose contradict each other" in err
    Path("fix.json").write_text("{}")
    code, _, err = run("identify", "b.png", "--map", "square_four", *last)
    assert code == 2 and "fix.json: has no cam_from_world" in err


def test_identify_rejects_an_image_of_another_camera(run, room):
    occ.write_image("small.png", np.zeros((40, 50), np.uint8))
    code, _, err = run("identify", "small.png", "--map", "irregular_six")
    assert code == 2 and "small.png: its size is 50 x 40, that of the camera of irregular_six" in err


def test_locate_prints_the_fix(run, room):
    code, out, _ = run("locate", room, "irregular_six")
    assert code == 0
    assert re.search(r"^status +ok$", out, re.MULTILINE)
    x, y, z = map(float, re.search(r"^position +(\S+) +(\S+) +(\S+) m$", out, re.MULTILINE).groups())
    assert (x, y, z) == pytest.approx((1.7, 2.1, 0.5), abs=2e-3)


def test_json_has_the_values_of_the_python_functions(run, room, scene):
    code, out, _ = run("locate", room, "irregular_six", "--json")
    data = json.loads(out)
    fix = occ.locate(occ.read_image(room), scene)
    assert code == 0 and data["ok"] is True and data["status"] == "ok"
    assert data["position_m"] == pytest.approx(fix.position_m.tolist(), abs=1e-12)
    assert np.shape(data["covariance"]) == (6, 6) and len(data["candidates"]) == 1
    assert sorted(map(int, data["lamps"])) == sorted(fix.lamps)

    code, out, _ = run("detect", room, "--json")
    assert code == 0 and len(json.loads(out)) == len(occ.detect(occ.read_image(room)))


def test_simulate_can_read_the_truth_that_it_writes(run, room):
    truth = json.loads(Path("room.json").read_text())
    assert truth["position_m"] == pytest.approx([1.7, 2.1, 0.5]) and truth["scene"] == "irregular_six"
    code, out, _ = run("simulate", "irregular_six", "--pose", "room.json", "--out", "b.png", "--json")
    assert code == 0 and np.allclose(json.loads(out)["cam_from_world"], truth["cam_from_world"])
    assert np.array_equal(occ.read_image("b.png"), occ.read_image(room))


@pytest.mark.parametrize(
    "options, heading_deg, axis",
    [
        ((), 0, (0, 0, 1)),
        (("--heading-deg", 90), 90, (0, 0, 1)),
        (("--heading-deg", -30, "--tilt-deg", 90, "--tilt-towards-deg", -30), None, (0.866, -0.5, 0)),
        (("--tilt-deg", 10, "--tilt-towards-deg", 90), 0, (0, 0.17365, 0.98481)),
        (("--look-at", 1.7, 3.1, 0.5), 0, (0, 1, 0)),
    ],
)
def test_simulate_turns_the_camera(run, options, heading_deg, axis):
    code, out, err = run("simulate", "irregular_six", "--position", 1.7, 2.1, 0.5, "--json", *options)
    assert code == 0, err
    pose = np.array(json.loads(out)["cam_from_world"])
    assert pose[2, :3] == pytest.approx(axis, abs=1e-3)
    assert np.linalg.inv(pose)[:3, 3] == pytest.approx([1.7, 2.1, 0.5], abs=1e-12)
    if heading_deg is not None:
        assert np.degrees(occ.guide.heading_rad(pose)) == pytest.approx(heading_deg, abs=1e-9)


def test_overlays_are_pictures(run, room):
    assert run("simulate", "irregular_six", "--position", 1, 1, 1, "--overlay", "a.png")[0] == 0
    assert run("detect", room, "--overlay", "b.png")[0] == 0
    assert run("locate", room, "irregular_six", "--overlay", "c.png")[0] == 0
    assert all(is_picture(path) for path in ("a.png", "b.png", "c.png"))


def test_an_overlay_of_nothing_is_still_a_picture(run):
    occ.write_image("black.png", np.zeros((480, 640), np.uint8))
    code, out, _ = run("locate", "black.png", "irregular_six", "--overlay", "o.png")
    assert code == 1 and "no_lamps" in out
    assert is_picture("o.png")


def test_an_ambiguous_fix_shows_its_candidates_and_returns_1(run):
    run("simulate", "square_four", "--position", 2.1, 1.9, 0.5, "--heading-deg", 20, "--out", "s.png")
    code, out, _ = run("locate", "s.png", "square_four", "--overlay", "o.png")
    assert code == 1 and "ambiguous" in out
    assert len(re.findall(r"^ +[1-4] +.* m +rms", out, re.MULTILINE)) == 4
    code, out, _ = run("locate", "s.png", "square_four", "--prior-heading-deg", 30)
    assert code == 0 and "status    ok" in out
    assert re.search(r"^position +2\.(10|09)\d* +1\.(90|89)\d* ", out, re.MULTILINE)


def test_demo_compares_with_the_truth(run):
    code, out, err = run("demo", "--out", "pictures", "--json")
    assert code == 0, err
    rows = json.loads(out)
    assert rows
    for row in rows:
        assert is_picture(f"pictures/{row['image']}.png")
        assert row["error_mm"] < 5 * row["sigma_mm"] + 1
    code, out, _ = run("demo", "--out", "pictures")
    assert all(column in out for column in ("lamp", "image", "error", "sigma", "time", "pictures"))


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("locate", "nosuch.png", "irregular_six"), "nosuch.png"),
        (("locate", "room.png", "nosuch.yaml"), "nosuch.yaml"),
        (("locate", "text.png", "irregular_six"), "text.png"),
        (("locate", "cut.png", "irregular_six"), "cut.png"),
        (("locate", "small.png", "irregular_six"), "small.png: .*40"),
        (("locate", "room.png", "bad.yaml"), r"bad\.yaml.*schema"),
        (
            ("locate", "room.png", "irregular_six", "--prior-heading-deg", 0, "--prior-heading-sigma-deg", -1),
            "heading_sigma",
        ),
        (("locate", "room.png", "irregular_six", "--overlay", "nowhere/o.png"), "nowhere/o.png"),
        (("detect", "nosuch.png"), "nosuch.png"),
        (("detect", "room.png", "--threshold-dn", "nan"), "--threshold-dn"),
        (("simulate", "irregular_six", "--position", 1, 1, 1, "--out", "nowhere/o.png"), "nowhere/o.png"),
        (("simulate", "irregular_six"), "--position"),
        (("simulate", "irregular_six", "--pose", "text.png"), "text.png"),
        (("simulate", "irregular_six", "--position", 1, 1, 1, "--look-at", 1, 1, 1), "look-at"),
        (("demo", "--out", "text.png/folder"), "text.png"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(run, room, arguments, text):
    Path("text.png").write_text("not an image")
    Path("cut.png").write_bytes(Path(room).read_bytes()[:3000])
    Path("bad.yaml").write_text("lamps: []\n")
    occ.write_image("small.png", np.zeros((30, 40), np.uint8))
    code, out, err = run(*arguments)
    assert code == 2 and out == ""
    assert re.fullmatch(rf"error: .*{text}.*\n", err)


def test_the_installed_command_runs_as_a_process(tmp_path: Path):
    libocc = Path(sys.executable).with_name("libocc")
    ran = subprocess.run([libocc, "--version"], capture_output=True, text=True)
    assert ran.returncode == 0 and occ.__version__ in ran.stdout
    ran = subprocess.run([libocc, "locate", "nosuch.png", "x"], capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 2 and ran.stdout == ""
    assert ran.stderr.startswith("error: ") and ran.stderr.count("\n") == 1


def test_locating_waits_for_no_picture_or_table_library(tmp_path: Path):
    """Importing matplotlib and rich takes longer than a fix; only plots and tables import them."""
    program = (
        "import sys\nimport libocc.cli.commands.locate, libocc.cli.commands.detect\n"
        "print([m for m in ('matplotlib', 'rich') if m in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert ran.stdout.strip() == "[]", ran.stderr


def test_an_empty_prior_is_none():
    assert given(occ.Prior()) is None and given(occ.Prior(heading_sigma_rad=0.1)) is None
    pose = (np.eye(4), np.eye(6))
    values = {
        "position_m": [1, 1, 1], "height_m": 1, "heading_rad": 0.0, "gravity_in_cam": [0, 0, 1], "last_pose": pose,
    }  # fmt: skip
    for key, value in values.items():
        prior = occ.Prior(**{key: value})
        assert given(prior) is prior


def test_a_picture_of_merged_blobs_gives_no_pose_without_a_prior(run):
    """Three pairs of lamps that touch: merged blobs are used only with a prior."""
    scene = occ.Scene.load(Path(__file__).parents[2] / "data/scenes/irregular_six.yaml")
    lamps = [
        lamp.replace(id=2 * i + j, centre_m=np.asarray(lamp.centre_m) + [0.12 * j, 0, 0])
        for i, lamp in enumerate(scene.lamps[:4]) for j in range(2)
    ]  # fmt: skip
    Path("pairs.yaml").write_text(scene.replace(lamps=lamps).format())
    assert run("simulate", "pairs.yaml", "--position", 1.9, 2.1, 0.3, "--out", "pairs.png")[0] == 0
    assert "merged" in run("detect", "pairs.png")[1]
    code, out, _ = run("locate", "pairs.png", "pairs.yaml")
    assert code == 1 and "too_few_lamps" in out
