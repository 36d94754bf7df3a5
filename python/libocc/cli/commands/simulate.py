# SPDX-License-Identifier: Apache-2.0
import json
from pathlib import Path
from typing import Any

import click

import libocc as occ

from ... import samples
from .. import Failure, error_context, json_option, overlay_option, print_json, report
from ..pose_options import pose_options


@click.command(short_help="Render a camera's image of a scene's lamps.")
@click.argument("scene")
@pose_options
@click.option("--exposure-s", type=click.FloatRange(0, min_open=True),
              help="Exposure time; replaces that of the scene.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the noise.")
@click.option("--noise/--no-noise", default=True, show_default=True)
@click.option("--out", default="image.png", show_default=True, help="Image; the truth is written beside it as .json.")
@json_option
@overlay_option
def command(
    scene: str,
    cam_from_world: Any,
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

    Renders the image of the lamps in the camera of SCENE, and writes the ground truth beside it. By
    default the camera faces up. SCENE is a YAML file or the name of a scene that comes with libocc
    (`libocc samples` lists them).
    """
    if cam_from_world is None:
        raise Failure("give either --position X Y Z or --pose FILE")
    with error_context(scene):
        lamps = samples.load_scene(scene)
        if exposure_s is not None:
            lamps = lamps.replace(sensor=lamps.sensor.replace(exposure_s=exposure_s))
    with error_context("pose"):
        image, truth = occ.simulate(lamps, cam_from_world, seed=seed, noise=noise)

    truth_path = Path(out).with_suffix(".json")
    known = {"image": Path(out).name, "scene": samples.find_scene(scene).stem, "seed": seed}
    data = {**known, **report.truth_dict(truth)}
    with error_context(out):
        occ.write_image(out, image)
    with error_context(truth_path):
        truth_path.write_text(json.dumps(data, indent=1) + "\n")
    if overlay is not None:
        from ..overlay import draw_truth

        with error_context(overlay):
            draw_truth(overlay, image, truth, title=out)
    if as_json:
        print_json(data)
        return
    whole = " ".join(str(lamp.id) for lamp in truth.lamps if lamp.whole)
    cut = " ".join(str(lamp.id) for lamp in truth.lamps if lamp.in_view and not lamp.whole)
    click.echo(f"{out}: {image.shape[1]} x {image.shape[0]}, {image.dtype}; truth in {truth_path}")
    click.echo(f"lamps in view: {whole or 'none'}" + (f"; cut by the border: {cut}" if cut else ""))
