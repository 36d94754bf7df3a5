# SPDX-License-Identifier: Apache-2.0
"""Reference images of discs with uniform radiance, computed independently of libocc's image formation."""

from typing import Any

import numpy as np

import libocc as occ

Array = Any
PLANCK_TIMES_LIGHT = 6.62607015e-34 * 299792458.0
FULL_DN = 60000.0


class ImageEllipse:
    """Image of a disc in a pinhole camera: {centre + shape s, |s| <= 1}, and electrons of a pixel inside."""

    def __init__(self, lamp: occ.Lamp, pose: Array, scene: occ.Scene) -> None:
        camera = scene.camera
        normal = pose[:3, :3] @ np.asarray(lamp.normal, float)
        normal /= np.linalg.norm(normal)
        middle = pose[:3, :3] @ np.asarray(lamp.centre_m, float) + pose[:3, 3]
        across = np.cross(normal, [0, 0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0, 0])
        across /= np.linalg.norm(across)
        along = np.cross(normal, across)
        k = np.array([[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]])
        # The unit circle of the lamp's plane through its homography to the image.
        to_plane = np.linalg.inv(k @ np.column_stack([lamp.radius_m * across, lamp.radius_m * along, middle]))
        conic = to_plane.T @ np.diag([1.0, 1, -1]) @ to_plane
        a, b = conic[:2, :2], conic[:2, 2]
        self.centre = -np.linalg.solve(a, b)
        size = self.centre @ a @ self.centre - conic[2, 2]
        self.shape = np.linalg.inv(np.linalg.cholesky(a / size)).T
        self.area = float(np.pi * abs(np.linalg.det(self.shape)))

        distance = float(np.linalg.norm(middle))
        order = occ.photometry.lambertian_order(lamp.half_power_rad)
        bright = occ.photometry.radiance(lamp.power_w, order, np.pi * lamp.radius_m**2, -normal @ middle / distance)
        sensor = scene.sensor
        irradiance = np.pi / 4 / sensor.f_number**2 * (middle[2] / distance) ** 4 * bright
        photon_j = PLANCK_TIMES_LIGHT / sensor.wavelength_m
        seen_j = irradiance * sensor.pixel_pitch_m**2 * sensor.exposure_s
        self.electrons = float(sensor.quantum_efficiency * seen_j / photon_j)


def ellipses(scene: occ.Scene, pose: Array) -> list[ImageEllipse]:
    return [ImageEllipse(lamp, pose, scene) for lamp in scene.lamps]


def bessel_j1(x: Array) -> Array:
    """Bessel's integral by the trapezoid rule; exact up to rounding with more nodes than x."""
    nodes = int(np.max(x, initial=0) / 2) + 25
    angles = (np.arange(nodes) + 0.5) * np.pi / nodes
    total = np.zeros_like(x)
    for angle in angles:
        total += np.cos(angle - x * np.sin(angle))
    return total / nodes


def fourier_window(ellipse: ImageEllipse, sigma_px: float) -> tuple[int, int, Array]:
    """(x0, y0, coverage): blurred ellipse over all pixels that it affects.

    Product of the transforms of ellipse, Gaussian and pixel; sampling at the pixels folds its
    frequencies beyond pi back.
    """
    reach = np.abs(ellipse.shape).sum(axis=1).max() + 8 * sigma_px + 3
    size = 8 * int(np.ceil(reach / 4))
    x0, y0 = (np.floor(ellipse.centre) - size // 2).astype(int)
    folds = int(np.ceil(6.5 / sigma_px / (2 * np.pi)))
    base = 2 * np.pi * np.fft.fftfreq(size)
    spectrum = np.zeros((size, size), complex)
    place = ellipse.centre - [x0, y0]
    for fold_x in range(-folds, folds + 1):
        for fold_y in range(-folds, folds + 1):
            kx, ky = np.meshgrid(base + 2 * np.pi * fold_x, base + 2 * np.pi * fold_y)
            blur = np.exp(-0.5 * sigma_px**2 * (kx**2 + ky**2))
            if blur.max() < 1e-12:
                continue
            pixel = np.sinc(kx / (2 * np.pi)) * np.sinc(ky / (2 * np.pi))
            turned = np.hypot(*(np.tensordot(ellipse.shape.T, [kx, ky], 1)))
            disc = np.where(turned < 1e-9, 1.0, 2 * bessel_j1(turned) / np.maximum(turned, 1e-9))
            spectrum += disc * blur * pixel * np.exp(-1j * (kx * place[0] + ky * place[1]))
    return int(x0), int(y0), ellipse.area * np.fft.ifft2(spectrum).real


def fourier_image(scene: occ.Scene, pose: Array) -> Array:
    """Mean electrons of every pixel for a scene of discs with uniform radiance."""
    image = np.zeros((scene.camera.height, scene.camera.width))
    for ellipse in ellipses(scene, pose):
        x0, y0, window = fourier_window(ellipse, scene.sensor.psf_sigma_px)
        size = len(window)
        ys = slice(max(y0, 0), min(y0 + size, image.shape[0]))
        xs = slice(max(x0, 0), min(x0 + size, image.shape[1]))
        inside = window[ys.start - y0 : ys.stop - y0, xs.start - x0 : xs.stop - x0]
        image[ys, xs] += ellipse.electrons * inside
    return image


def disc_overlaps(centre: Array, radius: float, width: int, height: int) -> Array:
    """Exact area of a disc in each pixel: differences of its areas left of and above a corner."""
    x, y = np.arange(width + 1) - 0.5 - centre[0], np.arange(height + 1) - 0.5 - centre[1]
    a, b = np.clip(x, -radius, radius)[None, :], np.clip(y, -radius, radius)[:, None]

    def half_segment(v: Array) -> Array:
        """Integral of the half chord sqrt(r^2 - t^2) from 0 to v."""
        v = np.clip(v, -radius, radius)
        return 0.5 * (v * np.sqrt(radius**2 - v**2) + radius**2 * np.arcsin(v / radius))

    def between(low: Array, high: Array) -> Array:
        return np.where(high > low, half_segment(high) - half_segment(low), 0)

    # Below b, a chord from -w to w is cut at a where |t| < h, and is whole or nothing elsewhere.
    h = np.sqrt(np.maximum(radius**2 - a**2, 0))
    cut_to = np.clip(b, -h, h)
    cut = a * (cut_to + h) + between(-h, cut_to)
    whole = 2 * (between(-radius, np.minimum(b, -h)) + between(h, np.maximum(b, h)))
    corner = cut + np.where(a > 0, whole, 0)
    return np.diff(np.diff(corner, axis=0), axis=1)


def mean_electrons(scene: occ.Scene, pose: Array, peak_e: float, parts: int, **options: Any) -> Array:
    """Mean electrons of every pixel to peak_e / FULL_DN / (2 parts), from images of 16 bits.

    floor(v) + floor(v + 1/n) + ... + floor(v + (n-1)/n) = floor(n v) (Hermite): images whose black
    levels are 1/n apart tell the n-th part of a grey level.
    """
    gain = FULL_DN / peak_e
    levels = np.zeros((scene.camera.height, scene.camera.width))
    for part in range(parts):
        sensor = scene.sensor.replace(
            bit_depth=16, gain_dn_per_e=gain, full_well_e=1e3 * peak_e, black_level_dn=1 + part / parts
        )
        image, _ = occ.simulate(scene.replace(sensor=sensor), pose, noise=False, **options)
        levels += image
    return ((levels + 0.5) / parts - 1.5) / gain
