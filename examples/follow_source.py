# SPDX-License-Identifier: Apache-2.0
"""Tracks a camera frame by frame: follow_source.py SCENE.yaml FOLDER|VIDEO|camera:N|BAG"""

import sys

import libocc as occ
from libocc.streams import open_source

scene, source = occ.Scene.load(sys.argv[1]), open_source(sys.argv[2])
tracker = occ.Tracker(scene)
for frame in source:
    if frame.image is None:
        print(frame.name, frame.problem)
        continue
    tracked = tracker.add_image(frame.image, frame.time_s)
    if tracked.state is occ.TrackerState.tracking:
        print(f"{tracked.time_s:.3f} s", *tracked.position_m.round(3), "lamps", *tracked.lamps)
    else:  # coasting: position_m is predicted and its covariance grows; lost or searching: no position
        print(f"{tracked.time_s:.3f} s", tracked.state.name, tracked.reason)
