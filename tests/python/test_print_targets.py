# SPDX-License-Identifier: Apache-2.0
"""`libocc targets`: printed at 100 %, the targets have their size, and libocc detects them."""

import json
import re
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image, ImageDraw

import libocc as occ
from libocc.cli import target_sheets
from libocc.cli.commands.targets import ids_of, ranges

Run = Callable[..., tuple[int, str, str]]
Polygons = list[np.ndarray]
MM = 25.4 / 72  # of a point
SCALE, FINE = 6, 4  # pixels per mm of the raster, and its oversampling
PAPERS = {"A4": (210, 297), "A3": (297, 420), "Letter": (215.9, 279.4)}


def polygons_of_svg(path: Path) -> tuple[Polygons, tuple[float, float]]:
    """Filled polygons [mm] of a page, and its size; not the text."""
    text = path.read_text()
    size = tuple(MM * float(value) for value in re.findall(r'(?:width|height)="([\d.]+)pt"', text)[:2])
    drawn = [d for d in re.findall(r'<path d="([^"]*)"', text) if re.fullmatch(r"[MLz\d.\s-]*", d)]
    pieces = [piece for d in drawn for piece in re.split("z", d)]
    found = [[list(map(float, at)) for at in re.findall(r"[ML] ([\d.-]+) ([\d.-]+)", piece)] for piece in pieces]
    return [MM * np.array(each) for each in found if each], (size[0], size[1])


