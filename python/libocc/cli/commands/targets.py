# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import click

import libocc as occ

from .. import Failure, error_context
from ..board_options import (
    BoardOptions,
    MarkerBoard,
    board_of,
    board_options,
    check_targets,
    circles_of,
    marker_board,
)
from ..files import whole_file

PAPERS = ("A4", "A3", "A2", "A1", "A0", "Letter")
MAX_LINE = 110  # letters of a line on A4
MAX_TARGETS = 600  # the largest common family, tag36h11, has 587 tags
MIN_TAG_M, MIN_SQUARE_M, MIN_DISC_M, MAX_M = 0.01, 0.002, 0.002, 10.0  # cells of 1 mm and more are printed well


def ids_of(ctx: click.Context, param: click.Parameter, value: str) -> list[int]:
    """Parses numbers and ranges such as 0-5,8."""
    ids: list[int] = []
    for part in value.split(","):
        ends = part.strip().split("-")
        if len(ends) > 2 or not all(end.isascii() and end.isdigit() for end in ends):
            raise click.BadParameter(f"{part!r} must be a number or a range, such as 0-5,8", ctx, param)
        first, last = int(ends[0]), int(ends[-1])
        if last < first or last - first >= MAX_TARGETS:
            raise click.BadParameter(f"{part!r} must be a range of 1 to {MAX_TARGETS} rising numbers", ctx, param)
        ids.extend(range(first, last + 1))
    twice = sorted({id for id in ids if ids.count(id) > 1})
    if twice or len(ids) > MAX_TARGETS:
        reason = f"names tag {twice[0]} twice" if twice else f"names more than {MAX_TARGETS} tags"
        raise click.BadParameter(f"{value!r} {reason}", ctx, param)
    return ids


def ranges(ids: list[int]) -> str:
    """Text that ids_of() parses to the same numbers."""
    parts: list[list[int]] = []
    for id in ids:
        if parts and id == parts[-1][1] + 1:
            parts[-1][1] = id
        else:
            parts.append([id, id])
    return ",".join(f"{first}" if first == last else f"{first}-{last}" for first, last in parts)


def files_of(out: str, pages: int) -> list[str]:
    """The files of all pages: one PDF file, or an SVG file of each page."""
    path = Path(out)
    kind = path.suffix.lower()
    if kind not in (".pdf", ".svg"):
        raise Failure(f"{out}: must end with .pdf or .svg")
    if kind == ".pdf" or pages == 1:
        return [out]
    return [str(path.with_name(f"{path.stem}-{i + 1}{path.suffix}")) for i in range(pages)]


def size_of(marked: MarkerBoard) -> tuple[float, str]:
    """Size of a board with tags [m], and the option that states it."""
    if isinstance(marked.board, occ.targets.AprilGrid):
        return marked.board.tag_size_m, "--tag-size"
    return marked.board.square_m, "--square"


def scale_of(marked: MarkerBoard) -> str:
    """Sizes of the print if the bar of 100 mm has B mm."""
    if isinstance(marked.board, occ.targets.AprilGrid):
        return f"the tag size is {marked.board.tag_size_m:g} x B/100"
    return f"the square is {marked.board.square_m:g} x B/100, the marker {marked.board.marker_m:g} x B/100"


@click.command(short_help="Write calibration targets to print: AprilTags and calibration boards.")
@click.option("--out", required=True, metavar="FILE.pdf|.svg", help="The sheets; SVG has one file per page.")
@click.option("--tag-size", "tag_size_m", type=click.FloatRange(MIN_TAG_M, MAX_M), metavar="M",
              help="Side of the tags' black squares [m].")
@click.option("--ids", callback=ids_of, default="0-5", show_default=True, metavar="ID,FIRST-LAST,...",
              help="Numbers of the tags.")
@click.option("--family", default="tag36h11", show_default=True, help="Family of the tags.")
@board_options
@click.option("--per-page", type=click.IntRange(1), metavar="N",
              help="Maximum number of tags on a page; 1 for sheets that are hung at several places.")
@click.option("--chessboard", callback=board_of, metavar="COLSxROWS", help="Inner corners of a chessboard.")
@click.option("--square", "square_m", type=click.FloatRange(MIN_SQUARE_M, MAX_M), metavar="M",
              help="Side of the squares of --chessboard or --charuco [m].")
@click.option("--circles", callback=circles_of, metavar="COLSxROWS",
              help="Discs of a grid. Odd rows are shifted by the spacing, unless --symmetric.")
@click.option("--symmetric", is_flag=True, help="The rows of --circles are not shifted.")
@click.option("--spacing", "spacing_m", type=click.FloatRange(MIN_DISC_M, MAX_M), metavar="M",
              help="Distance of the rows of --circles [m]: half the distance of the discs of a row, or, with "
                   "--symmetric, their distance. With --aprilgrid: gap between tags, relative to their side.")
@click.option("--diameter", "diameter_m", type=click.FloatRange(MIN_DISC_M, MAX_M), metavar="M",
              help="Diameter of the discs [m].")
