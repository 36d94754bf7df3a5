# SPDX-License-Identifier: Apache-2.0
"""Chessboards in pictures as a phone takes them: mosaic, sharpening and JPEG; recall and honest covariances."""

import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageFilter

import libocc as occ

Pixels = NDArray[np.uint8]
EXTRA_DATA = Path(__file__).resolve().parents[3] / "shared/data"


def demosaiced(raw: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bilinear interpolation of a mosaic with the pattern RGGB."""
    row, column = np.indices(raw.shape)
    colours = []
    masks = [(row % 2 == 0) & (column % 2 == 0), (row + column) % 2 == 1, (row % 2 == 1) & (column % 2 == 1)]
    for mask in masks:
        sums, counts = np.zeros_like(raw), np.zeros_like(raw)
        for dy, dx, weight in [(y, x, (2 - abs(y)) * (2 - abs(x))) for y in (-1, 0, 1) for x in (-1, 0, 1)]:
            shifted = np.roll(np.where(mask, raw, 0), (dy, dx), (0, 1))
            sums += weight * shifted
            counts += weight * np.roll(mask, (dy, dx), (0, 1))
        colours.append(sums / counts)
    return np.stack(colours, axis=-1)


def phone_picture(pixels: Pixels, seed: int, *, noise_dn: float = 2.5, quality: int = 88, blur_px: float = 0) -> Pixels:
    """The picture that a phone makes of grey levels: defocus, shot noise, mosaic, sharpening, JPEG."""
    random = np.random.default_rng(seed)
    scene = np.asarray(Image.fromarray(pixels).filter(ImageFilter.GaussianBlur(blur_px)), float)
    raw = scene + noise_dn * np.sqrt(0.3 + scene / 150) * random.standard_normal(scene.shape)
    colours = Image.fromarray(demosaiced(raw).round().clip(0, 255).astype(np.uint8))
    sharp = colours.filter(ImageFilter.UnsharpMask(radius=1, percent=70, threshold=0))
    file = io.BytesIO()
    sharp.save(file, "jpeg", quality=quality)
    return np.asarray(Image.open(file))


def board_view(
    seed: int, *, max_tilt_deg: float = 40, share: float = 0.5, **options: Any
) -> tuple[Pixels, NDArray[np.float64]]:
    """A rendered board in a random pose, and its true corners. share: width of the board in the image."""
    random = np.random.default_rng(seed)
    camera = occ.Camera.pinhole(
        width=960, height=720, fx_px=760, fy_px=762, cx_px=483, cy_px=356, distortion=[-0.12, 0.04, 0, 0]
    )
    tilt, azimuth, roll = math.radians(max_tilt_deg) * random.uniform(0.2, 1), *random.uniform(0, 2 * math.pi, 2)
    away = [math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), -math.cos(tilt)]
    middle = np.array([0.1, 0.0625, 0])
    pose = occ.look_at(
        position_m=middle + 0.25 * 760 / (share * 960) * np.array(away), target_m=middle,
        up=[math.cos(roll), math.sin(roll), 0],
    )
    renderer = occ.targets.TargetRenderer(
        camera, pose, boards=[occ.targets.ChessboardTarget(square_m=0.025)], psf_sigma_px=0.8, **options
    )
    assert renderer.boards[0].whole
    return renderer.window(0, 0, 960, 720).astype(np.uint8), renderer.boards[0].corners_px


@pytest.mark.parametrize(
    ("quality", "blur_px", "light"), [(92, 0, 0.0), (85, 0, 0.6), (88, 1.5, 0.3)], ids=["sharp", "uneven", "blurred"]
)
def test_covariances_are_honest_in_pictures_of_a_phone(quality: int, blur_px: float, light: float) -> None:
    normalised = []
    for seed in range(8):
        pixels, truth = board_view(seed)
        ramp = 1 - light * np.linspace(0, 1, pixels.shape[1])[None, :]
        lit = (pixels * ramp).round().astype(np.uint8)
        found = occ.targets.find_chessboard(phone_picture(lit, seed, quality=quality, blur_px=blur_px), 9, 6)
        assert found is not None, seed
        off = found[0] - truth
        assert np.abs(off).max() < 0.5
        normalised.append(np.einsum("ki,kij,kj->k", off, np.linalg.inv(np.array(found[1])), off).mean() / 2)
    assert 0.4 < np.mean(normalised) < 1.8


def test_boards_are_found_tilted_far_dark_and_blurred() -> None:
    for seed in range(6):
        for options in ({"max_tilt_deg": 62}, {"share": 0.08}, {"black_dn": 4, "white_dn": 16, "ground_dn": 10}):
            pixels, truth = board_view(seed, **options)
            noise_dn = 0.8 if "white_dn" in options else 2.5
            found = occ.targets.find_chessboard(phone_picture(pixels, seed, noise_dn=noise_dn), 9, 6)
            assert found is not None and np.abs(found[0] - truth).max() < 1, (seed, options)
        pixels, truth = board_view(seed)
        found = occ.targets.find_chessboard(phone_picture(pixels, seed, blur_px=4), 9, 6)
        assert found is not None and np.abs(found[0] - truth).max() < 1.5, seed


def test_hidden_corners_are_named(libocc: Callable[..., tuple[int, str, str]]) -> None:
    for seed in range(4):
        pixels, truth = board_view(seed)
        if seed == 2:
            x, y = truth[20].round().astype(int)
            pixels[y - 14 : y + 15, x - 14 : x + 15] = 255
        occ.write_image(f"{seed}.png", phone_picture(pixels, seed))
    names = [f"{seed}.png" for seed in range(4)]
    code, out, err = libocc("calibrate", "camera", *names, "--chessboard", "9x6", "--square", 0.025, "--out", "out")
    assert code == 0, err
    notes = [line for line in (out + err).splitlines() if "measured coarsely" in line]
    assert len(notes) == 1 and "2.png: 1 corners" in notes[0]


def test_photographs_without_a_board_have_none() -> None:
    pictures = sorted(EXTRA_DATA.glob("ring/*.png")) + sorted(EXTRA_DATA.glob("luxapose/*.jpg"))
    if not pictures:
        pytest.skip("the photographs are not in this checkout")
    for path in pictures:
        for size in ((3, 3), (4, 3), (9, 6)):
            assert occ.targets.find_chessboard(occ.read_image(path), *size) is None, path
