# SPDX-License-Identifier: Apache-2.0
"""Small scene with every shape of lamp, one partly hidden by a box, with a rolling shutter."""

import hashlib
import os
import time
from pathlib import Path

import libocc as occ

SCENE = """
schema: libocc-scene/1
camera: {width_px: 160, height_px: 120, fx_px: 100}
sensor:
  {row_time_s: 5.0e-05, exposure_s: 1.0e-04, full_well_e: 40000, gain_dn_per_e: 0.006, psf_sigma_px: 0.5}
lamps:
  - {id: 4, name: door, centre_m: [-0.4, -0.3, 2], radius_m: 0.15}
  - {id: 9, centre_m: [0.5, -0.3, 2], shape: rectangle, size_m: [0.4, 0.2], normal: [0.2, 0, -1]}
  - {id: 0, centre_m: [0.3, 0.5, 2], shape: lame, size_m: [0.3, 0.3], exponent: 4}
  - {id: 7, centre_m: [-0.5, 0.4, 2], shape: point}
boxes:
  - {min_m: [-0.42, -0.6, 1.2], max_m: [-0.24, 0, 1.3]}
"""
WALK = """
schema: libocc-trajectory/1
waypoints:
  - {time_s: 2, position_m: [0, 0, 0.1], heading_deg: 0}
  - {time_s: 2.5, position_m: [0.1, 0.05, 0.1], heading_deg: 20, tilt_deg: 3}
"""
SWEEP = """
schema: libocc-sweep/1
scene: room.yaml
pose: {position_m: [0, 0, 0.1]}
parameters:
  sensor.exposure_s: {log: [5e-5, 2e-4], count: 2}
  lamps[*].power_w: {uniform: [0.5, 1], count: 3, seed: 5}
images: 2
seed: 3
keep: [images, truth, detect, locate]
"""


def small_scene() -> occ.Scene:
    return occ.Scene.parse(SCENE)


def write_all(folder: Path) -> None:
    """Writes room.yaml, walk.yaml and sweep.yaml."""
    for name, text in (("room", SCENE), ("walk", WALK), ("sweep", SWEEP)):
        (folder / f"{name}.yaml").write_text(text)


def contents(folder: Path | str) -> dict[str, str]:
    """Hashes of all files in a folder, by name."""
    files = [path for path in Path(folder).rglob("*") if path.is_file()]
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def sleep_long(job: object) -> None:
    time.sleep(600)


def double(job: int) -> int:
    return 2 * job


def die(job: int) -> None:
    """Ends the process like the kernel does when memory is exhausted."""
    os._exit(1)
