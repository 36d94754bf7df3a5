# SPDX-License-Identifier: Apache-2.0
import json
import math
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from .. import report, samples
from ..cli import Failure, blamed_on, emit_json, json_option, overlay_option


def upward_pose(
    position_m: tuple[float, float, float], heading_deg: float, tilt_deg: float, towards_deg: float
) -> Any:
    """cam_from_world of a camera that looks up, then leans by tilt towards an azimuth."""
    azimuth, tilt, towards = (math.radians(a) for a in (heading_deg, tilt_deg, towards_deg))
    right = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    forward = np.array([0.0, 0.0, 1.0])
    level = np.stack([right, np.cross(forward, right), forward])
    k = np.array([-math.sin(towards), math.cos(towards), 0.0])
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    lean = np.eye(3) + math.sin(tilt) * cross + (1 - math.cos(tilt)) * cross @ cross
    rotation = level @ lean.T
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = -rotation @ np.asarray(position_m)
    return pose


def pose_from_file(path: str) -> Any:
    """cam_from_world of a JSON file: that key, or the 4x4 matrix itself."""
    data = json.loads(Path(path).read_text())
    matrix = data.get("cam_from_world") if isinstance(data, dict) else data
    pose = np.asarray(matrix, dtype=float)
    if pose.shape != (4, 4):
        raise ValueError(f"cam_from_world must be 4x4, got shape {pose.shape}")
    return pose


@click.command(short_help="Render what a camera sees of a scene's lamps.")
@click.argument("scene")
@click.option("--position", type=float, nargs=3, metavar="X Y Z", help="Of the camera [m].")
@click.option("--heading-deg", type=float, default=0, help="Azimuth of the image's right.")
@click.option("--tilt-deg", type=float, default=0, help="Of the optical axis from straight up.")
@click.option("--tilt-towards-deg", type=float, default=0, help="Azimuth it tilts towards.")
@click.option("--look-at", type=float, nargs=3, metavar="X Y Z", help="Look there instead of up.")
@click.option("--pose", metavar="FILE", help="JSON with cam_from_world (4x4) instead of --position.")
@click.option("--exposure-s", type=click.FloatRange(0, min_open=True), help="Instead of the scene's.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the noise.")
@click.option("--noise/--no-noise", default=True, show_default=True)
@click.option("--out", default="image.png", show_default=True, help="Image; .json beside it: truth.")
@json_option
@overlay_option
def command(
    scene: str,
    position: tuple[float, float, float] | None,
    heading_deg: float,
    tilt_deg: float,
    tilt_towards_deg: float,
    look_at: tuple[float, float, float] | None,
    pose: str | None,
    exposure_s: float | None,
    seed: int,
    noise: bool,
    out: str,
    as_json: bool,
    overlay: str | None,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --seed 1 --out room.png
    room.png: 640 x 480, uint8; truth in room.json
    lamps in view: 0 1 2 3 4 5

    Renders what the camera of SCENE sees of its lamps, and writes the truth beside it. The camera
    looks up unless told otherwise. SCENE is a YAML file or the name of a scene that comes with
    libocc: coded_four, irregular_six, kookmin_colour, kookmin_four_lamps, kookmin_one_lamp,
    square_four.
    """
    if (position is None) == (pose is None):
        raise Failure("give either --position X Y Z or --pose FILE")
    with blamed_on(scene):
        lamps = samples.load_scene(scene)
        if exposure_s is not None:
            lamps = lamps.replace(sensor=lamps.sensor.replace(exposure_s=exposure_s))
    if position is None:
        with blamed_on(pose):
            cam_from_world = pose_from_file(str(pose))
    elif look_at is not None:
        with blamed_on("--look-at"):
            cam_from_world = occ.look_at(position, look_at)
    else:
        cam_from_world = upward_pose(position, heading_deg, tilt_deg, tilt_towards_deg)
    with blamed_on("pose"):
        image, truth = occ.simulate(lamps, cam_from_world, seed=seed, noise=noise)

    truth_path = Path(out).with_suffix(".json")
    known = {"image": Path(out).name, "scene": samples.find_scene(scene).stem, "seed": seed}
    data = {**known, **report.truth_dict(truth)}
    with blamed_on(out):
        occ.write_image(out, image)
    with blamed_on(truth_path):
        truth_path.write_text(json.dumps(data, indent=1) + "\n")
    if overlay is not None:
        from ..overlay import draw_truth

        with blamed_on(overlay):
            draw_truth(overlay, image, truth, title=out)
    if as_json:
        emit_json(data)
        return
    whole = " ".join(str(lamp.id) for lamp in truth.lamps if lamp.whole)
    cut = " ".join(str(lamp.id) for lamp in truth.lamps if lamp.in_view and not lamp.whole)
    click.echo(f"{out}: {image.shape[1]} x {image.shape[0]}, {image.dtype}; truth in {truth_path}")
    click.echo(f"lamps in view: {whole or 'none'}" + (f"; cut by the border: {cut}" if cut else ""))
