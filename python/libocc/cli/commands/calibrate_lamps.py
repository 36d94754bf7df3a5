# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click
import numpy as np

import libocc as occ

from ... import samples
from .. import Failure, blamed_on, json_option
from ..progress import progress
from .calibrate_options import add_distances, distance_option, finish, out_option, robust_option


def named_lamps(pixels: Any, scene: occ.Scene, map_sigma_px: float) -> tuple[list[Any], str]:
    """(lamp, centroid, covariance) of each named blob; and why there is none."""
    blobs = occ.detect(pixels, sensor=scene.sensor)
    found = occ.identify(blobs, scene, gate_model_sigma_px=map_sigma_px)
    if not found.ok:
        return [], f"{found.status.name}: {found.message}"
    named = [(scene.lamps[match.lamp].id, blobs[match.blob]) for match in found.hypotheses[0].matches]
    return [(id, blob.centroid_px, blob.covariance_px2) for id, blob in named if not blob.cut_by_border], ""


@click.command(short_help="Survey where the lamps of a room hang, from pictures of them.")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--map", "scene_path", required=True, metavar="SCENE",
              help="With the camera, and about where the lamps hang.")
@click.option("--map-sigma-px", type=click.FloatRange(min=0.01), default=3.0, show_default=True,
              help="How far off the map may make a lamp appear.")
@click.option("--free", metavar="NAME,NAME,...", default="", help="Parameters of the camera to estimate, too.")
@distance_option
@out_option
@robust_option
@json_option
@click.pass_context
def command(
    ctx: click.Context, images: tuple[str, ...], scene_path: str, map_sigma_px: float, free: str,
    distance: tuple[Any, ...], out: str, robust: bool, as_json: bool,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --out a.png
    ...
    $ libocc simulate irregular_six --position 2.3 1.8 0.4 --heading-deg 90 --out b.png
    ...
    $ libocc simulate irregular_six --position 1.9 2.4 0.9 --heading-deg 200 --out c.png
    ...
    $ libocc calibrate lamps a.png b.png c.png --map irregular_six --out surveyed
    ...

    Surveys the lamps in IMAGEs, taken by the map's camera from different places; the map, which says
    about where they hang, tells which is which. The result lies as the map does, by inner constraints
    over all lamps; scale is the map's unless a --distance between two lamps ("lamp 3") is given. The
    folder gets scene.yaml, the map with the lamps in their places, beside the report. Exit code 0:
    surveyed; 1: not determined or not converged (the folder has the state so far); 2: bad input.
    """
    with blamed_on(scene_path):
        scene = samples.load_scene(scene_path)
    parameters = [name for name in free.split(",") if name]
    known = [parameter.name for parameter in scene.camera.parameters]
    for name in parameters:
        if name not in known:
            raise Failure(f"--free: {name!r} is no parameter of the camera; there are: {', '.join(known)}")
    seen, notes = [], []
    with progress("naming lamps", len(images)) as advance:
        for image in images:
            with blamed_on(image):
                lamps, why = named_lamps(occ.read_image(image), scene, map_sigma_px)
            if why:
                notes.append(f"{image}: {why}; left out")
            seen.append((image, 0, lamps))
            advance()
    begun = occ.network.lamp_network([("camera", scene.camera, parameters)], scene, seen)
    if not begun.ok:
        raise Failure(f"{begun.status.name}: {begun.message} {' '.join(notes)}")
    add_distances(begun.network, distance)
    finish(ctx, begun.network, occ.network.Datum(), out=out, title=f"Lamps in {len(images)} pictures", select=False,
           robust=robust, as_json=as_json, notes=notes + begun.warnings,
           settings={"kind": "lamps", "images": list(images), "map": scene_path},
           more=lambda network: {"scene.yaml": surveyed(scene, network).format().encode()})


def surveyed(scene: occ.Scene, network: occ.network.Network) -> occ.Scene:
    """The scene with the network's lamps in their places, and its camera."""
    places = dict(zip(network.point_names, np.asarray(network.points_m)))
    lamps = [lamp.replace(centre_m=places.get(f"lamp {lamp.id}", lamp.centre_m)) for lamp in scene.lamps]
    return scene.replace(lamps=lamps, camera=network.cameras[0])
