# SPDX-License-Identifier: Apache-2.0
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from .. import Failure, error_context
from ..board_options import BoardOptions, board_of, board_options, check_targets, circles_of, marker_board
from ..exif import FocalLength, camera_tags, focal_length, zoom
from ..progress import progress
from .calibrate_options import add_distances, adjustment_options, distance_option, finish

MODELS = ("pinhole", "fisheye", "double_sphere", "brown_forward", "brown_backward")
MAX_SIZE_M = 10.0  # a larger number is probably in millimetres
MAX_FOCAL_CHANGE = 0.03  # relative; the whole millimetres of an equal focal length differ by less


def free_parameters(camera: occ.Camera) -> list[str]:
    """All parameters except the skew, and C1 and C2 of Brown's distortion, to which fx_px and fy_px are equivalent."""
    return [parameter.name for parameter in camera.parameters if parameter.name not in ("skew_px", "c1", "c2")]


def focal_of_pictures(images: Sequence[str], size: tuple[int, int]) -> tuple[FocalLength | None, list[str]]:
    """Focal length in the EXIF data of the first picture that has one, and warnings about the others."""
    found: dict[str, FocalLength] = {}
    notes = []
    for image in images:
        try:
            tags = camera_tags(image)
        except OSError:  # a format without EXIF data
            continue
        focal = focal_length(tags, *size)
        if focal is not None:
            found[image] = focal
        if zoom(tags) > 1:
            notes.append(f"{image}: was taken with a digital zoom of {zoom(tags):g}; use pictures without zoom")
    if not found:
        return None, notes
    first, reference = next(iter(found.items()))
    for image, focal in found.items():
        if abs(focal.px - reference.px) > MAX_FOCAL_CHANGE * reference.px:
            notes.append(
                f"{image}: its EXIF data ({focal.source}) differ from those of {first} ({reference.source}): "
                "a zoom or another lens is another camera; calibrate it separately"
            )
    return reference, notes


def start_camera(
    model: str, size: tuple[int, int], views: list[Any], focal_px: float | None, coefficients: int,
    exif: FocalLength | None = None,
) -> tuple[occ.Camera, list[str]]:
    """Camera with initial parameters, and warnings about them.

    exif: used if the views do not determine the focal length.
    """
    width, height = size
    middle = {"cx_px": (width - 1) / 2, "cy_px": (height - 1) / 2}
    notes = []
    if focal_px is None and model in ("pinhole", "brown_forward", "brown_backward"):
        pinhole, status, message = occ.network.start_pinhole(views, width, height)
        if status is occ.Status.ok:
            focal_px = pinhole.fx_px
        elif exif is None:
            focal_px = pinhole.fx_px
            notes.append(f"the initial focal length is a guess: {message}")
    if focal_px is None and exif is not None:
        focal_px = exif.px
        notes.append(f"the initial focal length is that of the EXIF data ({exif.source}): {focal_px:.0f} px")
    if focal_px is None:
        focal_px = max(width, height) / np.pi  # 180 degrees over the longer side
        notes.append(f"the initial focal length is a guess: {focal_px:.0f} px; a better one can be given by --focal-px")
    common: dict[str, Any] = {"width": width, "height": height, "fx_px": focal_px, "fy_px": focal_px, **middle}
    if model == "double_sphere":
        return occ.Camera.double_sphere(**common, xi=0.0, alpha=0.5), notes
    if model == "fisheye":
        return occ.Camera.fisheye(**common, distortion=[0.0] * min(coefficients, 4)), notes
    if model in ("brown_forward", "brown_backward"):
        make = occ.Camera.brown_forward if model == "brown_forward" else occ.Camera.brown_backward
        # The unit is the focal length: coefficients have the size of OpenCV's.
        return make(**common, distortion=[0.0] * 7, unit_px=focal_px), notes
    return occ.Camera.pinhole(**common, distortion=[0.0] * coefficients), notes


def plane_of_tag(tag: occ.targets.AprilTag) -> tuple[Any, Any]:
    return np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]), tag.corners_px


@click.command(short_help="Calibrate a camera from images of AprilTags or a calibration board.")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--tag-size", "tag_size_m", type=click.FloatRange(0, MAX_SIZE_M, min_open=True), metavar="M",
              help="Side of the tags' black squares [m]. Without --aprilgrid, the positions of the tags need not be "
                   "known.")
