# SPDX-License-Identifier: Apache-2.0
from typing import TYPE_CHECKING, Any

import click
import numpy as np

import libocc as occ

from ... import samples
from ...surveying import shared_errors
from .. import Failure, error_context, json_option
from ..detect_options import Threshold, background_hint, threshold_of, threshold_option
from ..progress import progress
from .calibrate_options import add_distances, distance_option, finish, out_option, robust_option

if TYPE_CHECKING:  # matplotlib loads slowly
    from ..calibration.summary import Calibration

MIN_REDUNDANCY = 5
MAX_SCALE_CHANGE = 0.02  # a tape is more accurate over a room


def assigned_lamps(
    pixels: Any, scene: occ.Scene, map_sigma_px: float, threshold_dn: Threshold
) -> tuple[list[Any], str]:
    """(lamp id, centroid, covariance) of each assigned blob; and the reason when there are none."""
    camera, (height, width) = scene.camera, pixels.shape[:2]
    if (width, height) != (camera.width, camera.height):
        turned = ": it was rotated after it was taken; use the original file" if width == camera.height else ""
        raise ValueError(
            f"its size is {width} x {height} px, that of the map's camera is "
            f"{camera.width} x {camera.height} px{turned}"
        )
    blobs = occ.detect(pixels, sensor=scene.sensor, threshold_dn=threshold_of(pixels, threshold_dn))
    found = occ.identify(blobs, scene, gate_model_sigma_px=map_sigma_px)
    if not found.ok:
        hint = background_hint(pixels, blobs, threshold_dn, len(scene.lamps))
        return [], hint or f"{found.status.name}: {found.message}"
    assigned = [(scene.lamps[match.lamp].id, blobs[match.blob]) for match in found.hypotheses[0].matches]
    return [(id, blob.centroid_px, blob.covariance_px2) for id, blob in assigned if not blob.cut_by_border], ""


@click.command(short_help="Survey the positions of a room's lamps from images.")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--map", "scene_path", required=True, metavar="SCENE",
              help="Scene with the camera and approximate lamp positions.")
@click.option("--map-sigma-px", type=click.FloatRange(min=0.01), default=3.0, show_default=True,
              help="Error of a lamp's image caused by errors of the map, sigma.")
