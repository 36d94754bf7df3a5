# SPDX-License-Identifier: Apache-2.0
"""The programs in examples/ run."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stream_support import FPS, render, walk, write_folder

import libocc as occ

Build = Callable[[str], Path]
Ran = subprocess.CompletedProcess[str]
MAX_LINES = 60  # of a program, without comments and empty lines


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, scene: occ.Scene) -> Path:
    return Path(write_folder(tmp_path_factory.mktemp("walk"), render(scene, 6)))


@pytest.fixture(scope="module")
def build(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compiles an example in C++."""
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler")

    def compiled(name: str) -> Path:
        program = tmp_path_factory.mktemp("example") / name
        library = Path(occ.__file__).parent
        command = ["c++", "-std=c++17", "-Wall", "-Wextra", "-Werror"]
        command += ["-DEIGEN_MAX_ALIGN_BYTES=16", "-DEIGEN_MALLOC_ALREADY_ALIGNED=1", f"-I{root}"]
        command += ["-isystem", "/usr/include/eigen3", str(root / "examples" / f"{name}.cpp"), "-o", str(program)]
        command += [f"-L{library}", "-locc", f"-Wl,-rpath,{library}"]
        built = subprocess.run(command, capture_output=True, text=True)
        assert built.returncode == 0, built.stderr
        return program

    return compiled


@pytest.fixture
def python(root: Path, tmp_path: Path) -> Callable[..., Ran]:
    """Runs an example in Python, in a temporary folder."""

    def run(name: str, *arguments: Any) -> Ran:
        command = [sys.executable, str(root / "examples" / name), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)

    return run


@pytest.fixture
def room(root: Path) -> Path:
    return root / "data" / "scenes" / "irregular_six.yaml"


def called(*command: Any) -> Ran:
    return subprocess.run([str(word) for word in command], capture_output=True, text=True)


def programs(root: Path) -> list[Path]:
    return sorted(p for p in (root / "examples").iterdir() if p.suffix in (".cpp", ".py"))


def test_every_example_is_short_listed_and_tested(root: Path) -> None:
    listed = re.findall(r"^\| `([\w.]+)`", (root / "examples" / "README.md").read_text(), re.MULTILINE)
    assert sorted(listed) == [program.name for program in programs(root)] and len(listed) >= 5
    tests = Path(__file__).read_text()
    for program in programs(root):
        assert f'"{program.stem if program.suffix == ".cpp" else program.name}"' in tests
        code = [line.strip() for line in program.read_text().splitlines()]
        assert len([line for line in code if line and not line.startswith(("//", "#"))]) <= MAX_LINES, program.name


def test_cpp_follows_a_folder(build: Build, room: Path, tmp_path: Path, folder: Path) -> None:
    program = build("follow_folder")
    ran = called(program, room, folder / "images", FPS)
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr.splitlines()[0].split()[:3] == ["0", "s", "tracking"]
    found = occ.Trajectory.parse(ran.stdout)
    assert len(found) == 6
    true_pose = walk().cam_from_world(walk().begin_s + 5 / FPS)
    assert np.abs(found.cam_from_world(5 / FPS) - true_pose).max() < 2e-3

    mixed = tmp_path / "mixed"  # further files: not an image, an image of another size, a broken one, a folder
    shutil.copytree(folder / "images", mixed)
    (mixed / "000002a.png").write_text("not an image")
    occ.write_image(str(mixed / "000003a.png"), np.zeros((30, 40), np.uint8))
    (mixed / "000004a.png").write_bytes((mixed / "000004.png").read_bytes()[:500])
    (mixed / "notes").mkdir()
    ran = called(program, room, mixed, FPS)
    skipped = [line for line in ran.stderr.splitlines() if " s skipped " in line]
    assert ran.returncode == 0 and len(skipped) == 4, ran.stderr
    for line, name in zip(skipped, ("000002a.png: ", "000003a.png: ", "000004a.png: ", "notes: "), strict=True):
        assert name in line
    assert "not an image" in skipped[0] and "40" in skipped[1]


def test_cpp_follow_folder_refuses_bad_arguments_in_one_line(build: Build, room: Path, tmp_path: Path) -> None:
    program = build("follow_folder")
    for arguments, message in (
        ((), "usage"),
        ((room, tmp_path, "fast"), "usage"),
        ((room, tmp_path, "-1"), "usage"),
        (("none.yaml", tmp_path, 10), "none.yaml"),
        ((room, tmp_path / "none", 10), "none"),
    ):
        ran = called(program, *arguments)
        assert ran.returncode == 2 and message in ran.stderr and ran.stderr.count("\n") == 1, ran.stderr
    assert called(program, room, tmp_path, 10).returncode == 1  # a folder without images has no pose


