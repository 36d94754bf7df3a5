# SPDX-License-Identifier: Apache-2.0
"""Renders images from random poses, with truth: synthetic_data.py SCENE.yaml FOLDER COUNT

truth.json lists for each image the pose and, for each lamp in view, the centre of its image.
"""

import json
import sys
from pathlib import Path

import numpy as np

import libocc as occ

scene, folder, count = occ.Scene.load(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
folder.mkdir(parents=True, exist_ok=True)
random = np.random.default_rng(1)
renderer = occ.Renderer(scene)
above = np.mean([lamp.centre_m for lamp in scene.lamps], axis=0)
truths = []
for i in range(count):
    eye = [*random.uniform(above[:2] - 0.7, above[:2] + 0.7), random.uniform(0.2, 1.0)]
    heading = random.uniform(0, 2 * np.pi)
    pose = occ.look_at(eye, above + random.normal(0, 0.2, 3), up=[np.sin(heading), np.cos(heading), 0])
    image, truth = renderer.render(pose, seed=i)  # the next call overwrites the image
    occ.write_image(str(folder / f"{i:06d}.png"), image)
    centres = {lamp.id: lamp.image_centre_px.tolist() for lamp in truth.lamps if lamp.in_view}
    truths.append({"image": f"{i:06d}.png", "cam_from_world": pose.tolist(), "lamps": centres})
(folder / "truth.json").write_text(json.dumps(truths, indent=1))
print(f"{count} images, {sum(len(truth['lamps']) for truth in truths)} lamps in view")
