# SPDX-License-Identifier: Apache-2.0
"""Images from numpy arrays: accepted types, no copies, and errors."""

import sys
import threading
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import libocc as occ


def spot(dtype=np.uint8, height=40, width=60):
    image = np.full((height, width), 10, dtype)
    image[10:13, 20:23] = 200
    return image


def centroids(image, **options):
    return [blob.centroid_px.round(3).tolist() for blob in occ.detect(image, **options)]


EXPECTED = [[21.0, 11.0]]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_grey_and_colour_of_both_depths(dtype):
    grey = spot(dtype)
    assert centroids(grey) == EXPECTED
    assert centroids(np.dstack([grey] * 3)) == EXPECTED
    assert centroids(np.dstack([grey] * 4)) == EXPECTED
    assert centroids(grey[..., None]) == EXPECTED


def test_any_strides():
    grey = spot()
    assert centroids(np.asfortranarray(grey)) == EXPECTED
    assert centroids(np.pad(grey, 7)[7:-7, 7:-7]) == EXPECTED
    assert centroids(grey[::-1][::-1]) == EXPECTED
    assert centroids(grey[:, ::-1]) == [[38.0, 11.0]]
    assert centroids(grey[::-1]) == [[21.0, 28.0]]
    assert centroids(np.repeat(grey, 2, axis=1)[:, ::2]) == EXPECTED
    read_only = spot()
    read_only.flags.writeable = False
    assert centroids(read_only) == EXPECTED


def allocated_by_numpy(image):
    tracemalloc.start()
    occ.detect(image)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_unaligned_pixels_are_read():
    """A frame in a buffer with a header of odd length, as sockets and video pipes give it."""
    pixels = 100 * spot(np.uint16)
    buffer = np.frombuffer(b"x" + pixels.tobytes(), np.uint8)
    image = buffer[1:].view(np.uint16).reshape(pixels.shape)
    assert not image.flags.aligned
    assert centroids(image) == EXPECTED
    rows = np.zeros((40, 121), np.uint8)  # rows of an odd number of bytes
    rows[:, :120] = pixels.view(np.uint8)
    assert centroids(rows[:, :120].view(np.uint16)) == EXPECTED


def test_pixels_are_copied_only_when_a_row_is_not_packed():
    wide = spot(height=500, width=1000)
    assert allocated_by_numpy(wide) < 10_000
    assert allocated_by_numpy(wide[:, 10:900]) < 10_000
    assert allocated_by_numpy(np.dstack([wide] * 3)) < 10_000
    assert allocated_by_numpy(wide[:, ::-1]) >= wide.size


@pytest.mark.parametrize(
    "image, error, text",
    [
        (np.zeros((40, 60)), TypeError, r"uint8 or uint16.*got float64 of shape \(40, 60\)"),
        (np.full((40, 60), np.nan, np.float32), TypeError, "got float32"),
        (np.zeros((40, 60), bool), TypeError, "got bool"),
        (np.zeros((40, 60), np.int32), TypeError, "got int32"),
        (np.zeros((40, 60), ">u2"), TypeError, "got >u2"),
        (np.zeros((40, 60), np.complex64), TypeError, "got complex64"),
        ([[1, 2], [3, 4]], TypeError, "got list"),
        (None, TypeError, "got NoneType"),
        ("photo.png", TypeError, "got str"),
        (np.zeros(40, np.uint8), ValueError, r"got uint8 of shape \(40,\)"),
        (np.zeros((2, 3, 4, 3), np.uint8), ValueError, r"\(2, 3, 4, 3\)"),
        (np.zeros((40, 60, 2), np.uint8), ValueError, r"\(40, 60, 2\)"),
        (np.zeros((40, 60, 5), np.uint8), ValueError, r"\(40, 60, 5\)"),
        (np.zeros((0, 60), np.uint8), ValueError, r"\(0, 60\)"),
        (np.zeros((40, 0), np.uint16), ValueError, r"\(40, 0\)"),
        (np.zeros((), np.uint8), ValueError, r"\(\)"),
    ],
)
def test_other_images_are_rejected_with_their_type(image, error, text, scene):
    for call in (occ.detect, lambda image: occ.locate(image, scene)):
        with pytest.raises(error, match=text):
            call(image)


def test_a_huge_image_is_rejected_without_reading_it():
    """A broadcast array has 4e12 pixels but stores one."""
    huge = np.broadcast_to(np.uint8(0), (2_000_000, 2_000_000))
    with pytest.raises(ValueError, match="2000000"):
        occ.detect(huge)


