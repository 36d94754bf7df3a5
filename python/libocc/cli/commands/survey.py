# SPDX-License-Identifier: Apache-2.0
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from ... import samples
from .. import Failure, error_context, json_option, print_json
from ..detect_options import Threshold, threshold_option
from ..prior_options import given, prior_options
from .calibrate_options import out_option


def camera_of(name: str) -> tuple[occ.Camera, occ.Scene | None]:
    """Camera of a camera file; camera of a scene, and the scene."""
    with error_context(name):
        if Path(name).is_file() and not re.search(r"^lamps:", Path(name).read_text(), re.MULTILINE):
            return occ.read_camera(name), None
        scene = samples.load_scene(name)
        return scene.camera, scene


def code_of(kind: str, scene: occ.Scene | None, is_recording: bool) -> occ.codes.Code:
    """Code of this kind with the parameters of the scene's lamps, if any has one."""
    if scene is None:
        raise Failure("--code: needs the exposure and row times of the camera: give a scene as --camera")
    if not is_recording:
        raise Failure("--code: needs a recording: a video, a bag or a folder of frames with --fps")
    known = [lamp.code.code for lamp in scene.lamps if lamp.code is not None]
    wanted = occ.codes.CodeKind[kind]
    return next((code for code in known if code.kind == wanted), occ.codes.Code(kind=wanted))


def places_of(path: str, times_s: Sequence[float | None]) -> list[Any]:
    """Position of the camera by odometry for each picture; None outside the times of the file."""
    with error_context(path):
        trajectory = occ.Trajectory.load(path)
        places = []
        for time_s in times_s:
            inside = time_s is not None and trajectory.begin_s <= time_s <= trajectory.end_s
            pose = np.asarray(trajectory.cam_from_world(time_s)) if inside and time_s is not None else None
            places.append(None if pose is None else -pose[:3, :3].T @ pose[:3, 3])
        if sum(place is not None for place in places) < 2:
            raise ValueError("has the times of fewer than two pictures; the frames need times: a video, or --fps")
        return places


def uses_few(found: occ.surveying.Survey) -> bool:
    """True if most pictures are not in the map, so that lamps should be followed from frame to frame."""
    return not found.ok or 2 * sum(image >= 0 for image in found.image_of_picture) < len(found.image_of_picture)


def lamp_number(name: str) -> int:
    """Number of a lamp: "lamp 3" or "3"."""
    number = name.removeprefix("lamp").strip()
    if not number.isdigit():
        raise Failure(f"--distance: must name lamps by their ids, such as \"lamp 3\", got {name!r}")
    return int(number)


@click.command(short_help="Make a map of a room's lamps from pictures alone.")
@click.argument("sources", nargs=-1, required=True, metavar="IMAGE...|FOLDER|VIDEO|BAG")
@click.option("--camera", "camera_path", metavar="FILE.yaml",
              help="Camera file, or a scene whose camera and sensor are used; default with --update: that of the map.")
@click.option("--calibrate-camera", is_flag=True,
              help="Estimate the parameters of the camera whose errors its file states (parameter_sigmas) along.")
@click.option("--update", "map_path", metavar="SCENE",
              help="Compare this map with the pictures: lamps that moved, are gone or new.")
@click.option("--map-sigma", "map_sigma_m", type=click.FloatRange(0, min_open=True), metavar="M",
              help="--update: error of the places of lamps whose errors the map does not state, sigma; default: 0.005.")
@click.option("--max-move", "max_move_m", type=click.FloatRange(0), metavar="M",
              help="--update: maximum displacement of a lamp that keeps its id; default: 0.3.")
@click.option("--distance", type=(str, str, float, float), multiple=True, metavar="FROM TO M SIGMA",
              help="Measured distance of two lamps, such as \"lamp 0\" \"lamp 4\" 2.641 0.002.")
@click.option("--radius", "radius_m", type=click.FloatRange(0, min_open=True), metavar="M",
              help="Radius of the lit discs, for the scale.")
@click.option("--radius-sigma", type=click.FloatRange(0, 1, min_open=True), default=0.01, show_default=True,
              help="Relative error of --radius, sigma.")
@click.option("--tag-size", "tag_size_m", type=click.FloatRange(0, min_open=True), metavar="M",
              help="Side of the black square of AprilTags in the pictures, for the scale.")
@click.option("--family", default="tag36h11", show_default=True,
              help="Family of the tags. With --update, the tags of the map link the pictures.")
@click.option("--odometry", metavar="FILE.tum",
              help="Poses of the camera by odometry at the times of the frames, for the scale.")
@click.option("--odometry-sigma", type=click.FloatRange(0, 1, min_open=True), default=0.01, show_default=True,
              help="Relative error of the length of a path by odometry, sigma.")
@click.option("--imu", metavar="FILE.csv|TOPIC",
              help="Samples of an inertial measurement unit that is fixed to the camera, for the scale of a recording: "
                   "a table, or a topic of the bag.")