@click.option("--family", default="tag36h11", show_default=True, help="Family of the tags.")
@board_options
@click.option("--chessboard", callback=board_of, metavar="COLSxROWS", help="Inner corners of the board in every image.")
@click.option("--square", "square_m", type=click.FloatRange(0, MAX_SIZE_M, min_open=True), metavar="M",
              help="Side of the squares of --chessboard or --charuco [m].")
@click.option("--circles", callback=circles_of, metavar="COLSxROWS",
              help="Discs of the grid in every image. Odd rows are shifted by the spacing, unless --symmetric.")
@click.option("--symmetric", is_flag=True, help="The rows of --circles are not shifted.")
@click.option("--spacing", "spacing_m", type=click.FloatRange(0, MAX_SIZE_M, min_open=True), metavar="M",
              help="Distance of the rows of --circles [m]: half the distance of the discs of a row, or, with "
                   "--symmetric, their distance. With --aprilgrid: gap between tags, relative to their side.")
@click.option("--diameter", "diameter_m", type=click.FloatRange(0, MAX_SIZE_M, min_open=True), metavar="M",
              help="Diameter of the discs [m].")
@click.option("--model", type=click.Choice(MODELS), default="pinhole", show_default=True)
@click.option("--coefficients", type=click.Choice(["0", "4", "5", "8", "12", "14"]), default="5", show_default=True,
              help="Number of distortion coefficients of a pinhole camera; a fisheye camera has at most 4.")
@click.option("--focal-px", type=click.FloatRange(min=1),
              help="Initial focal length; default: from the targets, or from the EXIF data.")
@click.option("--camera", "camera_path", metavar="CAMERA.yaml",
              help="Initial values of all parameters; replaces --model.")