def polygons_of_pdf(path: Path) -> tuple[list[Polygons], tuple[float, float]]:
    """Filled polygons [mm] of each page, with y down, and the size of the pages; not the text."""
    data = path.read_bytes()
    boxes = {found for found in re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", data)}
    (box,) = boxes
    width, height = float(box[0]), float(box[1])
    pages = []
    for stream in re.findall(rb"stream\n(.*?)\nendstream", data, re.DOTALL):
        try:
            text = zlib.decompress(stream).decode("latin-1")
        except zlib.error:
            continue
        if " re W n" not in text:  # a font
            continue
        found = [re.findall(r"^([\d.-]+) ([\d.-]+) [ml]$", piece, re.MULTILINE) for piece in text.split("\nh\n")]
        pages.append([MM * np.abs(np.array(each, float) - [0, height]) for each in found if each])
    return pages, (MM * width, MM * height)


def raster(polygons: Polygons, size_mm: tuple[float, float]) -> np.ndarray:
    """Draws the black polygons; a pixel is 1/SCALE mm."""
    fine = SCALE * FINE
    image = Image.new("L", (round(size_mm[0] * fine), round(size_mm[1] * fine)), 255)
    drawing = ImageDraw.Draw(image)
    for polygon in polygons:
        if np.ptp(polygon[:, 0]) < 0.99 * size_mm[0]:  # not the paper
            (x0, y0), (x1, y1) = polygon.min(axis=0) * fine, polygon.max(axis=0) * fine
            drawing.rectangle((round(x0), round(y0), round(x1) - 1, round(y1) - 1), fill=0)
    pixels = np.asarray(image, float)
    high, wide = pixels.shape[0] // FINE, pixels.shape[1] // FINE
    means = pixels[: high * FINE, : wide * FINE].reshape(high, FINE, wide, FINE).mean(axis=(1, 3))
    return np.ascontiguousarray(means.round().astype(np.uint8))


def corners_mm(tag: occ.targets.AprilTag) -> np.ndarray:
    return (tag.corners_px + 0.5) / SCALE


def check_tags(pixels: np.ndarray, family: str, ids: list[int], side_mm: float, size_mm: tuple[float, float]) -> None:
    tags = occ.targets.detect_april_tags(pixels, family=family)
    assert [tag.id for tag in tags] == ids
    for tag in tags:
        corners = corners_mm(tag)
        lower_left = corners[0]
        expected = lower_left + side_mm * np.array([[0, 0], [1, 0], [1, -1], [0, -1]])
        np.testing.assert_allclose(corners, expected, atol=0.05)
        assert (corners > 5).all() and (corners < np.array(size_mm) - 5).all()
    middles = [tag.centre_px for tag in tags]
    for i, middle in enumerate(middles):
        assert all(np.abs(middle - other).max() > SCALE * side_mm for other in middles[:i])


def has_bar(polygons: Polygons) -> bool:
    """True if one rectangle is 100 mm long, and ticks are at its ends."""
    boxes = [(*p.min(axis=0), *p.max(axis=0)) for p in polygons]
    for x0, _, x1, y1 in boxes:
        if abs(x1 - x0 - 100) < 1e-3:
            ticks = [box for box in boxes if box[2] - box[0] < 1 and abs(box[3] - y1) < 1e-3]
            return min(t[0] for t in ticks) == pytest.approx(x0) and max(t[2] for t in ticks) == pytest.approx(x1)
    return False


@pytest.mark.parametrize("paper", PAPERS)
def test_a_sheet_of_tags_has_its_scale(libocc: Run, paper: str) -> None:
    for suffix in ("pdf", "svg"):
        code, out, err = libocc(
            "targets", "--tag-size", 0.08, "--ids", "3,7-9", "--paper", paper, "--out", f"tags.{suffix}"
        )
        assert code == 0 and "ids 3,7-9, 80 mm; 1 page of " + paper in out, err
    svg, svg_size = polygons_of_svg(Path("tags.svg"))
    (pdf,), pdf_size = polygons_of_pdf(Path("tags.pdf"))
    for polygons, size in ((svg, svg_size), (pdf, pdf_size)):
        assert sorted(size) == pytest.approx(PAPERS[paper], abs=1e-3)
        check_tags(raster(polygons, size), "tag36h11", [3, 7, 8, 9], 80, size)
        assert has_bar(polygons)


@pytest.mark.parametrize("family", occ.targets.april_tag_families())
def test_every_family_is_detected(libocc: Run, family: str) -> None:
    code, _, err = libocc("targets", "--family", family, "--tag-size", 0.05, "--ids", "0-1", "--out", "tags.svg")
    assert code == 0, err
    polygons, size = polygons_of_svg(Path("tags.svg"))
    tags = occ.targets.detect_april_tags(raster(polygons, size), family=family)
    assert [tag.id for tag in tags] == [0, 1]
    for tag in tags:
        assert np.linalg.norm(tag.corners_px[1] - tag.corners_px[0]) == pytest.approx(50 * SCALE, abs=0.5)


def test_a_large_tag_fills_a_page_and_pages_follow(libocc: Run) -> None:
    code, out, _ = libocc("targets", "--tag-size", 0.16, "--ids", "0-2", "--out", "tags.pdf")
    assert code == 0 and "3 pages of A4" in out
    pages, size = polygons_of_pdf(Path("tags.pdf"))
    for id, polygons in enumerate(pages):
        check_tags(raster(polygons, size), "tag36h11", [id], 160, size)
        assert has_bar(polygons)
    code, out, _ = libocc("targets", "--tag-size", 0.03, "--ids", "0-4", "--per-page", 2, "--out", "small.svg")
    assert code == 0 and out.startswith("small-1.svg small-2.svg small-3.svg: ")
    polygons, size = polygons_of_svg(Path("small-3.svg"))
    check_tags(raster(polygons, size), "tag36h11", [4], 30, size)


def test_the_raster_of_the_drawing_is_detected_by_libocc_tags(libocc: Run) -> None:
    patterns = [target_sheets.tag("tag36h11", id, 0.06) for id in range(6)]
    (page,) = target_sheets.pages(patterns, "A4", "footer")
    target_sheets.draw(page).savefig("page.png", dpi=150)
    code, out, _ = libocc("tags", "page.png", "--json")
    found = json.loads(out)["tags"]
    assert code == 0 and [tag["id"] for tag in found] == list(range(6))
    for tag, placed in zip(found, page.targets):
        cell = placed.pattern.cell_mm
        left, top = placed.x_mm + cell, placed.y_mm + cell
        expected = np.array([[left, top + 60], [left + 60, top + 60], [left + 60, top], [left, top]])
        np.testing.assert_allclose(
            (np.array(tag["corners_px"]) + 0.5) * 25.4 / 150, expected, atol=0.25
        )  # snapped to pixels


@pytest.mark.parametrize("paper", ["A4", "A3"])
def test_a_chessboard_has_its_squares(libocc: Run, paper: str) -> None:
    for suffix in ("pdf", "svg"):
        arguments = ["--chessboard", "9x6", "--square", 0.025, "--paper", paper, "--out", f"board.{suffix}"]
        code, out, err = libocc("targets", *arguments)
        assert code == 0 and "chessboard, 9x6 inner corners, squares of 25 mm; 1 page of " + paper in out, err
    (pdf,), pdf_size = polygons_of_pdf(Path("board.pdf"))
    for polygons, size in (polygons_of_svg(Path("board.svg")), (pdf, pdf_size)):
        assert has_bar(polygons)
        found = occ.targets.find_chessboard(raster(polygons, size), 9, 6)
        assert found is not None
        corners = (np.asarray(found[0]).reshape(6, 9, 2) + 0.5) / SCALE
        np.testing.assert_allclose(np.abs(np.diff(corners, axis=1)[..., 0]), 25, atol=0.05)
        np.testing.assert_allclose(np.abs(np.diff(corners, axis=0)[..., 1]), 25, atol=0.05)


def board_mm(polygons: Polygons, size: tuple[float, float], board: object) -> np.ndarray:
    """Measured points of a printed board with tags [mm], all of them."""
    pixels = raster(polygons, size)
    grid = isinstance(board, occ.targets.AprilGrid)
    found = occ.targets.find_april_grid(pixels, board) if grid else occ.targets.find_charuco(pixels, board)
    assert found.ok and found.foreign_ids == [] and found.misplaced_ids == [], found.message
    assert found.indices == list(range(len(board.points_m)))
    return (found.px + 0.5) / SCALE


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("kind", ["aprilgrid", "charuco"])
def test_a_board_with_tags_has_its_scale(libocc: Run, kind: str, legacy: bool) -> None:
    if kind == "aprilgrid":
        board = occ.targets.AprilGrid(columns=4, rows=6, tag_size_m=0.03, spacing=0.25)
        options = ["--aprilgrid", "4x6", "--tag-size", 0.03, "--spacing", 0.25]
        text = "AprilGrid of 4x6 tags of tag36h11, tags of 30 mm, gaps of 7.5 mm; 1 page of A4"
        if legacy:
            Path("grid.yaml").write_text(
                "target_type: 'aprilgrid'\ntagCols: 4\ntagRows: 6\ntagSize: 0.03\ntagSpacing: 0.25\n"
            )
            options = ["--aprilgrid", "grid.yaml"]
    else:
        board = occ.targets.CharucoBoard(columns=5, rows=6, square_m=0.036, marker_m=0.026, legacy=legacy)
        options = ["--charuco", "5x6", "--square", 0.036, "--marker", 0.026, *(["--legacy"] if legacy else [])]
        text = "ChArUco board of 5x6 squares of 36 mm, markers of tag36h11 of 26 mm"
    for suffix in ("pdf", "svg"):
        code, out, err = libocc("targets", *options, "--out", f"board.{suffix}")
        assert code == 0 and text in out, err
    (pdf,), pdf_size = polygons_of_pdf(Path("board.pdf"))
    up = np.array([1, -1]) if kind == "aprilgrid" else np.array([1, 1])
    for polygons, size in (polygons_of_svg(Path("board.svg")), (pdf, pdf_size)):
        assert has_bar(polygons)
        measured = board_mm(polygons, size, board)
        expected = 1e3 * board.points_m[:, :2] * up
        np.testing.assert_allclose(measured - measured[0], expected - expected[0], atol=0.06)


def test_the_usual_grid_of_kalibr_fits_on_a0(libocc: Run) -> None:
    grid = ["--aprilgrid", "6x6", "--tag-size", 0.088, "--spacing", 0.3]
    code, out, err = libocc("targets", *grid, "--paper", "A0", "--out", "grid.svg")
    assert code == 0 and "1 page of A0" in out, err
    polygons, size = polygons_of_svg(Path("grid.svg"))
    assert sorted(size) == pytest.approx([841, 1189], abs=1e-3)
    black = np.concatenate([p for p in polygons if np.ptp(p[:, 0]) < 0.99 * size[0] and p[:, 1].max() < size[1] - 30])
    assert np.ptp(black, axis=0) == pytest.approx([712.8, 712.8], abs=1e-2)


def test_a_sheet_states_the_options_of_its_board(libocc: Run) -> None:
    libocc("targets", "--aprilgrid", "4x6", "--tag-size", 0.03, "--spacing", 0.25, "--out", "a.svg")
    text = text_of_svg(Path("a.svg"))
    assert "--aprilgrid 4x6 --spacing 0.25 --tag-size 0.03 --out FOLDER" in text
    assert "the tag size is 0.03 x B/100" in text
    board = ["--charuco", "5x6", "--square", 0.036, "--marker", 0.026, "--legacy", "--family", "tag25h9"]
    libocc("targets", *board, "--out", "c.svg")
    text = text_of_svg(Path("c.svg"))
    assert "--charuco 5x6 --family tag25h9 --legacy --marker 0.026 --square 0.036 --out FOLDER" in text
    for footer in (text, text_of_svg(Path("a.svg"))):
        lines = next(part for part in re.split(r"\n(?=100 mm)", footer) if part.startswith("100 mm")).splitlines()
        figure = Figure(figsize=(210 / 25.4, 297 / 25.4))
        for line in lines:
            drawn = figure.text(0, 0, line, fontsize=target_sheets.FONT_PT)
            assert drawn.get_window_extent().width * 25.4 / figure.dpi < 200 - 5, line
    assert "the square is 0.036 x B/100, the marker 0.026 x B/100" in text


def text_of_svg(path: Path) -> str:
    """Comments that matplotlib writes for each text."""
    return "\n".join(re.findall(r"<!-- (.*?) -->", path.read_text(), re.DOTALL)).replace("- -", "--")


def test_every_page_states_id_family_and_size(libocc: Run) -> None:
    libocc("targets", "--tag-size", 0.16, "--ids", "11-12", "--out", "tags.svg")
    for page, id in enumerate((11, 12), 1):
        text = text_of_svg(Path(f"tags-{page}.svg"))
        assert f"tag36h11, id {id}, 160 mm" in text and "--tag-size 0.16" in text
        assert "measure this bar" in text and "100 %" in text
    libocc("targets", "--tag-size", 0.02, "--ids", "5", "--out", "small.svg")
    text = text_of_svg(Path("small.svg"))
    assert "id 5" in text and "tag36h11, 20 mm" in text
    libocc("targets", "--chessboard", "7x5", "--square", 0.02, "--out", "board.svg")
    text = text_of_svg(Path("board.svg"))
    assert "chessboard, 7x5 inner corners, squares of 20 mm" in text and "--chessboard 7x5 --square 0.02" in text


def test_texts_are_on_the_paper() -> None:
    """The longest texts, on the narrowest papers."""
    for paper in PAPERS:
        footer = (
            '100 mm: print at 100 % ("actual size") and measure this bar; if it has B mm, the size is 0.0123 x B/100.'
        )
        (page,) = target_sheets.pages(
            [target_sheets.tag("tagStandard52h13", 9999, 0.01)], paper, footer + "\n" + footer
        )
        figure = target_sheets.draw(page)
        figure.draw_without_rendering()
        width, height = figure.bbox.size
        for text in figure.axes[0].texts:
            box = text.get_window_extent()
            assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height


def test_equal_pages_have_equal_bytes(libocc: Run) -> None:
    for suffix in ("pdf", "svg"):
        for name in ("a", "b"):
            libocc("targets", "--tag-size", 0.05, "--ids", "0", "--out", f"{name}.{suffix}")
        assert Path(f"a.{suffix}").read_bytes() == Path(f"b.{suffix}").read_bytes()


def test_ranges_are_read_back() -> None:
    for ids in ([0], [3, 4, 5], [9, 1, 2, 3, 7], list(range(100))):
        assert ids_of(None, None, ranges(ids)) == ids  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options, text",
    [
        (["--tag-size", "0.2"], "--tag-size: a target of 250 x 250 mm with its border does not fit on A4"),
        (["--tag-size", "0.2"], "it fits at 80 % of this size"),
        (["--chessboard", "9x6", "--square", "0.03"], "--square: a target of 300 x 210 mm"),
        (["--tag-size", "0.05", "--ids", "587"], "--ids: tag: id must be below 587"),
        (["--tag-size", "0.05", "--ids", "1,2,1"], "names tag 1 twice"),
        (["--tag-size", "0.05", "--ids", "5-2"], "rising"),
        (["--tag-size", "0.05", "--ids", "0-99999999999"], "rising"),
        (["--tag-size", "0.05", "--ids", "a"], "'a' must be a number or a range"),
        (["--tag-size", "0.05", "--ids", ""], "'' must be a number or a range"),
        (["--tag-size", "0.05", "--ids", "-1"], "must be a number or a range"),
        (["--tag-size", "0.05", "--family", "tag36h12"], "--family: must be one of"),
        (["--tag-size", "0.05", "--paper", "A5"], "--paper"),
        (["--tag-size", "0"], "--tag-size"),
        (["--aprilgrid", "6x6", "--tag-size", "0.088", "--spacing", "0.3"], "--tag-size: a target of 712.8 x 712.8 mm"),
        (["--tag-size", "nan"], "--tag-size"),
        (["--chessboard", "9x6"], "--chessboard needs --square"),
        (["--chessboard", "2x6", "--square", "0.02"], "at least 3x3"),
        (["--chessboard", "9x6", "--square", "0.02", "--tag-size", "0.1"], "either --tag-size, or"),
        ([], "either --tag-size, or"),
    ],
)
def test_wrong_input_writes_nothing(libocc: Run, options: list[str], text: str) -> None:
    code, _, err = libocc("targets", "--out", "out.pdf", *options)
    assert code == 2 and text in err, err
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize(
    "out, text", [("a.png", "must end with .pdf or .svg"), ("no/a.pdf", "no/a.pdf: cannot be written")]
)
def test_a_wrong_file_name_writes_nothing(libocc: Run, out: str, text: str) -> None:
    code, _, err = libocc("targets", "--tag-size", 0.05, "--out", out)
    assert code == 2 and text in err
    assert list(Path().iterdir()) == []