@threshold_option
@click.option("--free", metavar="NAME,NAME,...", default="", help="Camera parameters to estimate as well.")
@distance_option
@out_option
@robust_option
@json_option
@click.pass_context
def command(
    ctx: click.Context, images: tuple[str, ...], scene_path: str, map_sigma_px: float,
    threshold_dn: Threshold, free: str, distance: tuple[Any, ...], out: str, robust: bool, as_json: bool,
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

    Surveys the lamps in IMAGEs, which the map's camera took from different positions. The map gives
    approximate lamp positions, which identify the lamps. Inner constraints over all lamps align the
    result with the map; the scale is that of the map unless a --distance between two lamps ("lamp 3")
    is given. Besides the report, the folder has scene.yaml, the map with the surveyed positions. Exit
    code 0: surveyed; 1: not determined or not converged (the folder has the last state); 2: bad input.
    """
    with error_context(scene_path):
        scene = samples.load_scene(scene_path)
    parameters = [name for name in free.split(",") if name]
    known = [parameter.name for parameter in scene.camera.parameters]
    for name in parameters:
        if name not in known:
            raise Failure(f"--free: {name!r} is not a parameter of the camera; allowed: {', '.join(known)}")
    seen, notes = [], []
    with progress("identifying lamps", len(images)) as advance:
        for image in images:
            with error_context(image):
                lamps, reason = assigned_lamps(occ.read_image(image), scene, map_sigma_px, threshold_dn)
            if reason:
                notes.append(f"{image}: {reason}; the image is not used")
            else:
                seen.append((image, 0, lamps))
            advance()
    if len(seen) < 2:
        raise Failure(
            f"the lamps were identified in {len(seen)} of {len(images)} images; at least 2 are needed. "
            + ". ".join(notes)
        )
    started = occ.network.lamp_network([("camera", scene.camera, parameters)], scene, seen)
    if not started.ok:
        raise Failure(f"{started.status.name}: {started.message} {' '.join(notes)}")
    add_distances(started.network, distance)
    finish(ctx, started.network, occ.network.Datum(), out=out, title=f"Lamps in {len(images)} images", select=False,
           robust=robust, as_json=as_json, notes=notes + started.warnings,
           settings={"kind": "lamps", "images": list(images), "map": scene_path},
           text=lambda data: lamp_lines(data, scene),
           more=lambda found: {"scene.yaml": surveyed(scene, found).format().encode()})


def scale_warning(points_m: Any, map_m: Any) -> str:
    """A sentence if the distances between the lamps differ from those in the map by a common factor."""
    spread = [float(np.linalg.norm(at - at.mean(axis=0))) for at in (np.asarray(points_m), np.asarray(map_m))]
    change = spread[0] / spread[1] - 1 if spread[1] > 0 else 0.0
    if abs(change) <= MAX_SCALE_CHANGE:
        return ""
    return f"the lamps are {100 * change:+.1f} % farther apart than in the map: check --distance and the map"


def lamp_lines(data: dict[str, Any], scene: occ.Scene) -> list[str]:
    """Position of each surveyed lamp, its sigma, and its distance from the map."""
    before = {f"lamp {lamp.id}": np.asarray(lamp.centre_m) for lamp in scene.lamps}
    text = []
    for point in data["points"]:
        at = point["position_m"]
        if None in point["sigma_m"]:
            text.append(f"{point['name']} is not determined; take more pictures of it")
            continue
        moved_mm = 1e3 * float(np.linalg.norm(at - before[point["name"]]))
        sigmas = " ".join(f"{1e3 * sigma:.2g}" for sigma in point["sigma_m"])
        place = " ".join(f"{value:.4f}" for value in at)
        text.append(f"{point['name']} at {place} m, sigma {sigmas} mm, {moved_mm:.1f} mm from the map")
    scale = scale_warning(
        [point["position_m"] for point in data["points"]], [before[point["name"]] for point in data["points"]]
    )
    if data["redundancy"] < MIN_REDUNDANCY:
        text.append(f"warning: redundancy {data['redundancy']}: gross errors are not detected; take more pictures")
    if scale:
        text.append(f"warning: {scale}")
    absent = [name for name in before if name not in {point["name"] for point in data["points"]}]
    return text + [f"{name} was not surveyed; the position in the map is kept" for name in absent]


def surveyed(scene: occ.Scene, found: "Calibration") -> occ.Scene:
    """Scene with the adjusted lamp positions and the adjusted camera, with their errors."""
    from ..calibration.run import stated_camera

    network, known = found.network, found.known
    places = dict(zip(network.point_names, np.asarray(network.points_m)))
    lamps = {lamp.id: lamp for lamp in scene.lamps}
    for lamp in scene.lamps:
        if f"lamp {lamp.id}" in places:
            lamps[lamp.id] = lamp.replace(centre_m=places[f"lamp {lamp.id}"])
    numbers = {name: number for number, name in enumerate(network.point_names)}
    covariances = np.asarray(known.points()) if known.ok else np.zeros((0, 3, 3))
    stated = [
        (id, occ.network.Target.point(numbers[f"lamp {id}"]))
        for id in lamps
        if known.ok and f"lamp {id}" in numbers and np.isfinite(covariances[numbers[f"lamp {id}"]]).all()
    ]
    if stated:
        joint_m2 = np.array([[known.positions(a, b)[:3, 3:] for _, b in stated] for _, a in stated])
        for i, (_, target) in enumerate(stated):
            joint_m2[i, i] = known.position(target)
        sigmas_m, errors_m = shared_errors(joint_m2)
        for i, (id, _) in enumerate(stated):
            lamps[id] = lamps[id].replace(position_sigma_m=sigmas_m[i], shared_errors_m=list(errors_m[:, i]))
    return scene.replace(lamps=list(lamps.values()), camera=stated_camera(found, 0))