@distance_option
@adjustment_options
@click.pass_context
def command(
    ctx: click.Context, images: tuple[str, ...], tag_size_m: float | None, family: str,
    aprilgrid: tuple[int, int] | Path | None, charuco: tuple[int, int] | None, marker_m: float | None, legacy: bool,
    border_cells: int | None,
    chessboard: tuple[int, int] | None, square_m: float | None, circles: tuple[int, int] | None, symmetric: bool,
    spacing_m: float | None, diameter_m: float | None, model: str, coefficients: str, focal_px: float | None,
    camera_path: str | None, distance: tuple[Any, ...], out: str, datum_kind: str | None, select: bool, ladder: bool,
    robust: bool, as_json: bool,
) -> None:
    """Calibrates the camera that took IMAGEs of AprilTags, or of one board: a chessboard, a grid of discs, an
    AprilGrid or a ChArUco board. Tags without a board have one size and may be anywhere; at least two must be visible
    in every image. Of an AprilGrid or a ChArUco board, a part suffices. Writes a folder with report.html, result.json,
    and camera files for libocc, OpenCV and ROS.

    \b
    libocc calibrate camera *.png --tag-size 0.08 --out calibrated
    libocc calibrate camera left*.jpg --chessboard 9x6 --square 0.025 --out calibrated
    libocc calibrate camera left*.jpg --circles 4x11 --spacing 0.02 --diameter 0.018 --out calibrated
    libocc calibrate camera left*.jpg --aprilgrid 6x6 --tag-size 0.088 --spacing 0.3 --out calibrated
    libocc calibrate camera left*.jpg --charuco 5x7 --square 0.04 --marker 0.03 --out calibrated

    Exit code 0: calibrated; 1: not determined or not converged (the folder has the last state);
    2: bad input.
    """
    from ..calibration import circles as discs, marker_boards, pictures

    board_kind = BoardOptions(aprilgrid, charuco, marker_m, legacy, border_cells)
    check_targets(tag_size_m, chessboard, square_m, circles, spacing_m, diameter_m, board_kind)
    marked = marker_board(board_kind, family, tag_size_m, square_m, spacing_m)
    start, keep = None, []
    if camera_path is not None:
        with error_context(camera_path):
            start = occ.read_camera(camera_path)
    settings = {"kind": "camera", "images": list(images), "tag_size_m": tag_size_m, "square_m": square_m,
                "spacing_m": spacing_m, "diameter_m": diameter_m}
    if marked is not None:
        settings["board"] = marked.text
    notes: list[str] = []
    try:
        if marked is not None:
            with progress("detecting the board", len(images)) as advance:
                parts, sizes = marker_boards.find_marker_boards(images, marked, advance)
            views: list[Any] = marker_boards.views_of(marked, parts)
        elif chessboard is not None and square_m is not None:
            with progress("detecting the board", len(images)) as advance:
                boards, sizes = pictures.find_boards(images, *chessboard, advance)
            points = pictures.board_points(*chessboard, square_m)
            views = [(points[:, :2], board[0]) for board in boards if board is not None]
        elif circles is not None and spacing_m is not None:
            with progress("detecting the grid", len(images)) as advance:
                boards, sizes = discs.find_grids(images, *circles, not symmetric, advance)
            points = discs.grid_points(*circles, not symmetric, spacing_m)
            views = [(points[:, :2], grid.px) for grid in boards if grid is not None]
        else:
            tags, sizes = pictures.find_tags(images, family)
            views = [plane_of_tag(tag) for seen in tags for tag in seen]
        size = pictures.same_size(images, sizes)
    except (OSError, ValueError) as error:
        raise Failure(str(error)) from error
    if not views:
        target, hint = f"{family} tag", "check --family, focus and light"
        if chessboard is not None:
            target = f"chessboard of {chessboard[0]}x{chessboard[1]} inner corners"
            hint = "a board has one inner corner less than squares in each direction, and must be whole in the picture"
        if circles is not None:
            target = f"{'symmetric' if symmetric else 'asymmetric'} grid of {circles[0]}x{circles[1]} discs"
            hint = "a row of an asymmetric grid has half as many discs as columns of discs; the grid must be whole"
        if marked is not None:
            target = marked.text
            hint = f"{images[0]}: {parts[0].message or 'fewer than four points'}"
        raise Failure(f"no {target} was detected in any of {len(images)} images; {hint}")
    if start is not None and (start.width, start.height) != size:
        sizes_text = f"{start.width} x {start.height} px, the images have {size[0]} x {size[1]} px"
        raise Failure(f"{camera_path}: its size is {sizes_text}")
    if start is None:
        exif, about_pictures = focal_of_pictures(images, size)
        start, notes = start_camera(model, size, views, focal_px, int(coefficients), exif)
        if focal_px is None:  # the initial focal length is an estimate, so it has no nominal value
            keep = ["fx_px", "fy_px"]
        notes += about_pictures
    free = free_parameters(start)
    if marked is not None:
        started = marker_boards.network_of_marker_boards(start, free, images, marked, parts)
        notes += marker_boards.notes_of(images, marked, parts)
        network = started.network
    elif chessboard is not None:
        started = pictures.network_of_boards(start, free, images, boards, points)
        hidden = {image: board.unfitted for image, board in zip(images, boards) if board is not None and board.unfitted}
        notes += [
            f"{image}: {count} corners are measured coarsely or predicted by their neighbours: glare, or something "
            "covers them" for image, count in hidden.items()
        ]
        network = started.network
    elif circles is not None:
        assert diameter_m is not None
        started, network, about_discs = discs.network_of_grids(start, free, images, boards, points, diameter_m / 2)
        notes += about_discs
    else:
        assert tag_size_m is not None
        started = pictures.network_of_tags(start, free, images, tags, family, tag_size_m)
        network = started.network
    if chessboard is not None or circles is not None:
        what = "chessboard" if chessboard is not None else "grid of discs"
        missing = [image for image, board in zip(images, boards) if board is None]
        notes += [f"{image}: no {what} was detected; the image is not used" for image in missing]
    if not started.ok:
        raise Failure(f"{started.status.name}: {started.message}")
    notes += started.warnings
    add_distances(network, distance)
    finish(ctx, network, occ.network.Datum(kind=occ.network.DatumKind[datum_kind or "inner"]), out=out,
           title=f"Camera from {len(images)} images", select=select, ladder=ladder, robust=robust, as_json=as_json,
           settings=settings, notes=notes, before=start, keep=keep)