@click.option("--ordered", is_flag=True, help="The images are frames of one slow motion, as those of a video.")
@click.option("--fps", type=click.FloatRange(0, min_open=True),
              help="Frame rate of a folder of frames or of a video without times.")
@click.option("--row-time", "row_time_s", type=click.FloatRange(0), metavar="S",
              help="Time between the exposures of two rows of a video; default: that of the scene's sensor.")
@click.option("--code", "code_kind", type=click.Choice([kind.name for kind in occ.codes.CodeKind]),
              help="Read the ids that lamps transmit in a recording; the code is that of the scene's lamps, if any.")
@click.option("--topic", help="Image topic of a bag that has several.")
@click.option("--max-pictures", type=click.IntRange(2), default=120, show_default=True,
              help="Frames of a video that are used.")
@prior_options
@threshold_option
@out_option
@json_option
@click.pass_context
def command(
    ctx: click.Context, sources: tuple[str, ...], camera_path: str | None, calibrate_camera: bool, map_path: str | None,
    map_sigma_m: float | None, max_move_m: float | None, prior: occ.Prior,
    distance: tuple[tuple[str, str, float, float], ...], radius_m: float | None, radius_sigma: float,
    tag_size_m: float | None, family: str, odometry: str | None, odometry_sigma: float, imu: str | None,
    ordered: bool, fps: float | None, row_time_s: float | None, code_kind: str | None, topic: str | None,
    max_pictures: int, threshold_dn: Threshold, out: str, as_json: bool,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --out a.png
    ...
    $ libocc simulate irregular_six --position 2.3 1.8 0.4 --heading-deg 90 --out b.png
    ...
    $ libocc simulate irregular_six --position 1.9 2.4 0.9 --heading-deg 200 --out c.png
    ...
    $ libocc survey a.png b.png c.png --camera irregular_six --radius 0.085 --out room
    ...

    Makes a map of the lamps from pictures that one calibrated camera took from unknown places, in any
    order, or from a video. No map is needed. A picture is used if it shows four whole lamps or more (in
    a slow video two) and matches the others in one way only. Lamps of a video that are too small for a
    measured rim are followed from frame to frame. Ids that lamps transmit (--code) show which is which.

    The pictures do not show the scale: give --distance between two lamps, --tag-size of AprilTags that
    at least two pictures show, --radius, or --odometry or --imu of a recording. Lamps have the same ids
    in each run with the same pictures; a first run without scale shows them in plan.png.

    --update MAP compares a map with the pictures and reports each lamp as unchanged, changed, moved, gone,
    not seen or new. The frame and the scale are those of the map; scene.yaml is the updated map. The
    --prior options, of the first picture, decide between several ways to link them to a regular map.

    The folder has scene.yaml (for `libocc locate`), plan.png, report.html, result.json and trajectory.tum
    (poses of the pictures). Exit code 0: surveyed; 1: not determined (result.json has the reason); 2: bad
    input.
    """
    if map_path is not None:
        scaled = {
            "--distance": distance, "--radius": radius_m, "--tag-size": tag_size_m, "--odometry": odometry,
            "--imu": imu,
        }
        for name, value in scaled.items():
            if value:
                raise Failure(f"{name}: is not used with --update: the scale is that of the map")
        if calibrate_camera:
            raise Failure("--calibrate-camera: is not used with --update: the places are compared with a known camera")
        options: dict[str, Any] = {"map_sigma_m": map_sigma_m, "max_move_m": max_move_m}
        run_update(
            ctx, sources, camera_path, map_path, given(prior), {k: v for k, v in options.items() if v is not None},
            family, ordered, max_pictures, fps, row_time_s, code_kind, topic, threshold_dn, out, as_json,
        )
        return
    if camera_path is None:
        raise Failure("--camera: is missing: a camera file, or a scene whose camera is used")
    for name, is_given in (("--map-sigma", map_sigma_m), ("--max-move", max_move_m), ("--prior-...", given(prior))):
        if is_given is not None:
            raise Failure(f"{name}: is used with --update only")
    if bool(distance) + sum(value is not None for value in (radius_m, tag_size_m, odometry, imu)) > 1:
        raise Failure("--distance, --radius, --tag-size, --odometry and --imu: give one of them")
    distances = [(lamp_number(a), lamp_number(b), length_m, sigma_m) for a, b, length_m, sigma_m in distance]
    camera, scene_of_camera = camera_of(camera_path)
    if calibrate_camera and camera.is_exact:
        raise Failure(
            f"--calibrate-camera: {camera_path} states no errors of the camera; add `parameter_sigmas` to it, such as "
            f"{{f_px: {0.02 * camera.fx_px:.3g}}} for a focal length that is known to 2 %"
        )
    sensor = None if scene_of_camera is None else scene_of_camera.sensor
    from ..survey.follow import follow, read_codes
    from ..survey.imu import read_imu
    from ..survey.sources import Detector, is_recording, read_pictures

    recording = is_recording(sources, fps)
    code = None if code_kind is None else code_of(code_kind, scene_of_camera, recording)
    if imu is not None and not recording:
        raise Failure("--imu: needs a recording: a video, a bag or a folder of frames with --fps")
    samples_of_imu = np.zeros((0, 7)) if imu is None else read_imu(imu, sources[0])
    detector = Detector(camera, sensor, threshold_dn, family if tag_size_m is not None else None)
    pictures = read_pictures(sources, detector, ordered, max_pictures, fps, topic)
    if code is not None:
        read_codes(sources[0], detector, code, pictures, fps, topic)
    places = [] if odometry is None else places_of(odometry, pictures.times_s)
    options = {
        "odometry_sigma": odometry_sigma, "calibrate_camera": calibrate_camera,
        "ordered": pictures.ordered, "radius_m": radius_m, "radius_sigma": radius_sigma, "tag_size_m": tag_size_m,
        "row_time_s": row_time_s if row_time_s is not None else 0.0 if sensor is None else sensor.row_time_s,
    }
    from ..survey.status import survey_status

    def surveyed() -> occ.surveying.Survey:
        with survey_status() as show, error_context("survey"):
            return occ.surveying.survey(
                pictures.blobs, camera, distances=distances, tags=pictures.tags, tracks=pictures.tracks,
                times_s=pictures.times_s, odometry_m=places, imu=samples_of_imu, progress=show, **options,
            )

    found = surveyed()
    if recording and not pictures.tracks and uses_few(found):
        follow(sources[0], detector, pictures, fps, topic)
        found = surveyed()
    from ..result_folder import ResultFolder
    from ..survey.output import text_lines, write_survey

    with error_context(out):
        folder = ResultFolder(out, {
            "kind": "survey", "pictures": list(sources), "camera": camera_path,
            "distances": [list(d) for d in distances], "odometry": odometry, "imu": imu,
            **options,
        })
        data, scene = write_survey(folder, found, sensor, code, family, pictures)
    if as_json:
        print_json(data)
    elif scene is not None:
        for line in [*text_lines(found, scene, len(pictures.blobs)), *(f"warning: {w}" for w in data["warnings"])]:
            click.echo(line)
        click.echo(f"{out}/scene.yaml, {out}/plan.png, {out}/report.html")
    if scene is None:
        for line in [*(f"not used: {o['picture']}: {o['reason']}" for o in data["omissions"] if o["blob"] is None)]:
            click.echo(line, err=True)
        click.echo(f"{data['status']}: {data['message']}", err=True)
        ctx.exit(1)


def run_update(
    ctx: click.Context, sources: tuple[str, ...], camera_path: str | None, map_path: str, prior: occ.Prior | None,
    options: dict[str, Any], family: str | None, ordered: bool, max_pictures: int, fps: float | None,
    row_time_s: float | None, code_kind: str | None, topic: str | None, threshold_dn: Threshold, out: str,
    as_json: bool,
) -> None:
    """Compares a map with the pictures, and writes the folder."""
    with error_context(map_path):
        scene = samples.load_scene(map_path)
    if camera_path is not None:
        camera, other = camera_of(camera_path)
        scene = scene.replace(camera=camera, sensor=scene.sensor if other is None else other.sensor)
    from ..result_folder import ResultFolder
    from ..survey.follow import follow, read_codes
    from ..survey.sources import Detector, is_recording, read_pictures
    from ..survey.status import survey_status
    from ..survey.update import failure_lines, text_lines, write_update

    recording = is_recording(sources, fps)
    code = None if code_kind is None else code_of(code_kind, scene, recording)
    families = sorted({tag.family for tag in scene.tags})
    if family not in families:
        family = families[0] if families else None
    detector = Detector(scene.camera, scene.sensor, threshold_dn, family)
    pictures = read_pictures(sources, detector, ordered, max_pictures, fps, topic)
    if code is not None:
        lamp_of_id = {lamp.code.id: lamp.id for lamp in scene.lamps if lamp.code is not None}
        read_codes(sources[0], detector, code, pictures, fps, topic, lamp_of_id)
    options = {
        **options, "ordered": pictures.ordered,
        "row_time_s": scene.sensor.row_time_s if row_time_s is None else row_time_s,
    }

    def updated() -> occ.surveying.MapUpdate:
        with survey_status() as show, error_context(map_path):
            return occ.surveying.update_map(
                pictures.blobs, scene, prior, tags=pictures.tags, tracks=pictures.tracks, times_s=pictures.times_s,
                progress=show, **options,
            )

    found = updated()
    if recording and not pictures.tracks and not found.ok:
        follow(sources[0], detector, pictures, fps, topic)
        found = updated()
    with error_context(out):
        folder = ResultFolder(out, {
            "kind": "map update", "pictures": list(sources), "map": map_path, "camera": camera_path,
            "prior": None if prior is None else repr(prior), **options,
        })
        data = write_update(folder, found, scene, pictures)
    if as_json:
        print_json(data)
    elif found.ok:
        for line in text_lines(found, data):
            click.echo(line)
        click.echo(f"{out}/scene.yaml, {out}/plan.png, {out}/report.html")
    if not found.ok:
        for line in failure_lines(found, data):
            click.echo(line, err=True)
        ctx.exit(1)
