# SPDX-License-Identifier: Apache-2.0
from collections.abc import Sequence
from typing import Any

import click
import numpy as np

import libocc as occ

from ... import samples
from .. import error_context, json_option, overlay_option, print_json
from ..prior_options import prior_options


def match_dict(match: occ.objects.ObjectMatch, objects: Sequence[occ.objects.Object]) -> dict[str, Any]:
    thing = objects[match.object]
    return {
        "object": thing.name,
        "log10_false_alarms": match.log10_false_alarms,
        "plausible": match.plausible,
        "poses": [
            {
                "cam_from_object": h.cam_from_world.tolist(),
                "probability": h.probability,
                "chi2": h.chi2,
                "missed": h.missed,
                "point_of_blob": {m.blob: thing.points[m.lamp].id for m in h.matches},
            }
            for h in match.poses
        ],
    }


def recognition_dict(found: occ.objects.Recognition, objects: Sequence[occ.objects.Object]) -> dict[str, Any]:
    chances = zip(objects, found.log10_false_alarms, strict=True)
    return {
        "status": found.status.name,
        "message": found.message,
        "found": [
            {
                "status": o.status.name,
                "risk": o.risk,
                **match_dict(o.match, objects),
                "rivals": [match_dict(rival, objects) for rival in o.rivals],
            }
            for o in found.found
        ],
        "log10_false_alarms": [
            {"object": thing.name, "value": chance if np.isfinite(chance) else None} for thing, chance in chances
        ],
    }


def _risk(risk: float) -> str:
    return "<1e-9" if risk < 1e-9 else f"{risk:.0e}"


def recognition_text(found: occ.objects.Recognition, objects: Sequence[occ.objects.Object]) -> str:
    lines = [f"status  {found.status.name}"]
    if found.message:
        lines.append(f"why     {found.message}")
    width = max(6, *(len(thing.name) for thing in objects))
    if found.found:
        heading = "verdict     risk  poses  position in camera [m]  log10(alarms)  points (blob: point)"
        lines.append(f"{'object':<{width}}  {heading}")
    for o in found.found:
        thing, best = objects[o.match.object], o.match.poses[0]
        x, y, z = best.cam_from_world[:3, 3]
        names = " ".join(f"{m.blob}:{thing.points[m.lamp].id}" for m in sorted(best.matches, key=lambda m: m.blob))
        lines.append(
            f"{thing.name:<{width}}  {o.status.name:<9} {_risk(o.risk):>6} {o.match.plausible:6d}"
            f" {x:7.3f} {y:7.3f} {z:7.3f} {o.match.log10_false_alarms:13.1f}  {names}"
        )
        lines += [f"  or {objects[rival.object].name}" for rival in o.rivals]
    return "\n".join(lines)


@click.command(short_help="Recognise known objects in an image and compute their poses.")
@click.argument("image")
@click.argument("files", metavar="OBJECT...", nargs=-1, required=True)
@click.option("--camera", "scene", required=True, metavar="SCENE", help="Scene with the camera and the sensor.")
@click.option("--sigma-px", type=float, help="Error of the camera model and the objects, sigma  [default: 0.5].")
@click.option("--max-false-alarms", type=float, default=1e-3, show_default=True,
              help="Max expected number of false alarms of a recognised object.")
@prior_options
@json_option
@overlay_option
@click.pass_context
def command(
    ctx: click.Context,
    image: str,
    files: tuple[str, ...],
    scene: str,
    sigma_px: float | None,
    max_false_alarms: float,
    prior: occ.Prior,
    as_json: bool,
    overlay: str | None,
) -> None:
    """\b
    $ libocc simulate parking --position 9 2 1.4 --look-at 2 0.9 0.7 --seed 1 --out night.png
    ...
    $ libocc recognise night.png car beacon --camera parking
    status  ok
    object  verdict     risk  poses  position in camera [m]  log10(alarms)  points (blob: point)
    car     ok         <1e-9      1  -0.579   0.489   9.294         -37.2  2:4 3:2 4:0 6:1 7:3 8:5 9:8 10:9 12:6 16:7
    beacon  ok         <1e-9      1   1.191   0.476   6.370         -16.9  0:11 1:1 5:5 11:6 13:8 14:7 15:0

    Recognises objects in IMAGE (YAML files or names of objects that come with libocc). Prints the pose
    of each object, the probability that it is wrong (risk), the expected number of false alarms, and
    the assignment of blobs to its points. A prior refers to the camera in an object's frame. Exit code
    0: one pose of each recognised object; 1: no object, or an ambiguous one; 2: bad input.
    """
    with error_context(scene):
        source = samples.load_scene(scene)
    objects = []
    for file in files:
        with error_context(file):
            objects.append(samples.load_object(file))
    with error_context(image):
        pixels = occ.read_image(samples.find_image(image))
        camera = source.camera
        height, width = pixels.shape[:2]
        if (width, height) != (camera.width, camera.height):
            raise ValueError(
                f"its size is {width} x {height}, that of the camera of {scene} is {camera.width} x {camera.height}"
            )
        blobs = occ.detect(pixels, sensor=source.sensor)
    options: dict[str, Any] = {} if sigma_px is None else {"gate_model_sigma_px": sigma_px}
    with error_context("recognise"):
        found = occ.objects.recognise(blobs, objects, camera, prior, max_false_alarms=max_false_alarms, **options)
    if overlay is not None:
        from ..overlay import draw_recognition

        with error_context(overlay):
            draw_recognition(overlay, pixels, blobs, found, objects, camera, title=image)
    if as_json:
        print_json(recognition_dict(found, objects))
    else:
        click.echo(recognition_text(found, objects))
    if not found.ok:
        ctx.exit(1)
