# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from ... import samples
from ...yaml_files import suggestion
from .. import Failure, error_context, json_option, overlay_option, print_json
from ..sequence_frames import Frames, load_frames
from ..stripe_codes import StripedLamp, striped_lamps

JOIN_FRAMES = 15  # 0.5 s at 30 frames/s, longer than the dark intervals of usual codes
KINDS = [kind.name for kind in occ.codes.CodeKind]
LINES = {"manchester": occ.codes.LineCode.manchester, "4b6b": occ.codes.LineCode.code_4b6b}
CHECKSUMS = {sum_.name: sum_ for sum_ in occ.codes.Checksum}


def chosen(name: str, value: str, known: dict[str, Any]) -> Any:
    if value not in known:
        raise Failure(f"--{name}: unknown {value!r}; {suggestion(value, list(known))}")
    return known[value]


def map_of(place: str, wanted: str | None) -> occ.Scene:
    """Loads the given map, or the scene that `libocc sequence` wrote beside its frames."""
    beside = Path(place) / "scene.yaml"
    if wanted is None and not beside.is_file():
        raise Failure(f"{place}: has no scene.yaml with the sensor: give --map")
    path = wanted or str(beside)
    with error_context(path):
        return samples.load_scene(path)


def code_of(kind: str | None, scene: occ.Scene, changes: dict[str, Any]) -> occ.codes.Code:
    """Code of the map's lamps, with the changes given on the command line."""
    known = [lamp.code.code for lamp in scene.lamps if lamp.code is not None]
    if kind is None and not known:
        raise Failure("--code must be given because no lamp of the map has a code")
    wanted = known[0].kind if kind is None else occ.codes.CodeKind[kind]
    code = next((one for one in known if one.kind == wanted), occ.codes.Code(kind=wanted))
    with error_context("--code"):
        return code.replace(**{name: value for name, value in changes.items() if value is not None})


def position_of(blobs: list[occ.Blob], scene: occ.Scene) -> occ.Fix | None:
    """Fix from the decoded lamps; None when they are fewer than four."""
    lamps = {lamp.id: lamp for lamp in scene.lamps}
    decoded = [blob for blob in blobs if blob.lamp_id is not None and not blob.cut_by_border]
    if len(decoded) < 4:
        return None
    points = np.array([lamps[blob.lamp_id].centre_m for blob in decoded if blob.lamp_id is not None])
    seen = np.array([blob.centroid_px for blob in decoded])
    sigma_px = float(np.sqrt(np.mean([np.trace(blob.covariance_px2) / 2 for blob in decoded])))
    return occ.solve_pose(points, seen, scene.camera, sigma_px=max(sigma_px, 0.05))


def lamp_dict(lamp: occ.codes.DecodedLamp, blob: occ.Blob) -> dict[str, Any]:
    return {
        "id": lamp.id,
        "lamp": blob.lamp_id,
        "status": lamp.code.status.name,
        "message": lamp.code.message,
        "px": blob.centroid_px.tolist(),
        "bits": lamp.code.bits,
        "expected_errors": lamp.code.expected_errors,
        "explained": lamp.code.explained,
        "clock_error": lamp.code.clock_error,
        "frames_seen": lamp.seen,
        "reference": lamp.reference,
        "chips_in_view": lamp.budget.chips_in_view,
        "chips_needed": lamp.budget.chips_needed,
    }


def lamps_text(found: occ.codes.Decoded) -> str:
    lines = [" n      x px      y px    id  lamp  explained  status"]
    for i, (lamp, blob) in enumerate(zip(found.lamps, found.blobs, strict=True)):
        x, y = blob.centroid_px
        code_id = "-" if lamp.id is None else str(lamp.id)
        lamp_id = "-" if blob.lamp_id is None else str(blob.lamp_id)
        what = lamp.code.status.name + (f": {lamp.code.message}" if lamp.code.message else "")
        lines.append(f"{i:2} {x:9.2f} {y:9.2f} {code_id:>5} {lamp_id:>5} {lamp.code.explained:10.2f}  {what}")
    return "\n".join(lines)


def stripes_text(found: list[StripedLamp]) -> str:
    lines = ["lamp  frequency Hz  sigma Hz  frames"]
    for lamp in found:
        frequency_hz, sigma_hz = lamp.measured_hz
        lines.append(f"{lamp.id:4} {frequency_hz:13.1f} {sigma_hz:9.1f} {len(lamp.blobs):7}")
    return "\n".join(lines)


