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
from document_blocks import Example, blocks, run_console, run_python

import libocc as occ
from libocc import _core, _moved, pose

ROOT = Path(__file__).resolve().parents[2]

USER = """
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
"""


def submodule(name: str) -> ModuleType:
    return importlib.import_module(f"libocc.{name}")


def pages(root: Path) -> list[Path]:
    """Documents whose examples run and whose links are checked."""
    found = [p for p in sorted((root / "docs").rglob("*.md")) if "generated" not in p.parts]
    return [*sorted(root.glob("*.md")), *found]


def page_names() -> list[str]:
    return [str(p.relative_to(ROOT)) for p in pages(ROOT)]


@pytest.mark.parametrize("name", page_names())
def test_examples_print_the_documented_output(
    root: Path, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "data").symlink_to(root / "data")
    monkeypatch.chdir(tmp_path)
    for example in blocks(root / name):
        if example.language == "python":
            run_python(example)
        elif example.language == "console":
            run_console(example)
        else:
            run_cpp(example, root)


def run_cpp(example: Example, root: Path) -> None:
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler")
    library = Path(occ.__file__).parent
    Path("example.cpp").write_text(example.code)
    command = ["c++", "-std=c++17", "-DEIGEN_MAX_ALIGN_BYTES=16", "-DEIGEN_MALLOC_ALREADY_ALIGNED=1"]
    command += [f"-I{root}", "-isystem", "/usr/include/eigen3", "example.cpp"]
    command += ["-o", "example", f"-L{library}", "-locc", f"-Wl,-rpath,{library}"]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    ran = subprocess.run(["./example"], capture_output=True, text=True)
    assert ran.returncode == 0 and ran.stdout.strip() == example.printed, ran.stderr


