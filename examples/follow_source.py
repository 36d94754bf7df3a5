# SPDX-License-Identifier: Apache-2.0
"""Where the camera is, frame by frame: follow_source.py SCENE.yaml FOLDER|VIDEO|camera:N|BAG"""

import sys

import libocc as occ
from libocc.streams import open_source

scene, source = occ.Scene.load(sys.argv[1]), open_source(sys.argv[2])
tracker = occ.Tracker(scene)
for frame in source:
    if frame.image is None:
        print(frame.name, frame.problem)
        continue
    seen = tracker.add_image(frame.image, frame.time_s)
    if seen.state is occ.TrackerState.tracking:
        print(f"{seen.time_s:.3f} s", *seen.position_m.round(3), "lamps", *seen.lamps)
    else:  # coasting: position_m is predicted, its covariance has grown; else there is none
        print(f"{seen.time_s:.3f} s", seen.state.name, seen.reason)
