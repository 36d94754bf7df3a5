# SPDX-License-Identifier: Apache-2.0
"""Sheets of calibration targets to print to scale: layout, drawing, PDF and SVG files. Positions are in mm, y down."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import IO

import matplotlib
import numpy as np
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from .._core import AprilGrid, CharucoBoard, TagPattern, circle_grid_positions, tag_pattern

PAPERS_MM = {
    "A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0), "A0": (841.0, 1189.0),
    "Letter": (215.9, 279.4),
}
MM_PER_INCH = 25.4
MARGIN_MM = 5.0  # most printers leave 3 to 5 mm at the border blank
FOOTER_MM = 22.0  # height of the bar and the text at the bottom, above the margin
LABEL_MM = 6.0  # height of the text below a target
LONG_LABEL_MM = 40.0  # narrower targets have a short text
BAR_MM = 100
BAR_THICK_MM, TICK_MM = 0.4, 2.0
BAR_SHIFT_MM = 5.0  # of the bar and the text, from the margin
FONT_PT = 8


@dataclass(frozen=True)
class Pattern:
    """Black cells of a target, and the text below it."""

    black: NDArray[np.bool_]
    cell_mm: float
    label: str

    @property
    def size_mm(self) -> tuple[float, float]:
        rows, columns = self.black.shape
        return columns * self.cell_mm, rows * self.cell_mm

    @property
    def gap_mm(self) -> float:
        """White space between neighbouring targets: one cell, unless the pattern has a white ring."""
        inner = self.black[1:-1, 1:-1]
        return self.cell_mm if np.count_nonzero(self.black) > np.count_nonzero(inner) else 0.0


@dataclass(frozen=True)
class Discs:
    """Black discs of a target. Their centres are from its upper left corner."""

    centres_mm: NDArray[np.float64]
    radius_mm: float
    label: str = ""

    @property
    def size_mm(self) -> tuple[float, float]:
        wide, high = self.centres_mm.max(axis=0) + self.radius_mm
        return float(wide), float(high)

    @property
    def gap_mm(self) -> float:
        """White space between neighbouring targets: a diameter."""
        return 2 * self.radius_mm


@dataclass(frozen=True)
class Rectangles:
    """Black rectangles (x, y, width, height) of a target, from its upper left corner."""

    boxes_mm: NDArray[np.float64]
    size_mm: tuple[float, float]
    label: str = ""
    gap_mm: float = 0.0


Target = Pattern | Discs | Rectangles


@dataclass(frozen=True)
class Placed:
    """A pattern with the position of its upper left corner."""

    pattern: Target
    x_mm: float
    y_mm: float


@dataclass(frozen=True)
class Page:
    width_mm: float
    height_mm: float
    targets: tuple[Placed, ...]
    footer: str  # two or three lines


def tag(family: str, id: int, size_m: float) -> Pattern:
    """size_m: side of the black square. Raises: ValueError naming the family or the id."""
    pattern = tag_pattern(family, id)
    label = f"{family}, id {id}, {1e3 * size_m:g} mm" if 1e3 * size_m >= LONG_LABEL_MM else f"id {id}"
    return Pattern(pattern.black, 1e3 * size_m / pattern.square_cells, label)


def chessboard(columns: int, rows: int, square_m: float) -> Pattern:
    """columns, rows: inner corners. The first square, at the upper left, is black."""
    row, column = np.indices((rows + 1, columns + 1))
    return Pattern((row + column) % 2 == 0, 1e3 * square_m, "")


def cells_of(black: NDArray[np.bool_], x_mm: float, y_mm: float, side_mm: float) -> list[tuple[float, ...]]:
    """Black runs of the rows of a square of cells."""
    return list(runs(Pattern(black, side_mm / len(black), ""), x_mm, y_mm))


def marker_board(board: AprilGrid | CharucoBoard) -> Rectangles:
    """An AprilGrid with its outer squares, or a ChArUco board. Raises: ValueError naming the family."""
    return april_grid(board) if isinstance(board, AprilGrid) else charuco(board)


def april_grid(board: AprilGrid) -> Rectangles:
    side_mm = 1e3 * board.tag_size_m
    gap_mm = board.spacing * side_mm
    pitch_mm = side_mm + gap_mm
    wide_mm, high_mm = board.columns * pitch_mm + gap_mm, board.rows * pitch_mm + gap_mm
    boxes: list[tuple[float, ...]] = [
        (column * pitch_mm, row * pitch_mm, gap_mm, gap_mm)
        for row in range(board.rows + 1) for column in range(board.columns + 1)
    ]
    for id, corners_m in board.tags().items():
        left_m, top_m = corners_m[3]  # the board's y axis points up, from the lower left corner of tag 0
        pattern = tag_pattern(board.family, id, border_cells=board.border_cells)
        boxes += cells_of(square_of(pattern), gap_mm + 1e3 * left_m, high_mm - gap_mm - 1e3 * top_m, side_mm)
    return Rectangles(np.array(boxes), (wide_mm, high_mm))


def charuco(board: CharucoBoard) -> Rectangles:
    side_mm = 1e3 * board.square_m
    row, column = np.indices((board.rows, board.columns))
    parity = 0 if board.legacy and board.rows % 2 == 0 else 1
    black = (row + column) % 2 != parity
    boxes: list[tuple[float, ...]] = list(runs(Pattern(black, side_mm, ""), 0, 0))
    for id, corners_m in board.tags().items():
        left_mm, top_mm = 1e3 * corners_m[1]  # the tag is upside down
        upside_down = square_of(tag_pattern(board.family, id))[::-1, ::-1]
        boxes += cells_of(upside_down, left_mm, top_mm, 1e3 * board.marker_m)
    return Rectangles(np.array(boxes), (board.columns * side_mm, board.rows * side_mm))


def square_of(pattern: TagPattern) -> NDArray[np.bool_]:
    """Cells of a tag without the white ring around them."""
    ring = (len(pattern.black) - pattern.square_cells) // 2
    return np.asarray(pattern.black)[ring : ring + pattern.square_cells, ring : ring + pattern.square_cells]


def circle_grid(columns: int, rows: int, asymmetric: bool, spacing_m: float, diameter_m: float) -> Discs:
    """Raises: ValueError if neighbouring discs touch."""
    nearest_m = math.sqrt(2) * spacing_m if asymmetric else spacing_m
    if not diameter_m < nearest_m:
        raise ValueError(f"discs of {1e3 * diameter_m:g} mm touch: their centres are {1e3 * nearest_m:.4g} mm apart")
    radius_mm = 500 * diameter_m
    return Discs(1e3 * circle_grid_positions(columns, rows, asymmetric, spacing_m) + radius_mm, radius_mm)


class Grid:
    """Positions of equal targets on one page."""

    def __init__(self, pattern: Target, width_mm: float, height_mm: float):
        self.page_mm = width_mm, height_mm
        wide, high = pattern.size_mm
        self._gap = pattern.gap_mm
        self._step = wide + self._gap, high + (LABEL_MM if pattern.label else 0) + self._gap
        self._area = width_mm - 2 * MARGIN_MM, height_mm - 2 * MARGIN_MM - FOOTER_MM
        self.columns, self.rows = (
            max(0, math.floor((side + self._gap) / step + 1e-9)) for side, step in zip(self._area, self._step)
        )

    @property
    def count(self) -> int:
        return self.columns * self.rows

    def place(self, patterns: Sequence[Target], footer: str) -> Page:
        columns = min(self.columns, len(patterns))
        rows = -(-len(patterns) // columns)
        left, top = (
            MARGIN_MM + (side - count * step + self._gap) / 2
            for side, count, step in zip(self._area, (columns, rows), self._step)
        )
        targets = tuple(
            Placed(pattern, left + i % columns * self._step[0], top + i // columns * self._step[1])
            for i, pattern in enumerate(patterns)
        )
        return Page(*self.page_mm, targets, footer)


def max_scale(pattern: Target, paper: str) -> float:
    """Largest scale with which the target fits on the paper."""
    own_wide, own_high = pattern.size_mm
    label_mm = LABEL_MM if pattern.label else 0
    sides = PAPERS_MM[paper]
    return max(
        min((wide - 2 * MARGIN_MM) / own_wide, (high - 2 * MARGIN_MM - FOOTER_MM - label_mm) / own_high)
        for wide, high in (sides, sides[::-1])
    )


def pages(patterns: Sequence[Target], paper: str, footer: str, per_page: int | None = None) -> list[Page]:
    """Places equal targets on as few pages as possible, upright or across.

    Raises: ValueError with the largest possible scale if a target does not fit on the paper.
    """
    sides = PAPERS_MM[paper]
    grid = max((Grid(patterns[0], *each) for each in (sides, sides[::-1])), key=lambda each: each.count)
    if grid.count == 0:
        wide, high = patterns[0].size_mm
        factor = max_scale(patterns[0], paper)
        raise ValueError(
            f"a target of {wide:.4g} x {high:.4g} mm with its border does not fit on {paper} "
            f"({sides[0]:g} x {sides[1]:g} mm, less {MARGIN_MM:g} mm at the border and {FOOTER_MM:g} mm for the bar); "
            f"it fits at {math.floor(1000 * factor) / 10:g} % of this size"
        )
    count = min(grid.count, per_page or grid.count)
    return [grid.place(patterns[i : i + count], footer) for i in range(0, len(patterns), count)]


def runs(pattern: Pattern, x_mm: float, y_mm: float) -> Iterator[tuple[float, float, float, float]]:
    """Black rectangles (x, y, width, height) of a target: the runs of black cells of each row."""
    cell = pattern.cell_mm
    for row, cells in enumerate(pattern.black):
        edges = np.flatnonzero(np.diff(cells.astype(int), prepend=0, append=0))
        for begin, end in edges.reshape(-1, 2):
            yield x_mm + cell * begin, y_mm + cell * row, cell * (end - begin), cell


def bar(page: Page) -> Iterator[tuple[float, float, float, float]]:
    """Rectangles of the bar, which is BAR_MM long between the outer borders of its end ticks."""
    x, y = MARGIN_MM + BAR_SHIFT_MM, page.height_mm - MARGIN_MM - FOOTER_MM + BAR_SHIFT_MM
    yield x, y + TICK_MM, BAR_MM, BAR_THICK_MM
    for at in range(0, BAR_MM + 1, 10):
        high = 2 * TICK_MM if at % 50 == 0 else TICK_MM
        left = min(max(at - BAR_THICK_MM / 2, 0), BAR_MM - BAR_THICK_MM)
        yield x + left, y + TICK_MM + BAR_THICK_MM - high, BAR_THICK_MM, high


def outline(rectangles: Iterator[tuple[float, float, float, float]]) -> Outline:
    """One path of all rectangles: viewers draw no gaps between parts of one path."""
    vertices: list[tuple[float, float]] = []
    codes: list[np.uint8] = []
    for x, y, wide, high in rectangles:
        vertices += [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high), (x, y)]
        codes += [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY]
    return Outline(np.array(vertices), codes)


def outline_of(placed: Placed) -> Outline:
    """One path of all black parts of a target."""
    if isinstance(placed.pattern, Pattern):
        return outline(runs(placed.pattern, placed.x_mm, placed.y_mm))
    if isinstance(placed.pattern, Rectangles):
        moved = placed.pattern.boxes_mm + [placed.x_mm, placed.y_mm, 0, 0]
        return outline((x, y, wide, high) for x, y, wide, high in moved.tolist())
    centres = placed.pattern.centres_mm + [placed.x_mm, placed.y_mm]
    radius = placed.pattern.radius_mm
    return Outline.make_compound_path(*(Outline.circle((float(x), float(y)), radius) for x, y in centres))


def draw(page: Page) -> Figure:
    """Draws a page to scale."""
    figure = Figure(figsize=(page.width_mm / MM_PER_INCH, page.height_mm / MM_PER_INCH), facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(0, page.width_mm)
    axes.set_ylim(page.height_mm, 0)
    for placed in page.targets:
        axes.add_patch(PathPatch(outline_of(placed), facecolor="black", edgecolor="none", linewidth=0))
        wide, high = placed.pattern.size_mm
        below = placed.y_mm + high + LABEL_MM / 2
        axes.text(placed.x_mm + wide / 2, below, placed.pattern.label, ha="center", va="center", fontsize=FONT_PT)
    axes.add_patch(PathPatch(outline(bar(page)), facecolor="black", edgecolor="none", linewidth=0))
    left, bottom = MARGIN_MM + BAR_SHIFT_MM, page.height_mm - MARGIN_MM
    axes.text(left, bottom, page.footer, ha="left", va="bottom", fontsize=FONT_PT, linespacing=1.3)
    return figure


def write_pdf(file: IO[bytes], all_pages: Sequence[Page]) -> None:
    """Writes a PDF file; equal pages give equal bytes."""
    with PdfPages(file, metadata={"CreationDate": None, "Creator": "libocc"}) as pdf:
        for page in all_pages:
            pdf.savefig(draw(page))


def write_svg(file: IO[bytes], page: Page) -> None:
    """Writes an SVG file; equal pages give equal bytes."""
    with matplotlib.rc_context({"svg.hashsalt": "libocc", "svg.fonttype": "path"}):
        draw(page).savefig(file, format="svg", metadata={"Date": None, "Creator": "libocc"})