def test_a_wrong_output_is_an_error(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```python\nprint(1 + 1)\n```\n\nprints `3`.\n\n```console\n$ libocc --version\nlibocc 9\n```\n")
    python, console = blocks(page)
    with pytest.raises(AssertionError, match="printed"):
        run_python(python)
    with pytest.raises(AssertionError, match="--version"):
        run_console(console)
    page.write_text("```python\nprint(1)\n```\nsome text\n")
    with pytest.raises(ValueError, match="page.md:2: no sentence"):
        list(blocks(page))


def test_a_moved_name_in_an_example_is_an_error(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```python\nimport libocc as occ\nprint(occ.adjust.__name__)\n```\n\nprints `adjust`.\n")
    with pytest.raises(DeprecationWarning, match="network"):
        run_python(*blocks(page))


def test_readme_first_example_has_five_lines(root: Path) -> None:
    code = next(blocks(root / "README.md")).code
    assert len([line for line in code.splitlines() if line.strip()]) <= 5


def headings(path: Path) -> set[str]:
    """Anchors of a page: its headings in lower case with dashes, as on GitHub, and explicit targets."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-") for title in titles]
    return set(plain) | set(re.findall(r"^\((.*)\)=$", text, re.MULTILINE))


def links(text: str) -> list[str]:
    """Relative links of a page, images included."""
    text = re.sub(r"^```(?!\{).*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    found = re.findall(r"\]\(([^)\s]+)\)", text)
    found += re.findall(r"^```\{(?:include|figure|image)\} (\S+)", text, re.MULTILINE)
    return [link for link in found if not re.match(r"https?://|mailto:", link)]


def broken_links(page: Path) -> list[str]:
    broken = []
    for link in links(page.read_text()):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        if not target.exists() or (anchor and anchor not in headings(target)):
            broken.append(link)
    return broken


def linked_pages() -> list[str]:
    return [*page_names(), *(str(p.relative_to(ROOT)) for p in sorted((ROOT / "data").glob("*/README.md")))]


@pytest.mark.parametrize("name", linked_pages())
def test_links_lead_to_files_and_headings(root: Path, name: str) -> None:
    assert broken_links(root / name) == []


def test_a_broken_link_is_found(tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# A title\n")
    page = tmp_path / "page.md"
    page.write_text("[a](other.md#a-title) [b](other.md#none) ![c](none.png) [d](#here)\n")
    assert broken_links(page) == ["other.md#none", "none.png", "#here"]


@pytest.mark.parametrize("name", page_names())
def test_named_files_exist(root: Path, name: str) -> None:
    """Every path in backquotes that begins with a folder of the sources exists."""
    named = re.findall(r"`((?:data|tools|libocc|tests|python|docs)/[\w./]+|LICENSE)`", (root / name).read_text())
    assert [each for each in named if not (root / each).exists()] == []


def test_every_page_is_in_a_table_of_contents(root: Path) -> None:
    listed = set()
    for page in (root / "docs").rglob("*.md"):
        for toc in re.findall(r"^```\{toctree\}\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE):
            listed |= {(page.parent / line.split("<")[-1].rstrip(">")).resolve() for line in toc.splitlines()}
    documents = [p for p in pages(root) if p.is_relative_to(root / "docs") and p != root / "docs" / "index.md"]
    assert [str(p) for p in documents if p.with_suffix("").resolve() not in listed] == []


def test_docstring_examples() -> None:
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    tried = 0
    for name, value in vars(_core).items():
        test = parser.get_doctest(getattr(value, "__doc__", None) or "", {}, name, None, None)
        if test.examples:
            tried += 1
            runner.run(test)
    assert tried >= 4 and runner.summarize().failed == 0


def test_everything_public_is_documented() -> None:
    public = [(occ, name) for name in occ.__all__]
    public += [(place, name) for place in map(submodule, _moved.NEW_HOMES) for name in place.__all__]
    assert len(public) > 280
    for place, name in public:
        value = getattr(place, name)
        assert value.__doc__, name
        for field, member in vars(value).items() if isinstance(value, type) else ():
            if isinstance(member, property):
                assert member.__doc__, f"{name}.{field}"


def test_types_pass_strict_mypy(root: Path, tmp_path: Path) -> None:
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


def test_the_readme_is_short(root: Path) -> None:
    assert len((root / "README.md").read_text().split()) <= 900


def test_the_page_lists_every_solver(root: Path) -> None:
    page = (root / "docs" / "results" / "pose_solvers.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| (.*)", page, re.MULTILINE)
    expected = []
    for s in occ.solvers():
        points = f"{s.min_points}" if s.max_points == s.min_points else f"{s.min_points} or more"
        expected.append((s.name, points, str(s.max_candidates), s.failures, s.source))
    missing = pose.missing_solvers()  # of a build without OpenCV or OpenGV
    cells = [(name, *(cell.strip() for cell in rest.split("|"))) for name, rest in rows if name not in missing]
    assert [(c[0], c[1], c[2], c[5], c[6]) for c in cells] == expected


def test_stubs_declare_every_name_of_the_module() -> None:
    pytest.importorskip("pybind11_stubgen")  # without it the package has no stubs
    stubs = Path(_core.__file__).with_name("_core.pyi")
    declared = set(re.findall(r"^(?:class|def) (\w+)|^(\w+):", stubs.read_text(), re.MULTILINE))
    names = {name for pair in declared for name in pair}
    assert {name for name in vars(_core) if not name.startswith("__")} <= names


def test_every_status_has_its_section(root: Path) -> None:
    """The page has a section and a row of its table for each status, and no others."""
    sections = headings(root / "docs" / "troubleshooting.md")
    assert {name for name in occ.Status.__members__} <= sections
    table = re.findall(r"^\| \[`(\w+)`\]", (root / "docs" / "troubleshooting.md").read_text(), re.MULTILINE)
    assert sorted(table) == sorted(occ.Status.__members__)


def test_pictures_of_statuses_show_them(root: Path, tmp_path: Path) -> None:
    ran = subprocess.run([sys.executable, root / "tools" / "status_pictures", tmp_path], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    drawn = dict(line.split(".png: ") for line in ran.stdout.splitlines())
    assert drawn and all(statuses.split(", ")[0] == name for name, statuses in drawn.items())
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in (root / "docs/pictures").glob("*.png"))


def test_pictures_of_calibrations_show_the_mistakes(root: Path, tmp_path: Path) -> None:
    script = root / "tools" / "calibration_pictures"
    ran = subprocess.run([sys.executable, script, tmp_path], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    drawn = dict(line.split(".png: ") for line in ran.stdout.splitlines())
    folder = root / "docs" / "pictures" / "calibration"
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in folder.iterdir())

    def numbers(name: str, pattern: str) -> tuple[float, float]:
        good, bad = (float(re.findall(pattern, panel)[0]) for panel in drawn[name].split("; "))
        return good, bad

    for name in ("frontal", "middle"):
        good, bad = numbers(name, r"sigma (\S+) px")
        assert good < 1 and bad > 4 * good
    for name in ("coefficients", "bent"):
        good, bad = numbers(name, r"sigma0 ([\d.]+)")
        assert 0.9 < good < 1.1 and bad > 5
    good, bad = numbers("zoom", r", (\d+) of")
    assert good == 0 and bad > 35
