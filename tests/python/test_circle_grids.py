# SPDX-License-Identifier: Apache-2.0
"""Grids of discs: sheets to print, detection, and calibration with the exact images of the discs."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_support import errors_in_sigmas

import libocc as occ
from libocc.cli import target_sheets

Run = Callable[..., tuple[int, str, str]]
CAMERA = occ.Camera.pinhole(
    width=800, height=600, fx_px=640, fy_px=642, cx_px=405, cy_px=296, distortion=[-0.2, 0.07, 1e-3, -5e-4, 0]
)
GRID = occ.targets.CircleGridTarget(spacing_m=0.02, radius_m=0.009)  # 4x11, asymmetric
DPI = 200


@pytest.fixture(scope="module")
def pictures() -> list[Any]:
    """Pictures of the grid, tilted by 40 degrees."""
    found = []
    for i in range(8):
        azimuth, tilt = 0.8 * i, math.radians([8, 40, 40][i % 3])
        middle = np.array([0.07 + 0.03 * math.cos(2.4 * i), 0.1 + 0.03 * math.sin(2.4 * i), 0])
        away = [math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), -math.cos(tilt)]
        up = [[0, -1, 0], [1, 0, 0]][i % 2]
        pose = occ.look_at(position_m=middle + 0.36 * np.array(away), target_m=middle, up=up)
        renderer = occ.targets.TargetRenderer(CAMERA, pose, grids=[GRID], noise_dn=1, seed=i)
        assert renderer.grids[0].whole
        found.append(renderer.window(0, 0, 800, 600))
    return found


def test_pictures_of_discs_calibrate_the_camera(libocc: Run, pictures: list[Any]) -> None:
    for i, pixels in enumerate(pictures):
        occ.write_image(f"{i}.png", pixels)
    occ.write_image("none.png", np.full((600, 800), 90, np.uint8))
    names = [f"{i}.png" for i in range(len(pictures))]
    options = ("--circles", "4x11", "--spacing", 0.02, "--diameter", 0.018)
    code, text, err = libocc("calibrate", "camera", *names, "none.png", *options, "--out", "out")
    assert code == 0, err
    assert "none.png: no grid of discs was detected; the image is not used" in text + err
    off = errors_in_sigmas(Path("out"), CAMERA)
    assert len(off) == 9 and max(map(abs, off.values())) < 4.5
    # Discs of a tenth of the size have the centres of their ellipses: the plain centres are biased.
    small = ("--circles", "4x11", "--spacing", 0.02, "--diameter", 0.0018)
    code, _, err = libocc("calibrate", "camera", *names, *small, "--no-robust", "--out", "plain")
    plain = errors_in_sigmas(Path("plain"), CAMERA)
    assert np.square(list(plain.values())).mean() > 4 * np.square(list(off.values())).mean()


def test_the_exact_image_of_a_disc_has_no_bias(pictures: list[Any]) -> None:
    points = np.column_stack([occ.targets.circle_grid_positions(4, 11, True, 0.02), np.zeros(44)])
    seen = []
    for i, pixels in enumerate(pictures):
        found = occ.targets.find_circle_grid(pixels, 4, 11)
        assert found is not None and found.dark and found.unfitted == 0
        seen.append((str(i), 0, found.px, found.covariance_px2))
    network = occ.network.board_network([("camera", CAMERA, [])], points, seen).network
    plain = occ.network.adjust(network, robust=False, snooping=False)
    assert occ.targets.correct_disc_centres(network, seen, 0.009) == 0
    corrected = occ.network.adjust(network, robust=False, snooping=False)
    # sigma0 is the root of the normalised squared residuals. The poses absorb most of the bias.
    assert 0.3 < corrected.sigma0 < 1.2 and plain.sigma0 > 1.1 * corrected.sigma0
    with pytest.raises(ValueError, match="radius_m"):
        occ.targets.correct_disc_centres(network, seen, 0)


@pytest.mark.parametrize("symmetric", [False, True])
def test_a_sheet_of_discs_has_its_scale(libocc: Run, symmetric: bool) -> None:
    kind, flags = ("symmetric", ["--symmetric"]) if symmetric else ("asymmetric", [])
    columns, rows = (7, 5) if symmetric else (4, 11)
    size = f"{columns}x{rows}"
    sizes = ("--spacing", 0.02, "--diameter", 0.012)
    for suffix in ("pdf", "svg"):
        code, out, err = libocc("targets", "--circles", size, *flags, *sizes, "--out", f"discs.{suffix}")
        assert code == 0, err
        assert f"{kind} grid of {size} discs, spacing 20 mm, diameter 12 mm; 1 page of A4" in out
        assert Path(f"discs.{suffix}").stat().st_size > 1000
    discs = target_sheets.circle_grid(columns, rows, not symmetric, 0.02, 0.012)
    (page,) = target_sheets.pages([discs], "A4", "footer")
    target_sheets.draw(page).savefig("page.png", dpi=DPI)
    pixels = occ.read_image("page.png")
    found = occ.targets.find_circle_grid(pixels, columns, rows, asymmetric=not symmetric)
    assert found is not None
    mm = (found.px + 0.5) * 25.4 / DPI
    mm[:, 1] += page.height_mm - pixels.shape[0] * 25.4 / DPI  # the last row of pixels is whole, not the first one
    placed = page.targets[0]
    expected = discs.centres_mm + [placed.x_mm, placed.y_mm]
    turned = expected[::-1] if symmetric and np.abs(mm - expected).max() > 1 else expected
    np.testing.assert_allclose(mm, turned, atol=0.05)


def test_wrong_options_are_named(libocc: Run) -> None:
    for options, message in (
        (("--circles", "4x11"), "--circles needs --spacing and --diameter"),
        (("--circles", "4"), "must be COLUMNSxROWS of discs"),
        (("--circles", "4x11", "--spacing", 0.01, "--diameter", 0.02), "touch"),
        (("--circles", "4x11", "--spacing", 0.02, "--diameter", 0.01, "--tag-size", 0.1), "give either"),
    ):
        code, _, err = libocc("targets", *options, "--out", "x.pdf")
        assert code == 2 and message in err
        assert not Path("x.pdf").exists()
