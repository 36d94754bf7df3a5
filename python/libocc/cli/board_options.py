# SPDX-License-Identifier: Apache-2.0
"""Options of the command line that describe a calibration board, and their checks."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import click
from numpy.typing import NDArray

import libocc as occ

from . import Failure

F = TypeVar("F", bound=Callable[..., Any])
Shape = tuple[int, int] | None
DICTIONARY = re.compile(r"(?:cv2?\.)?(?:aruco\.)?DICT_APRILTAG_(36h11|36h10|25h9|16h5)", re.IGNORECASE)
KALIBR_BORDER = 2  # cells of the black border of a tag
TILED_PX = 6000  # images with a longer side are searched by tiles, which limits the memory
TILE_PX, OVERLAP_PX = 3000, 600  # the overlap is the max size of a tag


def board_of(ctx: click.Context, param: click.Parameter, value: str | None) -> Shape:
    """Parses COLUMNSxROWS of inner corners."""
    return shape_of(ctx, param, value, (3, 3), "inner corners, at least 3x3, such as 9x6")


def circles_of(ctx: click.Context, param: click.Parameter, value: str | None) -> Shape:
    """Parses COLUMNSxROWS of discs."""
    return shape_of(ctx, param, value, (2, 3), "discs, at least 2x3, such as 4x11")


def charuco_of(ctx: click.Context, param: click.Parameter, value: str | None) -> Shape:
    """Parses COLUMNSxROWS of squares."""
    return shape_of(ctx, param, value, (3, 3), "squares, at least 3x3, such as 5x7")


def aprilgrid_of(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int] | Path | None:
    """Parses COLUMNSxROWS of tags, or the name of a YAML file."""
    if value is not None and value.lower().endswith((".yaml", ".yml")):
        return Path(value)
    rule = "tags, such as 6x6, or a YAML file of Kalibr such as april_6x6.yaml"
    return shape_of(ctx, param, value, (1, 1), rule)


def shape_of(
    ctx: click.Context, param: click.Parameter, value: str | None, smallest: tuple[int, int], rule: str
) -> Shape:
    if value is None:
        return None
    found = re.fullmatch(r"(\d+)x(\d+)", value)
    if not found or int(found[1]) < smallest[0] or int(found[2]) < smallest[1]:
        raise click.BadParameter(f"{value!r} must be COLUMNSxROWS of {rule}", ctx, param)
    return int(found[1]), int(found[2])


def check_targets(
    tag_size_m: float | None, chessboard: Shape, square_m: float | None, circles: Shape, spacing_m: float | None,
    diameter_m: float | None, boards: "BoardOptions | None" = None,
) -> None:
    """Raises: Failure unless the options describe exactly one kind of target."""
    aprilgrid, charuco = (boards.aprilgrid, boards.charuco) if boards is not None else (None, None)
    tags = tag_size_m if aprilgrid is None else None
    if sum(each is not None for each in (tags, chessboard, circles, aprilgrid, charuco)) != 1:
        raise Failure(
            "give either --tag-size, or --chessboard with --square, or --circles with --spacing and --diameter, or "
            "--aprilgrid with --tag-size and --spacing, or --charuco with --square and --marker"
        )
    if chessboard is not None and square_m is None:
        raise Failure("--chessboard needs --square")
    if circles is not None and (spacing_m is None or diameter_m is None):
        raise Failure("--circles needs --spacing and --diameter")
    if boards is None:
        return
    if charuco is not None and (square_m is None or boards.marker_m is None):
        raise Failure("--charuco needs --square and --marker")
    for given, name in ((boards.marker_m is not None, "--marker"), (boards.legacy, "--legacy")):
        if given and charuco is None:
            raise Failure(f"{name} is for --charuco only")
    if boards.border_cells is not None and aprilgrid is None:
        raise Failure("--border-cells is for --aprilgrid only")
    sizes = [name for name, size in (("--tag-size", tag_size_m), ("--spacing", spacing_m)) if size is not None]
    if isinstance(aprilgrid, Path) and sizes:
        raise Failure(f"{' and '.join(sizes)}: the file {aprilgrid} has the sizes of the grid")
    if isinstance(aprilgrid, tuple) and len(sizes) < 2:
        raise Failure("--aprilgrid needs --tag-size and --spacing")


def board_options(command: F) -> F:
    """Adds --aprilgrid, --border-cells, --charuco, --marker and --legacy."""
    for option in (
        click.option("--legacy", is_flag=True,
                     help="Layout of --charuco of OpenCV before version 4.6: with an even number of rows, the upper "
                          "left square is white."),
        click.option("--marker", "marker_m", type=click.FloatRange(0, min_open=True), metavar="M",
                     help="Side of the black squares of the markers of --charuco [m]."),
        click.option("--charuco", callback=charuco_of, metavar="COLSxROWS",
                     help="Squares of a ChArUco board, as in OpenCV. Its markers must be AprilTags: --family is "
                          "tag36h11, tag36h10, tag25h9 or tag16h5, or the name of the dictionary "
                          "DICT_APRILTAG_36h11 to 16h5."),
        click.option("--border-cells", type=click.IntRange(1, 4),
                     help="Width of the black border of the tags of --aprilgrid [cells]; Kalibr prints 2 (default)."),
        click.option("--aprilgrid", callback=aprilgrid_of, metavar="COLSxROWS|FILE.yaml",
                     help="Tags of a grid of Kalibr, with --tag-size and --spacing, or Kalibr's file of the target."),
    ):
        command = option(command)
    return command


@dataclass(frozen=True)
class BoardOptions:
    """The options of board_options()."""

    aprilgrid: tuple[int, int] | Path | None = None
    charuco: tuple[int, int] | None = None
    marker_m: float | None = None
    legacy: bool = False
    border_cells: int | None = None


@dataclass(frozen=True)
class MarkerBoard:
    """A board with tags. name: kind of board in messages; text: its description; use: its options, the size last."""

    board: "occ.targets.AprilGrid | occ.targets.CharucoBoard"
    name: str
    text: str
    use: str

    @property
    def points_m(self) -> NDArray[Any]:
        """All points of the board (n, 3)."""
        return self.board.points_m

    def find(self, pixels: NDArray[Any]) -> "occ.targets.BoardPoints":
        tile_px = TILE_PX if max(pixels.shape[:2]) > TILED_PX else 0
        if isinstance(self.board, occ.targets.AprilGrid):
            return occ.targets.find_april_grid(pixels, self.board, tile_px=tile_px, overlap_px=OVERLAP_PX)
        return occ.targets.find_charuco(pixels, self.board, tile_px=tile_px, overlap_px=OVERLAP_PX)


def family_of(name: str) -> str:
    """Family of libocc; names of OpenCV's dictionaries of AprilTags are replaced."""
    found = DICTIONARY.fullmatch(name)
    return f"tag{found[1].lower()}" if found else name


