# SPDX-License-Identifier: Apache-2.0
"""Light from a room's walls compared with the independent path tracer Mitsuba 3."""

from typing import Any

import numpy as np
import pytest
from image_oracles import PLANCK_TIMES_LIGHT, mean_electrons

import libocc as occ

WIDTH, HEIGHT, FX = 32, 24, 20.0
BLOCK = 4
RUNS, SAMPLES = 16, 64
FINER = 4  # refinement of libocc's pixels, which sample the walls at their centres only
REFLECTANCE = 0.6
SIZE = (4.0, 5.0, 3.0)
CAMERA, TARGET = (0.7, 0.9, 1.4), (4.0, 4.6, 0.7)
# Small compared with their distance to the walls; 60 degrees is Lambert's law, which Mitsuba's lamps follow.
LAMPS = [((1.2, 3.1, 2.95), 0.05, 1.5), ((2.6, 1.4, 2.95), 0.04, 1.0)]


def room(interreflection: bool) -> occ.Scene:
    lamps = [
        occ.Lamp(id=i, centre_m=c, radius_m=r, power_w=p, half_power_rad=np.pi / 3)
        for i, (c, r, p) in enumerate(LAMPS)
    ]
    use = occ.rendering.Use.on if interreflection else occ.rendering.Use.off
    camera = occ.Camera.pinhole(
        width=FINER * WIDTH,
        height=FINER * HEIGHT,
        fx_px=FINER * FX,
        fy_px=FINER * FX,
        cx_px=(FINER * WIDTH - 1) / 2,
        cy_px=(FINER * HEIGHT - 1) / 2,
    )
    return occ.Scene(
        camera=camera,
        lamps=lamps,
        sensor=occ.Sensor(exposure_s=1e-3),
        room=occ.Room(size_m=SIZE, wall_reflectance=REFLECTANCE),
        effects=occ.Effects(interreflection=use),
    )


def traced(mi: Any, depth: int) -> Any:
    """(runs, height, width) radiance [W/(m^2 sr)]; depth: max number of edges of a path, -1 for no limit."""

    def grey(value: float) -> dict[str, Any]:
        return {"type": "rgb", "value": [value] * 3}

    to_world = mi.ScalarTransform4f
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth},
        "sensor": {
            "type": "perspective",
            "fov": float(np.degrees(2 * np.arctan(WIDTH / 2 / FX))),
            "fov_axis": "x",
            "to_world": to_world().look_at(origin=CAMERA, target=TARGET, up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": SAMPLES},
        },
        "room": {
            "type": "cube",
            "flip_normals": True,
            "to_world": to_world().scale([s / 2 for s in SIZE]).translate([1, 1, 1]),
            "bsdf": {"type": "diffuse", "reflectance": grey(REFLECTANCE)},
        },
    }
    for i, (centre, radius, power) in enumerate(LAMPS):
        scene[f"lamp{i}"] = {
            "type": "disk",
            "to_world": to_world().translate(centre).rotate([1, 0, 0], 180).scale(radius),
            "bsdf": {"type": "diffuse", "reflectance": grey(0)},
            "emitter": {"type": "area", "radiance": grey(power / (np.pi * np.pi * radius**2))},
        }
    loaded = mi.load_dict(scene)
    return np.array([np.array(mi.render(loaded, seed=run + 1))[:, :, 0] for run in range(RUNS)])


def blocks(pixels: Any) -> Any:
    size = BLOCK * pixels.shape[-1] // WIDTH
    shape = (*pixels.shape[:-2], HEIGHT // BLOCK, size, WIDTH // BLOCK, size)
    return pixels.reshape(shape).mean(axis=(-3, -1))


@pytest.mark.slow
@pytest.mark.parametrize("interreflection", [False, True], ids=["first_bounce", "all_bounces"])
def test_walls_are_those_of_a_path_tracer(interreflection):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    scene = room(interreflection)
    pose = occ.look_at(CAMERA, TARGET, [0, 0, 1])
    sensor = scene.sensor
    x, y = np.meshgrid(np.arange(WIDTH) - (WIDTH - 1) / 2, np.arange(HEIGHT) - (HEIGHT - 1) / 2)
    cos4 = (1 + (x**2 + y**2) / FX**2) ** -2.0
    photons = sensor.pixel_pitch_m**2 * sensor.exposure_s * sensor.wavelength_m / PLANCK_TIMES_LIGHT
    electrons = sensor.quantum_efficiency * photons * np.pi / 4 / sensor.f_number**2
    runs = blocks(traced(mi, -1 if interreflection else 2) * cos4 * electrons)
    mean, error = runs.mean(axis=0), runs.std(axis=0, ddof=1) / np.sqrt(RUNS)
    ours = blocks(mean_electrons(scene, pose, 2 * mean.max(), 4))
    assert (error < 0.02 * mean).all(), "too few samples to see anything"
    # Tolerance for the noise of the tracer, interpolation between pixels, and patches that reflect each other.
    z = (ours - mean) / np.hypot(error, (0.01 if interreflection else 0.002) * mean)
    assert np.abs(z).max() < 4.5
    assert np.abs(z.mean()) * np.sqrt(z.size) < (8 if interreflection else 4)