@pytest.mark.parametrize("level", [0, 128, 255])
def test_flat_images_hold_no_lamps(level, scene):
    flat = np.full((480, 640), level, np.uint8)
    fix = occ.locate(flat, scene)
    assert not fix.ok and fix.message
    assert fix.status in (occ.Status.no_lamps, occ.Status.too_few_lamps)
    assert fix.candidates == [] and fix.lamps == {}


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (2, 3)])
def test_tiny_images_are_no_error(shape):
    assert isinstance(occ.detect(np.full(shape, 255, np.uint8)), list)


def test_files_keep_their_pixels(tmp_path: Path):
    grey = spot(np.uint16) * 100
    occ.write_image(tmp_path / "deep.png", grey)
    assert occ.read_image(tmp_path / "deep.png").dtype == np.uint16
    assert np.array_equal(occ.read_image(tmp_path / "deep.png"), grey)
    colour = np.dstack([spot(), spot() + 1, spot() + 2])
    occ.write_image(str(tmp_path / "colour.png"), colour)
    assert np.array_equal(occ.read_image(str(tmp_path / "colour.png")), colour)


def test_read_pixels_outlive_the_call(tmp_path: Path):
    occ.write_image(tmp_path / "a.png", spot())
    kept = [occ.read_image(tmp_path / "a.png") for _ in range(50)]
    kept[0][:] = 0
    assert all(np.array_equal(pixels, spot()) for pixels in kept[1:])


def test_bad_files_are_named(tmp_path: Path):
    whole = tmp_path / "whole.png"
    occ.write_image(whole, spot(height=400, width=600))
    cut = tmp_path / "cut.png"
    cut.write_bytes(whole.read_bytes()[:-40])
    text = tmp_path / "text.png"
    text.write_text("not an image")
    for path in (cut, text):
        with pytest.raises(ValueError, match=path.name):
            occ.read_image(path)
    with pytest.raises(FileNotFoundError, match="nosuch.png"):
        occ.read_image(tmp_path / "nosuch.png")
    with pytest.raises(OSError, match="nowhere"):
        occ.write_image(tmp_path / "nowhere" / "a.png", spot())


def test_other_formats_are_named(tmp_path: Path):
    photo = tmp_path / "photo.jpg"  # phones and browsers store other formats under this name
    photo.write_bytes(b"\0\0\0\x20ftypheic\0\0\0\0mif1heic")
    with pytest.raises(ValueError, match=r"photo.jpg: is a HEIC picture, .* convert it to JPEG or PNG"):
        occ.read_image(photo)
    photo.write_bytes(b"RIFF\x24\0\0\0WEBPVP8 ")
    with pytest.raises(ValueError, match=r"photo.jpg: is a WebP picture"):
        occ.read_image(photo)
    with pytest.raises(OSError, match=r'a.webp: cannot be encoded as ".webp"; the formats are .png, .jpg'):
        occ.write_image(tmp_path / "a.webp", spot())
    with pytest.raises(ValueError, match=r'".jpg" cannot store 4-channel images; use .png or .tiff'):
        occ.encode_image(np.dstack([spot()] * 4), ".jpg")


@pytest.mark.parametrize("name", ["a.png", "a.tiff", "a.ppm", "a.jpg"])
def test_other_libraries_read_the_same_pixels(name: str, tmp_path: Path):
    colour = np.dstack([spot(), spot() // 2, spot() // 3])
    occ.write_image(tmp_path / name, colour)
    with Image.open(tmp_path / name) as image:
        assert np.array_equal(occ.read_image(tmp_path / name), np.asarray(image))


def test_the_interpreter_runs_while_an_image_is_searched():
    """detect() releases the GIL: the other thread can run only then, because thread switching is disabled."""
    noise = np.random.default_rng(1).integers(0, 255, (1000, 2000), np.uint8)
    may_run = threading.Event()
    ran = []
    other = threading.Thread(target=lambda: (may_run.wait(), ran.append(True)))
    other.start()
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        may_run.set()
        deadline_s = time.monotonic() + 30  # on a busy machine the other thread may start late
        while not ran and time.monotonic() < deadline_s:
            occ.detect(noise, rims=False)
    finally:
        sys.setswitchinterval(usual)
    seen = list(ran)
    other.join()
    assert seen