def marker_board(
    options: BoardOptions, family: str, tag_size_m: float | None, square_m: float | None, spacing: float | None
) -> MarkerBoard | None:
    """The board that the options describe; None if it is of another kind. Raises: Failure."""
    try:
        if options.aprilgrid is not None:
            border_cells = options.border_cells or KALIBR_BORDER
            return april_grid(options.aprilgrid, family_of(family), border_cells, tag_size_m, spacing)
        if options.charuco is not None:
            assert square_m is not None and options.marker_m is not None
            return charuco_board(options, family_of(family), square_m, options.marker_m)
    except (OSError, ValueError) as error:
        raise Failure(str(error)) from error
    return None


def april_grid(
    grid: tuple[int, int] | Path, family: str, border_cells: int, tag_size_m: float | None, spacing: float | None
) -> MarkerBoard:
    border = f" --border-cells {border_cells}" if border_cells != KALIBR_BORDER else ""
    if isinstance(grid, Path):
        from ..network.importing.kalibr import read_april_grid

        board = read_april_grid(grid, family, border_cells)
        use = f"--aprilgrid {grid.name}{family_option(family)}{border}"
    else:
        assert tag_size_m is not None and spacing is not None
        board = occ.targets.AprilGrid(
            columns=grid[0], rows=grid[1], tag_size_m=tag_size_m, spacing=spacing, family=family,
            border_cells=border_cells,
        )
        use = (
            f"--aprilgrid {grid[0]}x{grid[1]}{family_option(family)}{border} --spacing {spacing:g} "
            f"--tag-size {tag_size_m:g}"
        )
    gap_mm = 1e3 * board.spacing * board.tag_size_m
    text = (
        f"AprilGrid of {board.columns}x{board.rows} tags of {board.family}, tags of {1e3 * board.tag_size_m:g} mm, "
        f"gaps of {gap_mm:g} mm{f', borders of {cells(border_cells)}' if border else ''}"
    )
    return MarkerBoard(board, "AprilGrid", text, use)


def charuco_board(options: BoardOptions, family: str, square_m: float, marker_m: float) -> MarkerBoard:
    assert options.charuco is not None
    columns, rows = options.charuco
    if not marker_m < square_m:
        raise ValueError(f"--marker: must be smaller than the square of {square_m:g} m, got {marker_m:g} m")
    board = occ.targets.CharucoBoard(
        columns=columns, rows=rows, square_m=square_m, marker_m=marker_m, family=family, legacy=options.legacy
    )
    text = (
        f"ChArUco board of {columns}x{rows} squares of {1e3 * square_m:g} mm, markers of {family} of "
        f"{1e3 * marker_m:g} mm{', layout before OpenCV 4.6' if options.legacy and rows % 2 == 0 else ''}"
    )
    legacy = " --legacy" if options.legacy else ""
    use = f"--charuco {columns}x{rows}{family_option(family)}{legacy} --marker {marker_m:g} --square {square_m:g}"
    return MarkerBoard(board, "ChArUco board", text, use)


def cells(count: int) -> str:
    return "1 cell" if count == 1 else f"{count} cells"


def family_option(family: str) -> str:
    return "" if family == "tag36h11" else f" --family {family}"


def ids_text(ids: Sequence[int], shown: int = 8) -> str:
    """The first ids of a list."""
    text = ", ".join(map(str, ids[:shown]))
    return text if len(ids) <= shown else f"{text} and {len(ids) - shown} more"
