# SPDX-License-Identifier: Apache-2.0
"""Annotated pictures: texts are legible and residuals agree with the fix."""

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

import libocc as occ
from libocc import samples
from libocc.cli import overlay
from libocc.cli.labels import Label, add_labels, text_size, wrapped

LONG = "4 poses match the image equally well; a prior (position, heading or gravity) or lamp codes can select one"
Draw = Callable[..., Figure]


def overlapping(texts: list[Any]) -> list[tuple[str, str]]:
    boxes = [(text.get_text(), Text.get_window_extent(text)) for text in texts if text.get_text()]
    return [(a, b) for (a, box), (b, other) in combinations(boxes, 2) if box.overlaps(other)]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Draw:
    """Calls a function of overlay; returns its figure, rendered."""
    figures = []
    print_figure = FigureCanvasAgg.print_figure

    def record(canvas: FigureCanvasAgg, *args: Any, **options: Any) -> Any:
        figures.append(canvas.figure)
        return print_figure(canvas, *args, **options)

    monkeypatch.setattr(FigureCanvasAgg, "print_figure", record)

    def call(draw: Callable[..., None], *args: Any, **options: Any) -> Figure:
        draw(tmp_path / "picture.png", *args, **options)
        return figures[-1]

    return call


def blob_at(x: float, y: float) -> occ.Blob:
    return occ.Blob(centroid_px=[x, y], covariance_px2=1e-4 * np.eye(2), x0=int(x) - 2, x1=int(x) + 3)


def test_labels_of_crowded_points_do_not_overlap() -> None:
    figure = Figure(figsize=(5, 4), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 100), ylim=(0, 80))
    random = np.random.default_rng(1)
    places = random.uniform(45, 55, (20, 2))
    written = add_labels(axes, [Label(f"lamp {i}", (x, y)) for i, (x, y) in enumerate(places)], 8)
    figure.canvas.draw()
    assert len(written) == 20 and overlapping(written) == []
    for text in written:  # inside the axes
        assert axes.bbox.x0 <= Text.get_window_extent(text).x0
        assert Text.get_window_extent(text).x1 <= axes.bbox.x1


def test_labels_avoid_obstacles_and_prefer_the_place_above() -> None:
    figure = Figure(figsize=(5, 4), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 500), ylim=(0, 400))
    above, below = add_labels(
        axes, [Label("a", (100, 200)), Label("b", (300, 200))], 8, obstacles=[(300, 200 + d) for d in range(5, 25, 2)]
    )
    figure.canvas.draw()
    assert above.get_window_extent().y0 > 200 and below.get_window_extent().y1 < 200


@pytest.mark.parametrize("text", [LONG, "x" * 300, "word " + "y" * 200 + " end", "two\nlines"])
def test_wrapped_text_is_complete_and_fits(text: str) -> None:
    figure = Figure(figsize=(5, 4), dpi=100)
    found = wrapped(figure, text, 400, 10)
    assert "".join(found.split()) == "".join(text.split())
    assert all(text_size(figure, line, 10)[0] <= 400 for line in found.split("\n"))
    assert wrapped(figure, "short", 400, 10) == "short"


@pytest.mark.parametrize("title", [LONG, "folder/" * 40 + "image.png"])
def test_every_text_lies_inside_the_picture(drawn: Draw, scene: occ.Scene, title: str) -> None:
    image, truth = occ.simulate(scene, occ.look_at([1.9, 2.1, 0.3], [1.9, 2.1, 3], up=[0, 1, 0]), seed=1)
    figure = drawn(overlay.draw_fix, image, occ.locate(image, scene), scene, title=title)
    texts = [*figure.texts, *(axes.xaxis.label for axes in figure.axes), *figure.axes[0].texts]
    shown = "".join(text.get_text() for text in figure.texts).replace("\n", "").replace(" ", "")
    assert title.replace(" ", "") in shown
    for text in texts:
        box = Text.get_window_extent(text)
        assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1, text.get_text()
        assert figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1, text.get_text()
    assert overlapping([text for text in texts if text.get_text()]) == []


