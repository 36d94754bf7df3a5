# SPDX-License-Identifier: Apache-2.0
"""Prints how accurate a camera that looks up can be at places of a room: plan_accuracy.py SCENE.yaml HEIGHT_M

The figures are Cramer-Rao bounds: no unbiased estimator has smaller errors. They need no image, so lamps and lens can
be chosen before anything is built.
"""

import sys

import numpy as np

import libocc as occ

scene, height_m = occ.Scene.load(sys.argv[1]), float(sys.argv[2])
size_m = scene.room.size_m if scene.room else np.max([lamp.centre_m for lamp in scene.lamps], axis=0) + 1
xs, ys = (np.linspace(0.1, 0.9, 5) * side for side in size_m[:2])
print("standard deviation of the position [mm]; -: fewer than three lamps in view")
print("   y \\ x", *(f"{x:6.2f}" for x in xs))
for y in ys[::-1]:
    row = []
    for x in xs:
        bound = occ.bench.pose_bound(scene, occ.look_at([x, y, height_m], [x, y, size_m[2]], up=[0, 1, 0]))
        sigma_mm = 1e3 * np.sqrt(np.trace(bound.position_covariance_m2))
        row.append(f"{sigma_mm:6.2f}" if bound.lamps >= 3 else "     -")
    print(f"{y:8.2f}", *row)
