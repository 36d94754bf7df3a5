# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import click
import numpy as np
import yaml

import libocc as occ

from .. import samples
from ..cli import blamed_on, emit_json, json_option
from ..progress import progress


def matrix(value: Any, name: str) -> Any:
    """4x4 numbers, or a mapping that holds them as cam_from_world."""
    if isinstance(value, dict):
        value = value.get("cam_from_world")
    try:
        pose = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape != (4, 4):
        raise ValueError(f"{name}: cam_from_world must be 4x4 numbers")
    return pose


def poses_from(path: str, images: tuple[str, ...]) -> list[Any]:
    """A list of poses in the images' order, or a mapping of image names to poses. JSON is YAML."""
    data = yaml.safe_load(Path(path).read_text())
    if isinstance(data, list):
        if len(data) != len(images):
            raise ValueError(f"has {len(data)} poses for {len(images)} images")
        return [matrix(value, f"pose {i}") for i, value in enumerate(data)]
    if not isinstance(data, dict):
        raise ValueError("must be a list of poses or a mapping of image names to poses")
    for image in images:
        if Path(image).name not in data:
            raise ValueError(f"has no pose for {Path(image).name}")
    return [matrix(data[Path(image).name], Path(image).name) for image in images]


def pose_beside(image: str) -> Any:
    path = Path(image).with_suffix(".json")
    with blamed_on(path):
        return matrix(yaml.safe_load(path.read_text()), path.name)


def lamp_dict(light: occ.LampLight) -> dict[str, Any]:
    sigma = np.sqrt(np.diag(light.covariance))
    uses = [flux.use.name for flux in light.fluxes]
    return {
        "id": light.id, "status": light.status.name, "message": light.message,
        "power_w": light.power_w, "power_sigma": float(sigma[0]) if np.isfinite(sigma[0]) else None,
        "order": light.order, "order_sigma": float(sigma[1]) if np.isfinite(sigma[1]) else None,
        "chi2": light.chi2, "dof": light.dof, "images": {use: uses.count(use) for use in sorted(set(uses))},
    }


def line(data: dict[str, Any]) -> str:
    used = f"lamp {data['id']}: "
    if data["status"] != "ok":
        others = ", ".join(f"{count} {use}" for use, count in data["images"].items())
        return f"{used}{data['status']}: {data['message']} ({others})"
    text = (
        f"{used}{data['power_w']:.4g} W +- {100 * data['power_sigma']:.2g} %, order {data['order']:.3f} "
        f"+- {data['order_sigma']:.2g}, {data['images']['used']} images, chi2 {data['chi2']:.0f} of {data['dof']}"
    )
    return f"{text}; {data['message']}" if data["message"] else text


@click.command(short_help="Learn the lamps' power and Lambertian order from images.")
@click.argument("scene")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--poses", "poses_path", metavar="FILE.yaml|json",
              help="cam_from_world of each image, by order or name; else IMAGE's .json beside it.")
@click.option("--gate-px", type=click.FloatRange(0, min_open=True), default=3, show_default=True,
              help="A lamp's blob is no farther from where it should be.")
@click.option("--out", default="scene_calibrated.yaml", show_default=True, metavar="FILE.yaml")
@json_option
@click.pass_context
def command(
    ctx: click.Context, scene: str, images: tuple[str, ...], poses_path: str | None, gate_px: float,
    out: str, as_json: bool,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 0.4 0.4 0.2 --look-at 2 2 3 --out a.png
    ...
    $ libocc simulate irregular_six --position 3.6 0.5 0.1 --look-at 2 2 3 --out b.png
    ...
    $ libocc simulate irregular_six --position 3.5 3.6 0.4 --look-at 2 2 3 --out c.png
    ...
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --out d.png
    ...
    $ libocc light irregular_six a.png b.png c.png d.png
    lamp 0: 1.5 W ...

    Fits power and Lambertian order of SCENE's lamps to their fluxes in IMAGEs whose poses are
    known, and writes the scene with what was found: power_w, power_sigma and half_power_deg of the
    lamps that are ok. The sensor, its response with it, is taken as the scene has it. Exit code 0:
    every lamp; 1: some lamp's light is not determined; 2: bad input.
    """
    with blamed_on(scene):
        known = samples.load_scene(scene)
    if poses_path is None:
        poses = [pose_beside(image) for image in images]
    else:
        with blamed_on(poses_path):
            poses = poses_from(poses_path, images)
    blobs = []
    with progress("measuring", len(images)) as advance:
        for image in images:
            with blamed_on(image):
                blobs.append(occ.detect(occ.read_image(image), sensor=known.sensor))
            advance()
    with blamed_on(poses_path or "poses"):
        found = occ.calibrate_light(known, blobs, poses, gate_px=gate_px)
    lamps = [lamp_dict(light) for light in found.lamps]
    if as_json:
        emit_json({"status": found.status.name, "message": found.message, "lamps": lamps})
    else:
        click.echo("\n".join(map(line, lamps)))
    if found.ok:
        with blamed_on(out):
            found.scene.save(out)
    if any(lamp["status"] != "ok" for lamp in lamps):
        ctx.exit(1)
