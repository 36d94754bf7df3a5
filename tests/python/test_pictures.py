# SPDX-License-Identifier: Apache-2.0
"""The pictures of the documentation: the gallery is complete, and drawing code keeps texts and lines legible."""

import importlib.machinery
import importlib.util
import io
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

import libocc as occ
from libocc.cli import main
from libocc.cli.guide import pictures as guide_pictures
from libocc.cli.hard_cases import picture as hard_cases_picture
from libocc.cli.hard_cases.cases import catalogue
from libocc.cli.hard_cases.judge import Outcome
from libocc.cli.hard_cases.matrix import Cell
from libocc.cli.hard_cases.methods import Method
from libocc.guide.experiment import load_experiment

PAGE_PX, MIN_TEXT_PX = 830, 8.5  # width of a README; height of its smallest legible text

Tool = Callable[[str], ModuleType]


@pytest.fixture
def tool(root: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Tool]:
    """Imports a script of tools/, which has no ending."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    names = []

    def load(name: str) -> ModuleType:
        loader = importlib.machinery.SourceFileLoader(f"tool_{name}", str(root / "tools" / name))
        spec = importlib.util.spec_from_loader(loader.name, loader)
        assert spec is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[loader.name] = module
        names.append(loader.name)
        loader.exec_module(module)
        return module

    yield load
    for name in names:
        sys.modules.pop(name)


def gallery(root: Path) -> list[tuple[str, str, str]]:
    """Picture, script or command, and page of each row."""
    row = re.compile(r"^\| !\[[^]]+\]\((\S+)\) \| `([^`]+)`[^|]* \| \[[^]]+\]\((\S+)\) \|$", re.MULTILINE)
    text = (root / "docs" / "gallery.md").read_text()
    found = row.findall(text)
    assert len(found) == text.count("| ![")  # no row has another form
    return found


def test_the_gallery_lists_every_picture_once(root: Path) -> None:
    listed = [(root / "docs" / picture).resolve() for picture, _, _ in gallery(root)]
    there = [path for folder in ("data", "docs") for kind in ("*.png", "*.jpg") for path in (root / folder).rglob(kind)]
    assert sorted(listed) == sorted(path.resolve() for path in there if "generated" not in path.parts)


def test_every_script_of_the_gallery_exists(root: Path) -> None:
    for picture, script, _ in gallery(root):
        if script.startswith("libocc "):
            command = main.get_command(click.Context(main), script.split()[1])
            assert command is not None, script
            options = {name for option in command.params for name in option.opts}
            assert {word for word in script.split() if word.startswith("--")} <= options, script
        else:
            assert (root / script).is_file(), script
            if script.startswith("tools/"):
                assert Path(picture).stem in (root / script).read_text(), f"{script} does not write {picture}"


def test_every_page_of_the_gallery_shows_its_picture(root: Path) -> None:
    """On the page itself, or in the README of data/ that the page includes."""
    for picture, _, page in gallery(root):
        path = root / "docs" / page
        text = path.read_text()
        for included in re.findall(r"^```\{include\} (\S+)", text, re.MULTILINE):
            text += (path.parent / included).read_text()
        assert Path(picture).name in text, f"{page} does not show {picture}"


def overlapping(texts: list[Any]) -> list[tuple[str, str]]:
    boxes = [(text.get_text(), Text.get_window_extent(text)) for text in texts if text.get_text()]
    return [(a, b) for (a, box), (b, other) in combinations(boxes, 2) if box.overlaps(other)]


def test_the_numbers_beside_the_points_of_identify_do_not_overlap(root: Path, tmp_path: Path, tool: Tool) -> None:
    module = tool("identify_curves")
    rows = module.stored(root / "data" / "identify" / "identify.csv")
    figure = module.draw(rows, tmp_path / "identify.png")
    labels = [text for axes in figure.axes for text in axes.texts]
    assert sorted(text.get_text() for text in labels) == sorted(str(row["lamps"]) for row in rows)
    assert [pair for axes in figure.axes for pair in overlapping(list(axes.texts))] == []


def test_the_stored_bit_errors_agree_with_the_rate_of_the_most_likely_symbol(root: Path, tool: Tool) -> None:
    """The union bound, an upper limit, does not agree with them."""
    module = tool("code_curves")
    rows = module.stored(root / "data" / "codes" / "codes.csv")
    far = 0
    for kind in module.kinds():
        of_kind = [row for row in rows if row["code"] == kind.name and row["kind"] == "bits"]
        expected = module.nearest_symbol_rates(kind, np.array([row["snr_db"] for row in of_kind]))
        for row, rate in zip(of_kind, expected, strict=True):
            symbols = 16 * row["trials"] / kind.bits
            sigma = np.sqrt(max(rate * (1 - rate), 1 / symbols) / symbols)
            assert abs(row["errors"] - rate) < 4 * sigma, (kind.name, row["snr_db"])
            far += abs(row["errors"] - float(row["expected"])) > 4 * sigma
            assert rate < float(row["expected"]) + 4 * sigma  # the union bound is a bound
    assert far >= 5


def test_stated_errors_agree_with_the_covariance_of_simulated_fixes(tmp_path: Path, tool: Tool) -> None:
    module = tool("stated_error_curves")
    outcomes = module.located(module.wrong_heights, 0.003, 12)
    error_mm, sigma_mm = module.curve([outcomes], lambda outcome: outcome.stated)[0]
    assert 0.5 * sigma_mm < error_mm < 1.6 * sigma_mm < 30
    points = [[outcomes for _ in sigmas] for *_, sigmas, _, _ in module.PANELS]
    module.draw(points, tmp_path / "stated_errors.png")
    assert (tmp_path / "stated_errors.png").stat().st_size > 10_000


def test_codes_are_redrawn_from_the_stored_table(
    root: Path, tmp_path: Path, tool: Tool, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = tool("code_curves")
    shutil.copy(root / "data" / "codes" / "codes.csv", tmp_path)
    monkeypatch.setattr(sys, "argv", ["code_curves", str(tmp_path), "--redraw"])
    assert module.main() == 0
    assert occ.read_image(tmp_path / "codes.png").std() > 5


def test_smoothing_gain_is_in_millimetres(tmp_path: Path, tool: Tool) -> None:
    module = tool("smoothing_gain")
    methods = module.measure(1)
    assert 20 < np.mean(methods["single frame"].errors_mm) < 80
    assert "mean mm" in module.table(methods)
    module.draw(methods, tmp_path / "gain.png")
    assert occ.read_image(tmp_path / "gain.png").std() > 5


def test_hard_cases_are_legible_at_the_width_of_a_page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    figures: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *args, **options: figures.append(figure))
    cases = list(catalogue())
    methods = [
        Method(f"solver_{i}", family, lambda instance: [])
        for i, family in enumerate(["libocc"] * 17 + ["OpenCV 5"] * 6)
    ]
    cells = [Cell(case.name, "", m.name, m.family) for case in cases for m in methods]
    for cell in cells:
        cell.counts[Outcome.solved] = 1
    hard_cases_picture.draw(tmp_path / "cases.png", cells, cases, methods)
    (figure,) = figures
    scale = PAGE_PX / (figure.get_figwidth() * 72)
    names = [text for text in figure.axes[0].texts if text.get_text() in {c.name.replace("_", " ") for c in cases}]
    assert len(names) == len(cases)
    assert min(float(text.get_fontsize()) for text in names) * scale >= MIN_TEXT_PX
    FigureCanvasAgg(figure).print_figure(io.BytesIO())
    titles = [*figure.texts, *names]
    assert overlapping(titles) == []
    assert min(Text.get_window_extent(text).x0 for text in titles) >= 0
    heads = [text for text in figure.axes[0].texts if text.get_text().startswith("solver_")]
    below = min(Text.get_window_extent(text).y0 for text in figure.texts)
    assert max(Text.get_window_extent(text).y1 for text in heads) < below


def test_paths_do_not_cover_the_route(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Figure] = []
    monkeypatch.setattr(guide_pictures, "save", lambda file, figure: figures.append(figure))
    experiment = load_experiment(str(root / "data" / "experiments" / "short_drive.yaml"))
    columns = {"true_x_m": np.array([1.6, 2.0]), "true_y_m": np.array([1.6, 1.6]), "state": np.array([1.0, 0.0])}
    guide_pictures.draw_paths(io.BytesIO(), experiment, [columns] * 30, "many runs")
    lines = {line.get_label(): line for line in figures[0].axes[0].lines}
    for name in ("driven", "without lamps"):
        assert lines[name].get_linewidth() <= lines["route"].get_linewidth() / 2
        assert lines[name].get_color() != lines["route"].get_color()
