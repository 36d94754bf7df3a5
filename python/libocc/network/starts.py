# SPDX-License-Identifier: Apache-2.0
"""Start values of poses and points: resection and intersection in turn, from known points or a pair of images."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from .._core import Camera, resect
from .relative import start_pair

Array = NDArray[np.float64]
MIN_POINTS = 4  # of a resection: three have up to four solutions
MIN_ANGLE_RAD = np.radians(2.0)  # of two rays; below it the distance is uncertain by more than 30 times the bearing


def intersect(origins: Array, directions: Array) -> Array | None:
    """Point with the least sum of squared distances from rays (n, 3), or None if they are nearly parallel.

    Rays that the point is behind do not count as an intersection: then the result is None, too.
    """
    cosines = directions @ directions.T
    if np.arccos(np.clip(cosines.min(), -1, 1)) < MIN_ANGLE_RAD:
        return None
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    point = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, origins))
    if (np.einsum("ni,ni->n", point - origins, directions) <= 0).any():
        return None
    return np.asarray(point)


def start_values(
    cameras: Sequence[Camera], seen: Sequence[Mapping[int, Array]], points: Mapping[int, Array],
    poses: Mapping[int, Array] | None = None,
) -> tuple[dict[int, Array], dict[int, Array]]:
    """Poses (cam_from_world, 4x4) of images and positions of points, as far as they follow from known ones.

    cameras: camera of each image; seen: pixels of points by their number, for each image; points, poses: known ones.
    An image needs four known points, a point two images with known poses.
    """
    found_poses, found_points = dict(poses or {}), dict(points)
    bearings: dict[tuple[int, int], tuple[Array, Array] | None] = {}

    def ray(image: int, point: int) -> tuple[Array, Array] | None:
        if (image, point) not in bearings:
            in_camera = cameras[image].ray(seen[image][point])
            bearings[image, point] = None if in_camera is None else (in_camera.origin, in_camera.direction)
        local = bearings[image, point]
        if local is None:
            return None
        rotation, translation = found_poses[image][:3, :3], found_poses[image][:3, 3]
        return rotation.T @ (local[0] - translation), rotation.T @ local[1]

    failed: dict[int, int] = {}  # number of known points of the image when its resection failed
    while True:
        grown = False
        # The image with the most known points is the most reliable one.
        without = [i for i in range(len(seen)) if i not in found_poses]
        waiting = sorted(((sum(p in found_points for p in seen[i]), i) for i in without), reverse=True)
        for known, image in waiting:
            if known < MIN_POINTS or failed.get(image) == known:
                continue
            numbers = [p for p in seen[image] if p in found_points]
            positions = np.array([found_points[p] for p in numbers])
            result = resect(positions, np.array([seen[image][p] for p in numbers]), cameras[image])
            if result.ok:
                found_poses[image] = np.asarray(result.cam_from_world)
                grown = True
            else:
                failed[image] = known
        images_of: dict[int, list[int]] = {}
        for image in found_poses:
            for point in seen[image]:
                if point not in found_points:
                    images_of.setdefault(point, []).append(image)
        for point, images in images_of.items():
            rays = [r for r in (ray(image, point) for image in images) if r is not None]
            if len(rays) < 2:
                continue
            position = intersect(np.array([r[0] for r in rays]), np.array([r[1] for r in rays]))
            if position is not None:
                found_points[point] = position
                grown = True
        if not grown:
            return found_poses, found_points


def median_error_px(
    cameras: Sequence[Camera], seen: Sequence[Mapping[int, Array]], poses: Mapping[int, Array],
    points: Mapping[int, Array],
) -> float:
    """Median distance [px] of observed and projected points; points that are not in view have an infinite one."""
    errors = []
    for image, pose in poses.items():
        for point in seen[image].keys() & points.keys():
            pixel = cameras[image].project(pose[:3, :3] @ points[point] + pose[:3, 3])
            off = np.inf if pixel is None else np.linalg.norm(cameras[image].difference_px(pixel, seen[image][point]))
            errors.append(float(off))
    return float(np.median(errors)) if errors else np.inf


def free_start(
    cameras: Sequence[Camera], seen: Sequence[Mapping[int, Array]]
) -> tuple[dict[int, Array], dict[int, Array]] | None:
    """Poses and positions from image points alone, in the frame of one image, with a baseline of 1.

    Two images start with their relative orientation; where it has several solutions (a plane), the one that fits all
    images is taken. None if no two images have enough common points from different directions.
    """
    bearings: list[dict[int, Array]] = []
    for camera, pixels in zip(cameras, seen):
        rays = {point: camera.unproject(pixel) for point, pixel in pixels.items()}
        bearings.append({point: np.asarray(ray) for point, ray in rays.items() if ray is not None})
    pair = start_pair(bearings)
    if pair is None:
        return None
    first, second, candidates = pair
    found = [start_values(cameras, seen, {}, {first: np.eye(4), second: pose}) for pose in candidates]
    largest = max(len(poses) for poses, _ in found)
    complete = [one for one in found if len(one[0]) == largest]
    return min(complete, key=lambda one: median_error_px(cameras, seen, *one))


def similarity(source: Array, target: Array) -> tuple[float, Array, Array] | None:
    """Scale, rotation and translation with target = scale * rotation @ source + translation, for points (n, 3).

    None if the points are collinear. Source: Umeyama, "Least-squares estimation of transformation parameters between
    two point patterns", PAMI 13(4), 1991, eqs 40-42.
    """
    about_source, about_target = source - source.mean(axis=0), target - target.mean(axis=0)
    u, values, vt = np.linalg.svd(about_target.T @ about_source)
    if len(source) < 3 or values[1] < 1e-9 * values[0] or not values[0] > 0:
        return None
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ np.diag(signs) @ vt
    scale = float(values @ signs / np.sum(about_source**2))
    return scale, rotation, target.mean(axis=0) - scale * rotation @ source.mean(axis=0)


def transformed(
    poses: Mapping[int, Array], points: Mapping[int, Array], scale: float, rotation: Array, translation: Array
) -> tuple[dict[int, Array], dict[int, Array]]:
    """Poses and points after a similarity of the world."""
    moved = {}
    for image, pose in poses.items():
        turned = np.eye(4)
        turned[:3, :3] = pose[:3, :3] @ rotation.T
        turned[:3, 3] = scale * pose[:3, 3] - turned[:3, :3] @ translation
        moved[image] = turned
    return moved, {point: scale * rotation @ at + translation for point, at in points.items()}
