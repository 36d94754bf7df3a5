# SPDX-License-Identifier: Apache-2.0
"""Families of problems. Problem i of a family depends on the seed, the family's name and i only."""

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

import libocc as occ

from ... import samples
from ..ladder.experiment import Experiment
from .rooms import (
    Array,
    Random,
    false_lights,
    gravity_in_cam,
    grid_room,
    heading_rad,
    lamp_blobs,
    noise_px,
    pinhole,
    upward_pose,
    wide_camera,
    without_dark,
)

MAX_DRAWS = 200  # random views until one shows enough lamps
MIN_LAMPS = 3
GRAVITY_SIGMA_RAD, HEADING_SIGMA_RAD, PRIOR_SIGMA_M = 0.01, 0.2, 0.3


@dataclass(frozen=True)
class Problem:
    """`solve` is the call whose time is measured; truth: cam_from_world, None if no pose is right."""

    solve: Callable[[], Any]
    truth: Array | None


@dataclass(frozen=True)
class Family:
    """Problems of one kind; `title` is for tables and pictures."""

    name: str
    title: str
    about: str
    build: Callable[[int, Random], Problem]

    def problem(self, seed: int, number: int) -> Problem:
        random = np.random.default_rng([seed, zlib.crc32(self.name.encode()), number])
        return self.build(number, random)


def _located(blobs: Any, scene: occ.Scene, prior: occ.Prior | None = None, **options: Any) -> Callable[[], Any]:
    return lambda: occ.locate(blobs, scene, prior, **options)


@cache
def _irregular_six() -> occ.Scene:
    return samples.load_scene("irregular_six")


def _view(scene: occ.Scene, max_range_m: float, random: Random) -> tuple[Array, Any]:
    """Pose and image of a camera that shows all lamps of the scene."""
    seed = int(random.integers(2**31))
    experiment = Experiment(scene, float(random.uniform(2.2, max_range_m)), float(random.uniform(0, 30)), seed)
    pose = experiment.pose(0)
    return pose, experiment.image(0, pose)


def six_lamps(_: int, random: Random) -> Problem:
    scene = _irregular_six()
    pose, image = _view(scene, 3.4, random)
    return Problem(_located(image, scene), pose)


def _few(number: int, random: Random, rung: occ.Rung) -> Problem:
    all_lamps = _irregular_six()
    chosen = random.permutation(len(all_lamps.lamps))[: 3 + number % 2]
    scene = all_lamps.replace(lamps=[all_lamps.lamps[i] for i in sorted(chosen)])
    pose, image = _view(scene, 8, random)
    prior = None
    if number // 2 % 2:
        prior = occ.Prior(
            gravity_in_cam=gravity_in_cam(pose, GRAVITY_SIGMA_RAD, random), gravity_sigma_rad=GRAVITY_SIGMA_RAD
        )
    return Problem(_located(image, scene, prior, rung=rung), pose)


def few_centres(number: int, random: Random) -> Problem:
    return _few(number, random, occ.Rung.centres)


def few_rims(number: int, random: Random) -> Problem:
    return _few(number, random, occ.Rung.rims)


def junk(number: int, random: Random) -> Problem:
    camera = pinhole(900)
    scene = grid_room(camera, 2 + number % 3, 6, 0.2, random)
    blobs = false_lights(4 + number % 7, camera, noise_px(random), random)
    priors = {1: occ.Prior(gravity_in_cam=[0, 0, -1]), 2: occ.Prior(height_m=1)}
    return Problem(_located(blobs, scene, priors.get(number % 5)), None)


def _seen(
    scene: occ.Scene, width_m: float, sigma_px: float, random: Random, min_lamps: int = MIN_LAMPS
) -> tuple[Array, list[occ.Blob]]:
    """Pose with at least `min_lamps` lamps in view if such a view is found, and their blobs."""
    for _ in range(MAX_DRAWS):
        pose = upward_pose(width_m, random)
        blobs = lamp_blobs(scene, pose, sigma_px, random)
        if len(blobs) >= min_lamps:
            break
    return pose, blobs