@click.option("--paper", type=click.Choice(PAPERS, case_sensitive=False), default="A4", show_default=True)
def command(
    out: str, tag_size_m: float | None, ids: list[int], family: str, aprilgrid: tuple[int, int] | Path | None,
    charuco: tuple[int, int] | None, marker_m: float | None, legacy: bool, border_cells: int | None,
    per_page: int | None, chessboard: tuple[int, int] | None, square_m: float | None,
    circles: tuple[int, int] | None, symmetric: bool, spacing_m: float | None, diameter_m: float | None, paper: str,
) -> None:
    """\b
    $ libocc targets --tag-size 0.08 --ids 0-3 --out tags.pdf
    tags.pdf: tag36h11, ids 0-3, 80 mm; 1 page of A4
    print at 100 % and measure the bar of 100 mm; if it has B mm, the size is 0.08 x B/100

    Writes AprilTags, a chessboard, a grid of discs, an AprilGrid or a ChArUco board to scale, for `libocc calibrate
    camera` and as landmarks of a scene. Every page has a bar of 100 mm, to check the scale of the print, and a line
    with family, ids and size. As many tags as possible are on one page. Glue the sheets to something flat.

    \b
    libocc targets --chessboard 9x6 --square 0.025 --out board.pdf
    libocc targets --circles 4x11 --spacing 0.02 --diameter 0.018 --out circles.pdf
    libocc targets --aprilgrid 6x6 --tag-size 0.024 --spacing 0.3 --out aprilgrid.pdf
    libocc targets --charuco 5x7 --square 0.036 --marker 0.027 --out charuco.pdf
    """
    from .. import target_sheets as sheets

    board_kind = BoardOptions(aprilgrid, charuco, marker_m, legacy, border_cells)
    check_targets(tag_size_m, chessboard, square_m, circles, spacing_m, diameter_m, board_kind)
    marked = marker_board(board_kind, family, tag_size_m, square_m, spacing_m)
    if marked is not None:
        size_m, option = size_of(marked)
        what = about = marked.text
        use = marked.use.rpartition(" ")[0] if isinstance(aprilgrid, tuple) or charuco else marked.use
        patterns: list[sheets.Pattern | sheets.Discs | sheets.Rectangles] = [sheets.marker_board(marked.board)]
    elif circles is not None:
        assert spacing_m is not None and diameter_m is not None
        size_m, option = spacing_m, "--spacing"
        columns, rows = circles
        kind = "symmetric" if symmetric else "asymmetric"
        spaced = f"spacing {1e3 * spacing_m:g} mm, diameter {1e3 * diameter_m:g} mm"
        what = about = f"{kind} grid of {columns}x{rows} discs, {spaced}"
        use = f"--circles {columns}x{rows}{' --symmetric' if symmetric else ''} --diameter {diameter_m:g} --spacing"
        with error_context("--diameter"):
            patterns = [
                sheets.circle_grid(columns, rows, not symmetric, spacing_m, diameter_m)
            ]
    elif chessboard is not None:
        assert square_m is not None
        size_m, option = square_m, "--square"
        columns, rows = chessboard
        what = f"chessboard, {columns}x{rows} inner corners, squares of {1e3 * size_m:g} mm"
        about = what
        use = f"--chessboard {columns}x{rows} --square"
        patterns = [sheets.chessboard(columns, rows, size_m)]
    else:
        assert tag_size_m is not None
        size_m, option = tag_size_m, "--tag-size"
        if family not in occ.targets.april_tag_families():
            raise Failure(f"--family: must be one of {', '.join(occ.targets.april_tag_families())}, got {family}")
        with error_context("--ids"):
            patterns = [sheets.tag(family, id, size_m) for id in ids]
        what = f"{family}, {'id' if len(ids) == 1 else 'ids'} {ranges(ids)}, {1e3 * size_m:g} mm"
        about = f"{family}, {1e3 * size_m:g} mm"
        use = "--tag-size"
    sized = f"{use} {size_m:g}"
    if isinstance(aprilgrid, Path):
        sized = use
    scale = f"the size is {size_m:g} x B/100"
    if diameter_m is not None and circles is not None:
        scale = f"the spacing is {size_m:g} x B/100, the diameter {diameter_m:g} x B/100"
    if marked is not None:
        scale = scale_of(marked)
    advice = f"libocc calibrate camera IMAGE... {sized} --out FOLDER"
    gap = ": " if len(about) + len(advice) < MAX_LINE else ":\n"
    footer = (
        f'100 mm: print at 100 % ("actual size") and measure this bar; if it has B mm, {scale}.\n{about}{gap}{advice}'
    )
    with error_context(option):
        pages = sheets.pages(patterns, paper, footer, per_page)
    files = files_of(out, len(pages))
    for i, name in enumerate(files):
        with error_context(name), whole_file(name) as file:
            if name.lower().endswith(".pdf"):
                sheets.write_pdf(file, pages)
            else:
                sheets.write_svg(file, pages[i])
    click.echo(f"{' '.join(files)}: {what}; {len(pages)} {'page' if len(pages) == 1 else 'pages'} of {paper}")
    click.echo(f"print at 100 % and measure the bar of 100 mm; if it has B mm, {scale}")
