# SPDX-License-Identifier: Apache-2.0
"""Pickling keeps every member of every struct, so objects may cross to other processes."""

import copy
import inspect
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import libocc as occ
from libocc import _core, codes, objects, photometry, rendering

POSE = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
COVARIANCE = np.diag([1.0, 2, 3, 4, 5, 6])

# A value for every field, each different from its default and within its rule.
CHANNEL = dict(efficiency=0.7, response=occ.Response.table, gamma=1.8, response_table=[0, 0.3, 1])
CODE = dict(
    kind=codes.CodeKind.ufsook, id_bits=4, checksum=codes.Checksum.crc16, clock_hz=5000, line=codes.LineCode.code_4b6b,
    repeats=3, frame_rate_hz=25, min_hz=120,
)  # fmt: skip
GHOST = dict(strength=0.1, scale=0.5, blur_px=2)
ELLIPSE = dict(centre_px=[3, 4], semi_major_px=5, semi_minor_px=2, angle_rad=0.3)
TILT = dict(geometry=2, tilt_rad=[0, 1], factors=[1, 0.9])
DISTRIBUTION = dict(
    file="lamp.ies", source_format="EULUMDAT", keywords=[("TEST", "a")], vertical_rad=[0, 1, 2], horizontal_rad=[0, 3],
    intensities_cd=[[3, 3], [2, 1], [1, 0.5]], opening=photometry.OpeningShape.ellipse, size_m=[0.2, 0.3],
    height_m=0.1, lamp_lm=3000, input_w=40, tilt=photometry.LampTilt(**TILT), output_ratio=0.8, downward_ratio=0.9,
)  # fmt: skip
COLOUR = dict(share=[0.2, 0.5, 0.3], sigma=[0.01, 0.02, 0.03], clipped=[False, True, False])
VALUES: dict[type, dict[str, Any]] = {
    rendering.Channel: CHANNEL,
    occ.Sensor: dict(
        pixel_pitch_m=5e-6, f_number=4, exposure_s=1e-3, quantum_efficiency=0.6, wavelength_m=6e-7, full_well_e=9000,
        gain_dn_per_e=0.03, read_noise_e=5, dark_current_e_per_s=1, black_level_dn=3, bit_depth=12,
        response=occ.Response.table, gamma=1.8, response_table=[0, 0.4, 1], row_time_s=1e-5,
        readout=occ.Readout.columns, psf_sigma_px=1.1, gain_sigma=0.01, gain_seed=7, blooming=0.5,
        mosaic=rendering.Mosaic.rggb, channels=[rendering.Channel(**CHANNEL)] * 3,
    ),
    occ.Lamp: dict(
        id=4, name="door", shape=occ.LampShape.lame, centre_m=[1, 2, 3], normal=[0, 1, 0], radius_m=0.2,
        size_m=[0.3, 0.4], x_axis=[0, 0, 1], exponent=3,
        corners_m=[[0, 0], [1, 0], [0, 2]], power_w=2, power_sigma=0.2, half_power_rad=1,
        code=codes.LampCode(code=codes.Code(**CODE), id=3), frequency_hz=50, waveform=[1, 0.5], duty=0.25, phase=0.5,
        colour=[1, 0.5, 0.25], colour_sigma=0.2,
        position_sigma_m=[0.01, 0.02, 0.03], size_sigma=0.05, tilt_sigma_rad=0.1,
        shared_errors_m=[[0.1, 0.2, 0.3], [0, 0, 0.4]], photometry=photometry.PhotometricDistribution(**DISTRIBUTION),
    ),
    photometry.LampTilt: TILT,
    photometry.PhotometricDistribution: DISTRIBUTION,
    codes.Code: CODE,
    codes.LampCode: dict(code=codes.Code(**CODE), id=3, channel=1),
    occ.Room: dict(size_m=[5, 6, 2.5], wall_reflectance=0.5),
    rendering.Ghost: GHOST,
    occ.Lens: dict(
        diffraction=True, focus_distance_m=2, vignetting=[-0.1], veiling_glare=0.01, ghosts=[rendering.Ghost(**GHOST)]
    ),
    occ.Box: dict(min_m=[1, 2, 0], max_m=[2, 3, 1]),
    occ.Tag: dict(id=5, family="tag25h9", size_m=0.2, centre_m=[1, 2, 3], normal=[0, 1, 0], x_axis=[0, 0, 1]),
    occ.Prior: dict(
        position_m=[1, 2, 3], position_sigma_m=0.1, position_sigmas_m=[0.1, 0.2, 3], height_m=3.5, height_sigma_m=0.3,
        heading_rad=np.pi / 2, heading_sigma_rad=0.1, gravity_in_cam=[0, 0, -1], gravity_sigma_rad=0.01, last_pose=None,
    ),
    rendering.Ellipse: ELLIPSE,
    rendering.BlobColour: COLOUR,
    occ.Blob: dict(
        centroid_px=[3, 4], covariance_px2=[[1, 0.5], [0.5, 2]], light_response_px2=[[1, 2], [3, 4]],
        rim_light_response_px=0.5, rim_light_depth_px=1, flux_dn=1,
        flux_sigma_dn=2, peak_dn=3, background_dn=4, noise_dn=5, area_px=6, x0=1, y0=2, x1=3, y1=4,
        ellipse=rendering.Ellipse(**ELLIPSE), rim=np.arange(10.0).reshape(2, 5), corners_px=[[1, 2], [3, 4]],
        rim_covariance_px2=np.diag([1, 2, 3, 4, 5]), saturated=True, merged=True, cut_by_border=True, striped=True,
        patterned=True, free_form=True, hidden_in_part=True, frequency_hz=20, frequency_sigma_hz=0.5, lamp_id=9,
        colour=rendering.BlobColour(**COLOUR),
    ),
    objects.ObjectPoint: dict(id=3, label="left", position_m=[1, 2, 3], normal=[0, 1, 0], cone_rad=1, radius_m=0.1),
}  # fmt: skip

