# SPDX-License-Identifier: Apache-2.0
"""Detection of tags and chessboards in images, and initial networks from the detections."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import (
    AprilTag,
    Camera,
    NetworkStart,
    adjust,
    board_network,
    detect_april_tags,
    find_chessboard,
    read_image,
    start_network,
)
from ..progress import Advance, progress

TILED_PX = 6000  # images with a longer side are searched by tiles, which limits the memory
TILE_PX, OVERLAP_PX = 3000, 600  # the overlap is the max size of a tag


def read_pixels(path: str) -> NDArray[Any]:
    """Reads an image; .npy and .pgm files are memory-mapped. Raises: OSError; ValueError."""
    if Path(path).suffix.lower() == ".npy":
        return np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
    if Path(path).suffix.lower() == ".pgm":
        mapped = map_pgm(path)
        if mapped is not None:
            return mapped
    return np.asarray(read_image(path))


def map_pgm(path: str) -> NDArray[np.uint8] | None:
    """Memory-maps a binary PGM file with 8 bits; None for other kinds."""
    with open(path, "rb") as file:
        head = file.read(512)
    fields: list[bytes] = []
    at = 0
    while len(fields) < 4:
        end = at
        while end < len(head) and not head[end : end + 1].isspace():
            end += 1
        if head[at : at + 1] == b"#":
            at = head.find(b"\n", at) + 1
            continue
        if end > at:
            fields.append(head[at:end])
        at = end + 1
        if at >= len(head):
            return None
    if fields[0] != b"P5" or fields[3] != b"255":
        return None
    return np.memmap(path, np.uint8, "r", at, (int(fields[2]), int(fields[1])))


def find_tags(
    images: Sequence[str], family: str, camera: Camera | None = None
) -> tuple[list[list[AprilTag]], list[tuple[int, int]]]:
    """Tags and size (width, height) of each image.

    camera: models the lens distortion along the sides of the tags, if known.
    Raises: OSError; ValueError naming the file.
    """
    found, sizes = [], []
    with progress("detecting tags" if camera is None else "detecting tags again", len(images)) as advance:
        for path in images:
            try:
                pixels = read_pixels(path)
                large = max(pixels.shape[:2]) > TILED_PX
                found.append(detect_april_tags(
                    pixels, family=family, camera=camera, tile_px=TILE_PX if large else 0, overlap_px=OVERLAP_PX,
                    progress=lambda *_: advance(0),
                ))
            except (OSError, ValueError) as error:
                text = str(error)
                raise type(error)(text if text.startswith(path) else f"{path}: {text}") from error
            sizes.append((pixels.shape[1], pixels.shape[0]))
            advance()
    return found, sizes


def same_size(images: Sequence[str], sizes: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Size of all images. Raises: ValueError naming the image whose size differs from that of the first."""
    for path, size in zip(images, sizes):
        if size != sizes[0]:
            turned = "; one of them was rotated after it was taken: use the camera's original files"
            raise ValueError(
                f"{path}: its size is {size[0]} x {size[1]} px, "
                f"that of {images[0]} is {sizes[0][0]} x {sizes[0][1]} px: "
                f"all images of a camera must have one size{turned if size == sizes[0][::-1] else ''}"
            )
    return sizes[0]


def short_names(images: Sequence[str]) -> list[str]:
    """File names, or the paths if the names are not unique."""
    names = [Path(path).name for path in images]
    return names if len(set(names)) == len(names) else list(images)


def network_of_tags(
    camera: Camera, free: Sequence[str], images: Sequence[str], tags: Sequence[Sequence[AprilTag]], family: str,
    tag_size_m: float, free_sizes: bool = False,
) -> NetworkStart:
    """Initial network from images of tags.

    The corners are detected twice; the second detection uses the camera of the first adjustment, which halves their
    errors. free_sizes: tag_size_m is approximate, and the size of every tag is estimated.
    """
    first = start_of_tags(camera, free, images, tags, tag_size_m, free_sizes)
    if not first.ok:
        return first
    adjusted = adjust(first.network)
    if not adjusted.ok:
        return first
    known = adjusted.network.cameras[0]
    again, _ = find_tags(images, family, known)
    second = start_of_tags(known, free, images, again, tag_size_m, free_sizes)
    return second if second.ok else first


def start_of_tags(
    camera: Camera, free: Sequence[str], images: Sequence[str], tags: Sequence[Sequence[AprilTag]], tag_size_m: float,
    free_sizes: bool,
) -> NetworkStart:
    ids = sorted({tag.id for seen in tags for tag in seen}) if free_sizes else []
    return start_network(
        [("camera", camera, list(free))],
        [(name, 0, list(seen)) for name, seen in zip(short_names(images), tags)],
        tag_size_m=tag_size_m, free_sizes=ids,
    )


def board_points(columns: int, rows: int, square_m: float) -> NDArray[np.float64]:
    """Inner corners (n, 3), row by row, in the board's plane."""
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2) * square_m
    return np.column_stack([grid, np.zeros(len(grid))])


def find_in_images(
    images: Sequence[str], find: Callable[[Any], Any], advance: Advance
) -> tuple[list[Any], list[tuple[int, int]]]:
    """Result of `find` for the pixels of each image, and the size (width, height) of each image.

    Raises: OSError; ValueError naming the file.
    """
    found, sizes = [], []
    for path in images:
        try:
            pixels = read_pixels(path)
            found.append(find(pixels))
        except (OSError, ValueError) as error:
            text = str(error)
            raise type(error)(text if text.startswith(path) else f"{path}: {text}") from error
        sizes.append((pixels.shape[1], pixels.shape[0]))
        advance()
    return found, sizes


def find_boards(
    images: Sequence[str], columns: int, rows: int, advance: Advance
) -> tuple[list[Any], list[tuple[int, int]]]:
    """(corners (n, 2), covariances) of each image, or None, and the sizes; raises as find_in_images()."""
    return find_in_images(images, lambda pixels: find_chessboard(pixels, columns, rows), advance)


def network_of_boards(
    camera: Camera, free: Sequence[str], images: Sequence[str], boards: Sequence[Any], points_m: NDArray[np.float64],
) -> NetworkStart:
    """Initial network from the images in which the board was detected."""
    seen = [(name, 0, *board) for name, board in zip(short_names(images), boards) if board is not None]
    return board_network([("camera", camera, list(free))], points_m, seen)
