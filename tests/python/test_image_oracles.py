# SPDX-License-Identifier: Apache-2.0
"""Rendered light compared with reference images: by Fourier transform and by exact areas."""

import numpy as np
import pytest
from image_oracles import bessel_j1, disc_overlaps, ellipses, fourier_image, mean_electrons

import libocc as occ

PARTS = 32  # parts of a grey level: 3e-7 of the peak
FINE_PARTS = 400  # 2e-8


def even_scene(psf_px: float, radius_px: float = 10, **sensor: object) -> occ.Scene:
    """Two discs with uniform radiance at 3 m; focal length 300 px."""
    effects = occ.Effects(light_gradient=occ.rendering.Use.off, **({} if psf_px else {"psf": occ.rendering.Use.off}))
    radius_m = radius_px / 100
    lamps = [
        occ.Lamp(id=0, centre_m=[-0.4037, -0.113, 3], radius_m=radius_m),
        occ.Lamp(id=1, centre_m=[0.3891, 0.1402, 3], radius_m=0.7 * radius_m),
    ]
    camera = occ.Camera.pinhole(width=180, height=120, fx_px=300, fy_px=300, cx_px=89.5, cy_px=59.5)
    return occ.Scene(
        camera=camera, lamps=lamps, sensor=occ.Sensor(psf_sigma_px=psf_px or 1.0), effects=effects
    )


POSES = {
    "upright": np.eye(4),
    "tilted": occ.look_at([0.35, -0.2, 0.3], [0.02, 0.03, 3], [0, 1, 0]),
    "steep": occ.look_at([1.4, 0.3, 1.1], [0, 0, 3], [0, 1, 0]),
}


def test_bessel_function_has_its_known_values():
    known = {0: 0, 1: 0.44005058574493351596, 3.8317059702075123156: 0, 50: -0.09751182812517513}
    assert np.allclose(bessel_j1(np.array(list(known))), list(known.values()), atol=1e-14)


def test_overlaps_are_areas():
    area = disc_overlaps([7.3, 5.9], 4.7, 15, 12)
    assert area.sum() == pytest.approx(np.pi * 4.7**2, rel=1e-13)
    assert area.min() > -1e-13 and area.max() < 1 + 1e-13
    fine = (np.arange(1000) + 0.5) / 1000
    x, y = np.meshgrid(10.5 + fine, 7.5 + fine)  # pixel (11, 8), which the rim crosses
    assert 0.1 < area[8, 11] < 0.95
    assert area[8, 11] == pytest.approx((np.hypot(x - 7.3, y - 5.9) < 4.7).mean(), abs=2e-5)
    assert disc_overlaps([0, 0], 0.2, 1, 1)[0, 0] == pytest.approx(np.pi * 0.04, rel=1e-12)


@pytest.mark.parametrize("view", POSES)
@pytest.mark.parametrize("psf_px", [0.5, 0.8, 1.5])
def test_the_rim_integral_is_the_fourier_image(view, psf_px):
    scene, pose = even_scene(psf_px), POSES[view]
    truth = fourier_image(scene, pose)
    rendered = mean_electrons(scene, pose, truth.max(), PARTS)
    assert np.abs(rendered - truth).max() < 5e-6 * truth.max()
    lamps = occ.simulate(scene, pose)[1].lamps
    for lamp, ellipse in zip(lamps, ellipses(scene, pose), strict=True):
        assert lamp.electrons == pytest.approx(ellipse.electrons * ellipse.area, rel=2e-6)


def test_coarse_rims_are_seen_to_err():
    scene, pose = even_scene(0.8), POSES["tilted"]
    truth = fourier_image(scene, pose)
    errors = [
        np.abs(mean_electrons(scene, pose, truth.max(), 8, spacing_sigma=s) - truth).max() / truth.max()
        for s in (2, 1.75, 1.5, 1.25, 1)
    ]
    assert errors[0] > 3e-3 and errors == sorted(errors, reverse=True) and errors[-1] < 5e-6


@pytest.mark.parametrize("radius_px", [0.37, 3.2, 17.3])
def test_without_blur_pixels_hold_exact_areas(radius_px):
    scene = even_scene(0, radius_px)
    peak = max(e.electrons for e in ellipses(scene, np.eye(4)))
    rendered = mean_electrons(scene, np.eye(4), peak, FINE_PARTS)
    truth = np.zeros_like(rendered)
    for ellipse in ellipses(scene, np.eye(4)):
        radius = np.sqrt(ellipse.area / np.pi)
        truth += ellipse.electrons * disc_overlaps(ellipse.centre, radius, 180, 120)
    assert np.abs(rendered - truth).max() < 1e-7 * peak


def test_without_blur_pixels_hold_the_areas_of_photutils():
    geometry = pytest.importorskip("photutils.geometry")
    scene = even_scene(0)
    for view in ("upright", "steep"):
        pose = POSES[view]
        seen = ellipses(scene, pose)
        peak = max(e.electrons for e in seen)
        truth = np.zeros((120, 180))
        for ellipse in seen:
            (x, y), (axes, lengths, _) = ellipse.centre, np.linalg.svd(ellipse.shape)
            turn = np.arctan2(axes[1, 0], axes[0, 0])
            window = (-0.5 - x, 179.5 - x, -0.5 - y, 119.5 - y, 180, 120, *lengths, turn, 1, 1)
            truth += ellipse.electrons * geometry.elliptical_overlap_grid(*window)
        assert np.abs(mean_electrons(scene, pose, peak, FINE_PARTS) - truth).max() < 1e-7 * peak


def test_truth_excludes_disabled_effects():
    scene, pose = even_scene(0.8), POSES["tilted"]
    plain = occ.simulate(scene, pose)[1].lamps[0]
    bent = occ.Camera.pinhole(
        width=180, height=120, fx_px=300, fy_px=300, cx_px=89.5, cy_px=59.5, distortion=[-0.3, 0.1, 0, 0]
    )
    straight = occ.Effects(light_gradient=occ.rendering.Use.off, distortion=occ.rendering.Use.off)
    lamp = occ.simulate(scene.replace(camera=bent, effects=straight), pose)[1].lamps[0]
    assert np.array_equal(lamp.rim_px, plain.rim_px) and np.array_equal(lamp.image_centre_px, plain.image_centre_px)
    curved = occ.simulate(scene.replace(camera=bent), pose)[1].lamps[0]
    assert np.abs(curved.rim_px - plain.rim_px).max() > 0.1