# Arguments that the constructors require.
REQUIRED: dict[type, dict[str, Any]] = {
    occ.Lamp: dict(id=0, centre_m=[0, 0, 3], radius_m=1),
    codes.LampCode: dict(code=codes.Code(), id=0),
    occ.Box: dict(min_m=[0, 0, 0], max_m=[1, 1, 2]),
    occ.Tag: dict(id=0, size_m=1, centre_m=[0, 0, 0]),
    occ.Blob: dict(centroid_px=[0, 0]),
    objects.ObjectPoint: dict(id=0, position_m=[0, 0, 0]),
    photometry.PhotometricDistribution: dict(
        vertical_rad=[0, 2], horizontal_rad=[0, 1], intensities_cd=[[1, 1], [1, 1]]
    ),
}

# Objects with a state of their own (filters, renderers, indices), entries of catalogues (Solver, LadderStep), and
# networks, which have files of their own.
UNPICKLED = {
    "LadderStep", "LampIndex", "Network", "PlanarFilter", "PlanarWindowSmoother", "PoseFilter", "Renderer", "Solver",
    "TargetRenderer", "Tracker", "WindowSmoother",
}  # fmt: skip


def same(a: Any, b: Any) -> bool:
    """Returns True if two values are equal bit by bit."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)):
            return False
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if "__getstate__" in vars(type(a)):
        return type(a) is type(b) and same(a.__getstate__(), b.__getstate__())
    return type(a) is type(b) and bool(a == b or a != a)


def pickled(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("cls", VALUES, ids=lambda cls: cls.__name__)
def test_pickling_keeps_every_field(cls: type) -> None:
    fields = VALUES[cls]
    value = cls(**fields)
    assert set(value.__getstate__()) == set(fields)
    again = pickled(value)
    for name in fields:
        assert same(getattr(value, name), getattr(again, name)), name
    assert same(copy.deepcopy(value), value)


@pytest.mark.parametrize("cls", VALUES, ids=lambda cls: cls.__name__)
def test_the_values_differ_from_the_defaults(cls: type) -> None:
    value, default = cls(**VALUES[cls]), cls(**REQUIRED.get(cls, {}))
    unchanged = {name for name in VALUES[cls] if same(getattr(value, name), getattr(default, name))}
    assert unchanged <= {"last_pose"}


def test_a_prior_keeps_its_last_pose() -> None:
    prior = occ.Prior(last_pose=(POSE, COVARIANCE))
    assert same(pickled(prior).last_pose, prior.last_pose)


def classes() -> list[type]:
    return [c for c in vars(_core).values() if inspect.isclass(c) and c.__module__.startswith("libocc")]


def test_every_other_class_can_be_pickled() -> None:
    unpickled = {c.__name__ for c in classes() if "__getstate__" not in vars(c) and not hasattr(c, "__members__")}
    assert unpickled == UNPICKLED


def properties(value: Any) -> dict[str, Any]:
    names = [name for name, member in inspect.getmembers(type(value)) if isinstance(member, property)]
    return {name: getattr(value, name) for name in names}


def test_results_are_pickled_whole(scene: occ.Scene, pose: Any, rendered: Any) -> None:
    image, truth = rendered
    fix = occ.locate(image, scene)
    identified = _core.identify(fix.blobs, scene)
    refined = _core.refine(fix.cam_from_world, identified.hypotheses[0].matches, fix.blobs, scene)
    power = _core.received_power(scene, pose)
    explanation = _core.explain(scene, pose, repetitions=0)
    assert fix.ok and identified.ok and refined.ok
    for value in (fix, truth, identified, refined, power, explanation, *scene.camera.parameters):
        again = pickled(value)
        assert repr(again) == repr(value)
        assert same(properties(again), properties(value)), type(value).__name__
        assert same(copy.deepcopy(value), value)


def test_pickled_blobs_locate_to_the_same_bits(root: Path) -> None:
    scene = occ.Scene.load(root / "data" / "scenes" / "irregular_six.yaml")
    pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[1.9, 2.1, 3], up=[0, 1, 0])
    for exposure_s in (2e-5, 1.2e-4):
        exposed = scene.replace(sensor=scene.sensor.replace(exposure_s=exposure_s))
        image, _ = occ.simulate(exposed, pose, seed=1)
        blobs = occ.detect(image, sensor=exposed.sensor)
        a, b = occ.locate(blobs, exposed), occ.locate(pickled(blobs), exposed)
        assert np.array_equal(a.position_m, b.position_m) and np.array_equal(a.covariance, b.covariance)
