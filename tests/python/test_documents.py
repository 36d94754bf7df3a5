# SPDX-License-Identifier: Apache-2.0
"""Examples and statements in the README, the docstrings and the types are correct."""

import doctest
import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import libocc as occ
from libocc import _core, _moved

USER = '''
import numpy as np
import libocc as occ

scene: occ.Scene = occ.Scene.load("room.yaml")
image = np.zeros((480, 640), np.uint8)
fix: occ.Fix = occ.locate(image, scene, occ.Prior(heading_rad=1.0), rung=occ.Rung.centres)
if fix.status is occ.Status.ambiguous:
    print([candidate.position_m.tolist() for candidate in fix.candidates])
blob: occ.Blob = fix.lamps[3]
x: float = float(blob.centroid_px[0])
lamp = occ.Lamp(id=1, centre_m=(0, 0, 3), normal=[0, 0, -1], radius_m=0.1, frequency_hz=None)
camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
pixels, truth = occ.simulate(occ.Scene(camera=camera, lamps=[lamp]), cam_from_world=np.eye(4), seed=1)
names: list[str] = [flux.name for flux in occ.FluxModel]
'''


def submodule(name: str) -> ModuleType:
    return importlib.import_module(f"libocc.{name}")


def examples(readme: Path, language: str) -> list[tuple[str, str]]:
    """Each fenced example with its output, given by the sentence after it."""
    pattern = rf"```{language}\n(.*?)```\n+prints `(.*?)`\."
    found = re.findall(pattern, readme.read_text(), re.DOTALL)
    assert found and len(found) == readme.read_text().count(f"```{language}\n")
    return found


def test_readme_python_examples_print_the_documented_output(root: Path):
    for code, printed in examples(root / "README.md", "python"):
        ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root)
        assert ran.returncode == 0, ran.stderr
        assert ran.stdout.strip() == printed


def test_readme_first_example_has_five_lines(root: Path):
    code = examples(root / "README.md", "python")[0][0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 5


def test_readme_cpp_example_prints_the_documented_output(root: Path, tmp_path: Path):
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler")
    library = Path(occ.__file__).parent
    (code, printed), = examples(root / "README.md", "cpp")
    (tmp_path / "example.cpp").write_text(code)
    command = ["c++", "-std=c++17", "-DEIGEN_MAX_ALIGN_BYTES=16", "-DEIGEN_MALLOC_ALREADY_ALIGNED=1"]
    command += [f"-I{root}", "-isystem", "/usr/include/eigen3", tmp_path / "example.cpp"]
    command += ["-o", tmp_path / "example", f"-L{library}", "-locc", f"-Wl,-rpath,{library}"]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    ran = subprocess.run([tmp_path / "example"], capture_output=True, text=True, cwd=root)
    assert ran.returncode == 0 and ran.stdout.strip() == printed, ran.stderr


def test_readme_links_to_existing_files(root: Path):
    """Every file and folder in links and backquotes of the README exists."""
    text = (root / "README.md").read_text()
    named = re.findall(r"\]\(([^)#]+)\)", text) + re.findall(
        r"`((?:data|tools|libocc|tests|python)/[\w./]+|LICENSE)`", text
    )
    assert len(named) >= 5
    assert [name for name in named if not (root / name).exists()] == []


def test_docstring_examples():
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    tried = 0
    for name, value in vars(_core).items():
        test = parser.get_doctest(getattr(value, "__doc__", None) or "", {}, name, None, None)
        if test.examples:
            tried += 1
            runner.run(test)
    assert tried >= 4 and runner.summarize().failed == 0


def test_everything_public_is_documented():
    public = [(occ, name) for name in occ.__all__]
    public += [(place, name) for place in map(submodule, _moved.NEW_HOMES) for name in place.__all__]
    assert len(public) > 280
    for place, name in public:
        value = getattr(place, name)
        assert value.__doc__, name
        for field, member in vars(value).items() if isinstance(value, type) else ():
            if isinstance(member, property):
                assert member.__doc__, f"{name}.{field}"


def test_types_pass_strict_mypy(root: Path, tmp_path: Path):
    pytest.importorskip("mypy")
    example = tmp_path / "user.py"
    example.write_text(USER)
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import libocc as occ\nocc.Lamp(id='door', centre_m=3).radius_m = 2\n")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(root / "build" / "mypy")]
    ran = subprocess.run([*command, "-p", "libocc"], capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stdout
    ran = subprocess.run([*command, example], capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stdout
    ran = subprocess.run([*command, wrong], capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode != 0 and "read-only" in ran.stdout and "arg-type" in ran.stdout


def test_readme_lists_every_solver(root):
    section = (root / "README.md").read_text().split("## Pose solvers")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (.*)", section, re.MULTILINE)
    expected = []
    for s in occ.solvers():
        points = f"{s.min_points}" if s.max_points == s.min_points else f"{s.min_points} or more"
        expected.append((s.name, points, str(s.max_candidates), s.failures, s.source))
    cells = [(name, *(cell.strip() for cell in rest.split("|"))) for name, rest in rows]
    assert [(c[0], c[1], c[2], c[5], c[6]) for c in cells] == expected


def test_stubs_declare_every_name_of_the_module():
    pytest.importorskip("pybind11_stubgen")  # without it the package has no stubs
    stubs = Path(_core.__file__).with_name("_core.pyi")
    declared = set(re.findall(r"^(?:class|def) (\w+)|^(\w+):", stubs.read_text(), re.MULTILINE))
    names = {name for pair in declared for name in pair}
    assert {name for name in vars(_core) if not name.startswith("__")} <= names