def test_cpp_locates_a_picture(build: Build, root: Path, room: Path) -> None:
    program = build("locate_picture")
    ran = called(program, room, root / "data" / "images" / "irregular_six_1.png")
    assert ran.returncode == 0, ran.stderr
    position = [float(word) for word in re.findall(r"position +(\S+) +(\S+) +(\S+) m", ran.stdout)[0]]
    assert np.abs(np.array(position) - [1.9, 2.1, 0.3]).max() < 1e-3
    square = root / "data" / "scenes" / "square_four.yaml"
    ran = called(program, square, root / "data" / "images" / "square_four_1.png")
    assert ran.returncode == 1 and ran.stdout.startswith("ambiguous") and ran.stdout.count("position") >= 4
    ran = called(program, room, room)
    assert ran.returncode == 2 and ran.stderr.startswith("error: ") and "irregular_six.yaml" in ran.stderr


def test_cpp_solves_for_the_pose_of_own_points(build: Build) -> None:
    ran = called(build("own_points"))
    assert ran.returncode == 0, ran.stdout
    assert [line.split(": ")[0] for line in ran.stdout.splitlines()] == ["auto", "sqpnp", "epnp", "upnp", "dlt"]


def test_python_follows_a_source(python: Callable[..., Ran], room: Path, folder: Path) -> None:
    ran = python("follow_source.py", room, folder)
    assert ran.returncode == 0, ran.stderr
    lines = ran.stdout.splitlines()
    assert len(lines) == 6 and lines[0] == "5.000 s 1.6 1.8 0.4 lamps 0 1 2 3 4 5"


def test_python_locates_and_draws(python: Callable[..., Ran], root: Path, room: Path, tmp_path: Path) -> None:
    ran = python("locate_and_draw.py", room, root / "data" / "images" / "irregular_six_1.png", "overlay.png")
    assert ran.returncode == 0, ran.stderr
    position = [float(word) for word in re.findall(r"^position (\S+) (\S+) (\S+) m", ran.stdout, re.MULTILINE)[0]]
    assert ran.stdout.startswith("ok") and np.abs(np.array(position) - [1.9, 2.1, 0.3]).max() < 1e-3
    assert occ.read_image(str(tmp_path / "overlay.png")).std() > 5


def test_python_makes_synthetic_data(python: Callable[..., Ran], room: Path, scene: occ.Scene, tmp_path: Path) -> None:
    ran = python("synthetic_data.py", room, "data", 3)
    assert ran.returncode == 0, ran.stderr
    truths = json.loads((tmp_path / "data" / "truth.json").read_text())
    assert len(truths) == 3
    for truth in truths:
        image = occ.read_image(str(tmp_path / "data" / truth["image"]))
        blobs = np.array([blob.centroid_px for blob in occ.detect(image, sensor=scene.sensor)])
        for centre in truth["lamps"].values():
            if 20 < centre[0] < 619 and 20 < centre[1] < 459:  # not cut by the border
                assert np.linalg.norm(blobs - centre, axis=1).min() < 0.5


def test_python_calibrates_from_boards(python: Callable[..., Ran], tmp_path: Path) -> None:
    ran = python("calibrate_from_boards.py", "camera.yaml")
    assert ran.returncode == 0, ran.stderr
    assert "12 of 12 pictures" in ran.stdout
    camera = occ.read_camera(str(tmp_path / "camera.yaml"))
    assert np.abs([camera.fx_px - 640, camera.fy_px - 642, camera.cx_px - 405, camera.cy_px - 296]).max() < 0.5


def test_python_plans_accuracy(python: Callable[..., Ran], room: Path) -> None:
    ran = python("plan_accuracy.py", room, 0.5)
    assert ran.returncode == 0, ran.stderr
    rows = [line.split()[1:] for line in ran.stdout.splitlines()[2:]]
    sigmas_mm = [float(word) for row in rows for word in row if word != "-"]
    assert len(rows) == 5 and len(sigmas_mm) >= 8 and 0.02 < min(sigmas_mm) < max(sigmas_mm) < 5
