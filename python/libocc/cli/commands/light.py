# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from ... import samples
from ...yaml_files import parse_yaml, yaml_text
from .. import error_context, file_names_in_errors, json_option, print_json
from ..progress import progress


def matrix(value: Any, name: str) -> Any:
    """Pose from 4x4 numbers, or from a mapping with the key cam_from_world."""
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
    """Reads a list of poses in the order of the images, or a mapping from image names to poses (YAML or JSON)."""
    data = parse_yaml(yaml_text(path))
    if isinstance(data, list):
        if len(data) != len(images):
            raise ValueError(f"has {len(data)} poses for {len(images)} images")
        return [matrix(value, f"pose {i}") for i, value in enumerate(data)]
    if not isinstance(data, dict):
        raise ValueError("must be a list of poses or a mapping from image names to poses")
    for image in images:
        if Path(image).name not in data:
            raise ValueError(f"has no pose for {Path(image).name}")
    return [matrix(data[Path(image).name], Path(image).name) for image in images]


def pose_beside(image: str) -> Any:
    path = Path(image).with_suffix(".json")
    with error_context(path):
        return matrix(parse_yaml(yaml_text(path)), path.name)


def lamp_dict(light: occ.photometry.LampLight) -> dict[str, Any]:
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


def factor_dict(factor: occ.network.CommonFactor) -> dict[str, float]:
    return {"value": factor.value, "sigma": float(np.sqrt(factor.covariance[0, 0]))}


def ambient_dict(ambient: occ.photometry.AmbientLight) -> dict[str, Any]:
    return {
        "status": ambient.status.name, "message": ambient.message,
        "irradiance_w_m2": ambient.irradiance_w_m2 if ambient.ok else None,
        "sigma_w_m2": float(np.sqrt(ambient.variance_w2_m4)) if ambient.ok else None,
        "chi2": ambient.chi2, "dof": ambient.dof,
        "images": sum(not image.left_out for image in ambient.images),
    }


def ambient_line(data: dict[str, Any]) -> str:
    if data["status"] != "ok":
        return f"ambient light: {data['status']}: {data['message']}"
    text = (
        f"ambient light: {data['irradiance_w_m2']:.4g} W/m2 +- {data['sigma_w_m2']:.2g}, "
        f"{data['images']} images, chi2 {data['chi2']:.0f} of {data['dof']}"
    )
    return f"{text}; {data['message']}" if data["message"] else text


def summary(found: occ.photometry.CalibratedLight, ambient: occ.photometry.AmbientLight | None) -> dict[str, Any]:
    data: dict[str, Any] = {"status": found.status.name, "message": found.message}
    if found.factor is not None:
        data["factor"] = factor_dict(found.factor)
    data["lamps"] = [lamp_dict(light) for light in found.lamps]
    if ambient is not None:
        data["ambient"] = ambient_dict(ambient)
    return data


def lines(data: dict[str, Any]) -> list[str]:
    text = []
    if "factor" in data:
        factor = data["factor"]
        text.append(f"all powers: the scene's times {factor['value']:.4g} +- {100 * factor['sigma']:.2g} %")
    text += map(line, data["lamps"])
    if "ambient" in data:
        text.append(ambient_line(data["ambient"]))
    return text


def calibrated_scene(
    found: occ.photometry.CalibratedLight, ambient: occ.photometry.AmbientLight | None
) -> occ.Scene | None:
    """Scene with the estimated values; None when nothing was determined."""
    if ambient is not None and ambient.ok:
        return found.scene.replace(ambient_w_m2=max(0.0, ambient.irradiance_w_m2))
    return found.scene if found.ok else None


@click.command(short_help="Estimate the lamps' power and Lambertian order from images.")
@click.argument("scene")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--poses", "poses_path", metavar="FILE.yaml|json",
              help="cam_from_world of each image, by order or by name; default: the .json file beside each image.")
@click.option("--powers", type=click.Choice([*occ.photometry.PowerFit.__members__]), default="each", show_default=True,
              help="Unknowns: the power of every lamp, or one common factor of the powers in SCENE.")
@click.option("--ambient", "with_ambient", is_flag=True, help="Also estimate the ambient light.")
@click.option("--gate-px", type=click.FloatRange(0, min_open=True), default=3, show_default=True,
              help="Max distance of a blob from the predicted position of its lamp.")
@click.option("--out", default="scene_calibrated.yaml", show_default=True, metavar="FILE.yaml")
@json_option
@click.pass_context
def command(
    ctx: click.Context, scene: str, images: tuple[str, ...], poses_path: str | None, powers: str,
    with_ambient: bool, gate_px: float, out: str, as_json: bool,
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

    Fits power and Lambertian order of SCENE's lamps to their fluxes in IMAGEs with known poses, and
    writes the scene with the estimated power_w, power_sigma and half_power_deg. The sensor and its
    response are assumed as in SCENE. --powers common_factor assumes that the powers in SCENE are correct
    up to one factor, such as an unknown exposure or gain; images cannot separate such a factor from the
    powers. --ambient estimates ambient_w_m2 from the pixels that no lamp reaches. Exit code 0: all values
    are determined; 1: a lamp's power or the ambient light is not determined; 2: bad input.
    """
    with error_context(scene):
        known = samples.load_scene(scene)
    if poses_path is None:
        poses = [pose_beside(image) for image in images]
    else:
        with error_context(poses_path):
            poses = poses_from(poses_path, images)
    sensor = known.as_rendered().sensor
    pixels, blobs = [], []
    with progress("measuring", len(images)) as advance:
        for image in images:
            with error_context(image):
                pixels.append(occ.read_image(image))
                blobs.append(occ.detect(pixels[-1], sensor=sensor))
            advance()
    with error_context(poses_path or "poses"):
        fit = occ.photometry.PowerFit[powers]
        found = occ.photometry.calibrate_light(known, blobs, poses, powers=fit, gate_px=gate_px)
    ambient = None
    if with_ambient:
        with file_names_in_errors(images):
            ambient = occ.photometry.calibrate_ambient(known, pixels, poses)
    data = summary(found, ambient)
    if as_json:
        print_json(data)
    else:
        click.echo("\n".join(lines(data)))
    calibrated = calibrated_scene(found, ambient)
    if calibrated is not None:
        with error_context(out):
            calibrated.save(out)
    parts = [*data["lamps"], *([data["ambient"]] if ambient is not None else [])]
    if any(part["status"] != "ok" for part in parts):
        ctx.exit(1)
