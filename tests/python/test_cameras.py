# SPDX-License-Identifier: Apache-2.0
"""Cameras of every model as Python values and as files."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import libocc as occ

CAMERAS = [
    occ.Camera.pinhole(
        width=640, height=480, fx_px=500, fy_px=501, cx_px=320, cy_px=240, distortion=[0.1, 0.2, 0.001, 0], skew_px=0.5
    ),
    occ.Camera.fisheye(width=640, height=480, fx_px=250, fy_px=251, cx_px=320, cy_px=240, distortion=[0.1, 0.2]),
    occ.Camera.double_sphere(width=640, height=480, fx_px=300, fy_px=301, cx_px=320, cy_px=240, xi=-0.2, alpha=0.6),
    occ.Camera.brown_forward(
        width=640, height=480, fx_px=300, fy_px=301, cx_px=320, cy_px=240,
        distortion=[1e-3, 2e-5, 0, 1e-5, -2e-5, 0, 1e-4], unit_px=80, r0=1.5, skew_px=0.1,
    ),
    occ.Camera.brown_backward(width=640, height=480, fx_px=300, fy_px=301, cx_px=320, cy_px=240, unit_px=80),
    occ.Camera.equirectangular(width=3000, height=700, cy_px=340),
    occ.Camera.rotating_line(
        width=3000, height=700, c_px=480, cy_px=350, tilt_x_rad=0.01, eccentricity_m=[0.01, 0, -0.02], k1=0.02,
        tumbling_rad=[1e-4, 0, 0, 0, 0, 2e-4],
    ),
    occ.Camera.rotating_line_first_order(width=3000, height=700, c_px=480, tilt_y_rad=0.01),
]


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.kind.name)
def test_a_camera_is_a_value(camera: occ.Camera, tmp_path: Path) -> None:
    assert eval(repr(camera), {"Camera": occ.Camera}) == camera
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert hash(pickle.loads(pickle.dumps(camera))) == hash(camera)
    occ.write_camera(tmp_path / "camera.yaml", camera)
    assert occ.read_camera(tmp_path / "camera.yaml") == camera
    values = [parameter.value for parameter in camera.parameters]
    assert camera.with_parameters(values) == camera
    assert camera.with_parameters([values[0] * 1.01, *values[1:]]) != camera


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.kind.name)
def test_the_ray_of_a_pixel_projects_to_the_pixel(camera: occ.Camera) -> None:
    ray = camera.ray([330, 260])
    assert ray is not None
    pixel = camera.project(ray.origin + 7 * ray.direction)
    assert pixel is not None
    tolerance = 1e-2 if camera.kind is occ.CameraKind.rotating_line_first_order else 1e-9
    assert np.abs(camera.difference_px(pixel, [330, 260])).max() < tolerance
    assert camera.is_central == (np.abs(ray.origin).max() == 0)


def test_only_panoramas_repeat_themselves() -> None:
    around = [camera.kind.name for camera in CAMERAS if math.isfinite(camera.period_px)]
    assert around == ["equirectangular", "rotating_line", "rotating_line_first_order"]
    assert CAMERAS[-2].difference_px([2999, 10], [1, 10]).round(6).tolist() == [-2, 0]


@pytest.mark.parametrize("form", [occ.CameraFormat.opencv, occ.CameraFormat.ros])
def test_other_formats_keep_their_parameters(form: occ.CameraFormat, tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    occ.write_camera(path, CAMERAS[1].with_parameters([250, 251, 320, 240, 0, 0.1, 0.2]), form)
    again = occ.read_camera(path)
    assert again.kind is occ.CameraKind.fisheye and again.distortion == [0.1, 0.2, 0, 0]
    with pytest.raises(ValueError, match="pinhole or fisheye"):
        occ.write_camera(path, CAMERAS[3], form)
    assert occ.read_camera(path) == again


def test_wrong_values_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="c_px must be positive"):
        occ.Camera.rotating_line(width=100, height=10, c_px=-1)
    with pytest.raises(ValueError, match="alpha"):
        occ.Camera.double_sphere(width=9, height=9, fx_px=1, fy_px=1, cx_px=1, cy_px=1, xi=0, alpha=2)
    with pytest.raises(OSError, match="absent"):
        occ.write_camera(tmp_path / "absent" / "camera.yaml", CAMERAS[0])