def decode_stripes(frames: Frames, scene: occ.Scene, as_json: bool) -> bool:
    with error_context("--map"):
        found = striped_lamps(frames, scene)
    if as_json:
        print_json([{"lamp": one.id, "frequency_hz": one.measured_hz[0], "sigma_hz": one.measured_hz[1],
                    "seen": len(one.blobs)} for one in found])
    else:
        click.echo(stripes_text(found) if found else "no stripes of a lamp were decoded")
    return bool(found)


@click.command(short_help="Decode the ids of blinking lamps from a sequence.")
@click.argument("frames")
@click.option("--code", "kind", metavar="|".join([*KINDS, "stripe"]),
              help="Code of the lamps; default: that of the map.")
@click.option("--map", "map_name", metavar="SCENE", help="Sensor and lamps; default: FRAMES/scene.yaml.")
@click.option("--fps", type=click.FloatRange(0, min_open=True), help="Frame rate of frames whose times are unknown.")
@click.option("--still", is_flag=True, help="The camera stands still: lamps are detected over all frames.")
@click.option("--exact-times", is_flag=True, help="c_ook: the times of the frames are accurate to a quarter of a chip.")
@click.option("--clock-hz", type=float, help="c_ook: chips per second; csk: symbols per second.")
@click.option("--line", metavar="|".join(LINES), help="c_ook: line code.")
@click.option("--checksum", metavar="|".join(CHECKSUMS), help="Checksum of an id.")
@click.option("--id-bits", type=int, help="Bits of an id.")
@click.option("--frame-rate-hz", type=float, help="ufsook, s2psk: frame rate for which the lamps were set up.")
@json_option
@overlay_option
@click.pass_context
def command(
    ctx: click.Context, frames: str, kind: str | None, map_name: str | None, fps: float | None,
    still: bool, exact_times: bool, clock_hz: float | None, line: str | None, checksum: str | None,
    id_bits: int | None, frame_rate_hz: float | None, as_json: bool, overlay: str | None,
) -> None:
    """\b
    $ libocc sequence ufsook_four standing --out standing
    standing: 40 of 40 frames, 40 of them new (png, plain)
    $ libocc decode standing --still
     n      x px      y px    id  lamp  explained  status
    ...

    Decodes the ids that lamps transmit in FRAMES: a video, or a folder of images such as `libocc sequence`
    writes. SCENE gives the sensor's timing and the id of each lamp (key `code` of a lamp; for
    `--code stripe` its frequency_hz). With at least four decoded lamps the camera's position is printed.

    Exit code 0: a lamp was decoded; 1: none; 2: bad input.
    """
    if kind is not None and kind not in [*KINDS, "stripe"]:
        raise Failure(f"--code: unknown code {kind!r}; {suggestion(kind, [*KINDS, 'stripe'])}")
    scene = map_of(frames, map_name)
    with error_context(frames):
        loaded = load_frames(frames, fps)
    if kind == "stripe":
        ctx.exit(0 if decode_stripes(loaded, scene, as_json) else 1)
    changes = {
        "clock_hz": clock_hz, "id_bits": id_bits, "frame_rate_hz": frame_rate_hz,
        "line": None if line is None else chosen("line", line, LINES),
        "checksum": None if checksum is None else chosen("checksum", checksum, CHECKSUMS),
    }
    code = code_of(kind, scene, changes)
    with error_context(frames):
        found = occ.codes.decode(
            loaded.images, loaded.times_s, scene.sensor, code, map=scene, exact_times=exact_times,
            join_frames=0 if still else JOIN_FRAMES,
        )
    fix = position_of(found.blobs, scene)
    if overlay is not None:
        from ..overlay import draw_decoded

        with error_context(overlay):
            draw_decoded(overlay, np.maximum.reduce(loaded.images), found, title=f"{frames}: {code.kind.name}")
    decoded = [blob.lamp_id for blob in found.blobs if blob.lamp_id is not None]
    if as_json:
        position = None if fix is None or not fix.ok else fix.position_m.tolist()
        print_json({
            "status": found.status.name, "message": found.message, "position_m": position,
            "lamps": [lamp_dict(*pair) for pair in zip(found.lamps, found.blobs, strict=True)],
        })
    else:
        click.echo(lamps_text(found) if found.lamps else found.message)
        if found.lamps and found.message:
            click.echo(found.message)
        if fix is not None and fix.ok:
            click.echo(f"position {' '.join(f'{v:.3f}' for v in fix.position_m)} m")
    ctx.exit(0 if decoded else 1)