def test_labels_of_neighbouring_blobs_do_not_overlap(drawn: Draw) -> None:
    blobs = [blob_at(300 + 9 * i, 200 + 7 * (i % 3)) for i in range(12)]
    figure = drawn(overlay.draw, np.zeros((480, 640), np.uint8), blobs=blobs)
    labels = [text for text in figure.axes[0].texts if text.get_text()]
    assert [text.get_text() for text in labels] == [str(i) for i in range(12)]
    assert overlapping(labels) == []


@pytest.mark.parametrize("rung", [None, occ.Rung.points, occ.Rung.centres, occ.Rung.direct])
@pytest.mark.parametrize("exposures", [1, 20], ids=["normal", "saturated"])
def test_residuals_in_the_picture_have_the_rms_of_the_fix(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, scene: occ.Scene, rung: occ.Rung | None, exposures: float
) -> None:
    large = scene.replace(
        lamps=[lamp.replace(radius_m=0.24) for lamp in scene.lamps],
        sensor=scene.sensor.replace(exposure_s=exposures * scene.sensor.exposure_s),
    )
    marks: list[overlay.Mark] = []
    monkeypatch.setattr(overlay, "_picture", lambda path, image, found, *rest: marks.extend(found))
    for lamps, at in ((6, [0.2, 0.2, 0.3]), (3, [0.2, 0.2, 0.3])):
        some = large.replace(lamps=large.lamps[:lamps])
        image, _ = occ.simulate(some, occ.look_at(at, [2.6, 2.5, 3], up=[0, 1, 0]), seed=1)
        prior = occ.Prior(position_m=at, position_sigma_m=0.3)
        fix = occ.locate(image, some, prior) if rung is None else occ.locate(image, some, prior, rung=rung)
        assert fix.candidates and not any(blob.cut_by_border for blob in fix.lamps.values())
        marks.clear()
        overlay.draw_fix(tmp_path / "picture.png", image, fix, some)
        residuals = np.array([mark.residual_px for mark in marks])
        assert len(residuals) == len(fix.lamps) >= 3
        assert np.sqrt((residuals**2).sum(axis=1).mean()) == pytest.approx(fix.rms_px, abs=1e-6)


def test_an_exact_fit_of_three_centres_is_marked(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, scene: occ.Scene
) -> None:
    captions: list[str] = []
    monkeypatch.setattr(overlay, "_picture", lambda *args: captions.append(args[5]))
    prior = occ.Prior(position_m=[1.9, 2.1, 0.3], position_sigma_m=0.3)
    for lamps in (3, 6):
        some = scene.replace(lamps=scene.lamps[:lamps])
        image, _ = occ.simulate(some, occ.look_at([1.9, 2.1, 0.3], [1.9, 2.1, 3], up=[0, 1, 0]), seed=1)
        fix = occ.locate(image, some, prior, rung=occ.Rung.centres)
        overlay.draw_fix(tmp_path / "picture.png", image, fix, some)
    assert "no check: a pose fits any three centres" in captions[0]
    assert "no check" not in captions[1] and "1 pose  " in captions[1]


def test_unused_blobs_have_a_reason_and_colours_are_kept(drawn: Draw) -> None:
    scene = samples.load_scene("irregular_six")
    grey, truth = occ.simulate(scene, occ.look_at([1.9, 2.1, 0.3], [1.9, 2.1, 3], up=[0, 1, 0]), seed=3)
    image = np.stack([grey, grey, grey // 2], axis=2)
    image[300:330, 40:90] = [40, 200, 90]  # a window
    image[0:9, 500:520] = 200  # cut by the border
    fix = occ.locate(image, scene)
    assert fix.ok
    reasons = [overlay.unused_reason(b, fix, scene) for b in fix.blobs if b.x0 < 95 and b.y0 > 290]
    assert reasons == ["shape of no lamp"]
    figure = drawn(overlay.draw_fix, image, fix, scene)
    written = {text.get_text() for text in figure.axes[0].texts}
    assert {"shape of no lamp", "cut by the border", "lamp 0"} <= written
    shown = figure.axes[0].images[0].get_array()
    assert shown.shape == image.shape and shown[310, 60, 1] > shown[310, 60, 0]