def wide(number: int, random: Random) -> Problem:
    sigma_px = noise_px(random)
    scene = grid_room(wide_camera(number % 3), 3 + number // 3 % 3, 6, 0.2, random)
    pose, blobs = _seen(scene, 6, sigma_px, random)
    blobs = without_dark(blobs, 0.1, random) + false_lights(2 * (number % 5), scene.camera, sigma_px, random)
    return Problem(_located(blobs, scene), pose)


def grids(number: int, random: Random) -> Problem:
    sigma_px, width_m = noise_px(random), float(random.uniform(5, 9))
    scene = grid_room(pinhole(450), 4 + number % 3, width_m, 0, random)
    pose, blobs = _seen(scene, width_m, sigma_px, random)
    blobs = without_dark(blobs, (0, 0.1, 0.25)[number % 3], random)
    blobs += false_lights(4 * (number % 4), scene.camera, sigma_px, random)
    prior = occ.Prior(
        gravity_in_cam=gravity_in_cam(pose, GRAVITY_SIGMA_RAD, random), gravity_sigma_rad=GRAVITY_SIGMA_RAD,
        heading_rad=heading_rad(pose) + HEADING_SIGMA_RAD * random.normal(), heading_sigma_rad=HEADING_SIGMA_RAD,
    )
    return Problem(_located(blobs, scene, prior), pose)


def one_dark(_: int, random: Random) -> Problem:
    sigma_px = noise_px(random)
    scene = grid_room(pinhole(450), 3, 6, 0.3, random)
    pose, blobs = _seen(scene, 6, sigma_px, random, min_lamps=4)
    blobs.pop(int(random.integers(len(blobs))))
    return Problem(_located(blobs + false_lights(2, scene.camera, sigma_px, random), scene), pose)


def priors(number: int, random: Random) -> Problem:
    sigma_px = 0.1
    scene = grid_room(pinhole(600), 3 + number % 2, 6, 0.1, random)
    pose, blobs = _seen(scene, 6, sigma_px, random)
    blobs = without_dark(blobs, 0.1, random) + false_lights(number % 5, scene.camera, sigma_px, random)
    along = random.normal(size=3)
    offset_m = number % 7 * PRIOR_SIGMA_M * along / np.linalg.norm(along)
    position = -pose[:3, :3].T @ pose[:3, 3] + offset_m
    return Problem(_located(blobs, scene, occ.Prior(position_m=position, position_sigma_m=PRIOR_SIGMA_M)), pose)


def _projected(points: Array, pose: Array, camera: occ.Camera) -> Array:
    return np.array([camera.project(pose[:3, :3] @ point + pose[:3, 3]) for point in points])


def coplanar_four(_: int, random: Random) -> Problem:
    camera, sigma_px = pinhole(900), 0.5
    size_m, range_m, tilt = 10 ** random.uniform(-1, 0), random.uniform(1.5, 4), np.radians(random.uniform(0, 60))
    corners = size_m / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    points = corners + 0.1 * size_m * random.normal(size=(4, 3)) * [1, 1, 0]
    azimuth, roll = random.uniform(0, 2 * np.pi, 2)
    away = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    pose = occ.look_at(range_m * away, [0, 0, 0], up=[np.cos(roll), np.sin(roll), 0.1])
    pixels = _projected(points, pose, camera) + sigma_px * random.normal(size=(4, 2))
    return Problem(lambda: occ.solve_pose(points, pixels, camera, sigma_px=sigma_px), pose)


def outliers(number: int, random: Random) -> Problem:
    camera, sigma_px, count = pinhole(900), 1.0, int(random.integers(20, 101))
    pixels = random.uniform([0, 0], [camera.width - 1, camera.height - 1], (count, 2))
    in_cam = np.array([camera.unproject(px) for px in pixels])
    in_cam *= (random.uniform(2, 6, count) / in_cam[:, 2])[:, None]
    pose = upward_pose(6, random)
    points = (in_cam - pose[:3, 3]) @ pose[:3, :3]
    pixels += sigma_px * random.normal(size=pixels.shape)
    wrong = random.uniform(size=count) < (0.3, 0.5, 0.7, 0.9)[number % 4]
    pixels[wrong] = random.uniform([0, 0], [camera.width - 1, camera.height - 1], (int(wrong.sum()), 2))
    return Problem(lambda: occ.robust_pose(points, pixels, camera, sigma_px), pose)


FAMILIES = {
    family.name: family
    for family in (
        Family("six_lamps", "six lamps", "images of irregular_six, all lamps in view", six_lamps),
        Family("few_rims", "3 or 4 lamps, rims", "images of 3 or 4 of these lamps, half with gravity", few_rims),
        Family("few_centres", "3 or 4 lamps, centres", "the same kind of images, centres only", few_centres),
        Family("one_dark", "one lamp off", "9 lamps, one in view is off, two false lights", one_dark),
        Family("priors", "wrong priors", "position prior 0 to 6 sigma off, 10 % of the lamps off", priors),
        Family("wide", "wide cameras", "pinhole, fisheye, double sphere; up to 8 false lights", wide),
        Family("grids", "regular grids", "gravity and heading; up to 25 % off, 12 false lights", grids),
        Family("junk", "no lamp", "4 to 10 false lights only", junk),
        Family("coplanar_four", "4 coplanar points", "solve_pose, size 0.1 to 1 m at 1.5 to 4 m", coplanar_four),
        Family("outliers", "wrong matches", "robust_pose, 30 to 90 % outliers", outliers),
    )
}
