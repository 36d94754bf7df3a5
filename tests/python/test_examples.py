# SPDX-License-Identifier: Apache-2.0
"""The programs in examples/ run."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stream_support import FPS, render, walk, write_folder

import libocc as occ


@pytest.fixture(scope="module")
def folder(tmp_path_factory, scene):
    return write_folder(tmp_path_factory.mktemp("walk"), render(scene, 6))


def test_the_cpp_example_follows_a_folder(root: Path, tmp_path: Path, folder: Path):
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler")
    code, program = root / "examples" / "follow_folder.cpp", tmp_path / "follow_folder"
    assert sum(bool(line.strip()) for line in code.read_text().split("int main")[1].splitlines()) <= 30
    library = Path(occ.__file__).parent
    command = ["c++", "-std=c++17", "-DEIGEN_MAX_ALIGN_BYTES=16", "-DEIGEN_MALLOC_ALREADY_ALIGNED=1"]
    command += [f"-I{root}", "-isystem", "/usr/include/eigen3", code, "-o", program]
    built = subprocess.run([*command, f"-L{library}", "-locc", f"-Wl,-rpath,{library}"], capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    scene = root / "data" / "scenes" / "irregular_six.yaml"
    ran = subprocess.run([program, scene, folder / "images", str(FPS)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr.splitlines()[0].split()[:3] == ["0", "s", "tracking"]
    found = occ.Trajectory.parse(ran.stdout)
    assert len(found) == 6
    true_pose = walk().cam_from_world(walk().begin_s + 5 / FPS)
    assert np.abs(found.cam_from_world(5 / FPS) - true_pose).max() < 2e-3
    assert subprocess.run([program], capture_output=True).returncode == 2


def test_the_python_example_follows_a_source(root: Path, folder: Path):
    program, scene = root / "examples" / "follow_source.py", root / "data" / "scenes" / "irregular_six.yaml"
    ran = subprocess.run([sys.executable, program, scene, folder], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    lines = ran.stdout.splitlines()
    assert len(lines) == 6 and lines[0] == "5.000 s 1.6 1.8 0.4 lamps 0 1 2 3 4 5"
