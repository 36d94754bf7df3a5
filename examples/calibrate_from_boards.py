# SPDX-License-Identifier: Apache-2.0
"""Calibrates a camera from pictures of a chessboard: calibrate_from_boards.py CAMERA.yaml

Twelve pictures are rendered by a camera that the calibration has to find. For a camera of your own, replace `pictures`
by a list of occ.read_image(path), and COLUMNS, ROWS and SQUARE_M by the inner corners and the square of your board.
"""

import sys

import numpy as np

import libocc as occ

COLUMNS, ROWS, SQUARE_M = 9, 6, 0.03
TRUE = occ.Camera.pinhole(
    width=800, height=600, fx_px=640, fy_px=642, cx_px=405, cy_px=296, distortion=[-0.2, 0.07, 0, 0]
)
MIDDLE = SQUARE_M * np.array([COLUMNS - 1, ROWS - 1, 0]) / 2
FREE = ["fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2"]

board = occ.targets.ChessboardTarget(square_m=SQUARE_M, columns=COLUMNS, rows=ROWS)
pictures = []
for i in range(12):  # from twelve directions, with the camera turned about its axis
    tilt, azimuth, roll = np.radians([10 + 8 * (i % 4), 30 * i, 90 * (i % 3)])
    away = [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), -np.cos(tilt)]
    pose = occ.look_at(MIDDLE + 0.45 * np.array(away), MIDDLE, up=[np.sin(roll), -np.cos(roll), 0])
    renderer = occ.targets.TargetRenderer(TRUE, pose, boards=[board], noise_dn=2, seed=i)
    pictures.append(renderer.window(0, 0, 800, 600))

grid = np.stack(np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)), axis=-1).reshape(-1, 2) * SQUARE_M
points_m = np.column_stack([grid, np.zeros(len(grid))])
seen = [occ.targets.find_chessboard(picture, COLUMNS, ROWS) for picture in pictures]
views = [(f"picture {i}", 0, *found) for i, found in enumerate(seen) if found is not None]
print(f"the whole board is visible in {len(views)} of {len(pictures)} pictures")
start, status, message = occ.network.start_pinhole([(grid, corners) for _, _, corners, _ in views], 800, 600)
if status is not occ.Status.ok:
    sys.exit(f"no start value: {status.name}: {message}")
start = occ.Camera.pinhole(
    width=800, height=600, fx_px=start.fx_px, fy_px=start.fy_px, cx_px=start.cx_px, cy_px=start.cy_px,
    distortion=[0, 0, 0, 0],
)  # fmt: skip
network = occ.network.board_network([("camera", start, FREE)], points_m, views).network
adjusted = occ.network.adjust(network)
if not adjusted.ok:
    sys.exit(f"{adjusted.status.name}: {adjusted.message}")
precision = occ.network.precision(adjusted.network)
true = {parameter.name: parameter.value for parameter in TRUE.parameters}
for found in occ.network.parameter_statistics(adjusted.network, network, precision):
    error = found.value - true[found.name]
    print(f"{found.name:6} {found.value:9.4f}   standard deviation {found.sigma:.4f}   error {error:8.4f}")
occ.write_camera(sys.argv[1], adjusted.network.cameras[0])
