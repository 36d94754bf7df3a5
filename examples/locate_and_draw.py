# SPDX-License-Identifier: Apache-2.0
"""Locates the camera of a picture and draws the result: locate_and_draw.py SCENE.yaml IMAGE OVERLAY.png"""

import sys

import libocc as occ
from libocc.cli.overlay import draw_fix

scene, image = occ.Scene.load(sys.argv[1]), occ.read_image(sys.argv[2])
fix = occ.locate(image, scene)
print(fix.status.name, fix.message)
if fix.candidates:
    sigmas_mm = 1e3 * fix.position_covariance_m2.diagonal() ** 0.5
    print("position", *fix.position_m.round(4), "m, standard deviations", *sigmas_mm.round(2), "mm")
draw_fix(sys.argv[3], image, fix, scene, title=sys.argv[2])
