# SPDX-License-Identifier: Apache-2.0
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import click

import libocc as occ

from ... import samples
from ...streams.frames import Source
from ...streams.open_source import open_source
from .. import INTERRUPTED, Failure, error_context
from ..files import whole_file
from ..position.coded_positioner import CodedPositioner
from ..position.follow import Follower, records
from ..position.lamp_table import lamps_of_table
from ..position.outputs import JsonLines, Output, Outputs, Tum
from ..position.positioner import Positioner, TrackerPositioner
from ..position.run import Run, Screen, report
from ..position.stopping import stopped_by_signals
from ..prior_options import prior_options


def lamp_code(scene: occ.Scene) -> occ.codes.Code:
    default = occ.codes.Code(kind=occ.codes.CodeKind.ufsook)
    return next((lamp.code.code for lamp in scene.lamps if lamp.code is not None), default)


def scene_of(name: str, table: str | None) -> occ.Scene:
    with error_context(name):
        scene = samples.load_scene(name)
    if table is None:
        return scene
    with error_context(table):
        return lamps_of_table(table, scene, lamp_code(scene))


def positioner_of(scene: occ.Scene, prior: occ.Prior, decode: bool, live: bool) -> Positioner:
    if not decode:
        return TrackerPositioner(scene, prior)
    if all(lamp.code is None for lamp in scene.lamps):
        raise Failure("--decode: no lamp of the scene has a code; give --lamps")
    return CodedPositioner(scene, lamp_code(scene), prior, live)


def outputs_of(
    scene: occ.Scene, out: str | None, tum: str | None, bag: str | None, rerun: str | None
) -> Outputs:
    """Opens all requested outputs, before the first frame."""
    made: list[Output] = []
    for path, kind in ((out, JsonLines), (tum, Tum)):
        if path is not None:
            with error_context(path):
                made.append(kind(path))
    if bag is not None:
        from ..position.bag_output import BagOutput

        with error_context(bag):
            made.append(BagOutput(bag))
    if rerun is not None:
        from ..position.rerun_output import RerunOutput

        with error_context(rerun):
            made.append(RerunOutput(rerun, scene))
    return Outputs(made, report)


@contextmanager
def closing_all(source: Source, outputs: Outputs) -> Iterator[None]:
    """Closes the outputs and the source when the block ends, also after an error."""
    try:
        yield
    finally:
        outputs.close()
        source.close()


@click.command(short_help="Compute positions live from a folder, a video, a camera or a ROS bag.")
@click.argument("scene")
@click.option("--source", required=True, metavar="FOLDER|VIDEO|camera:N|BAG", help="Source of the frames.")
@click.option("--topic", metavar="TOPIC", help="Image topic of a bag; required if the bag has several.")
@click.option("--fps", type=click.FloatRange(0, min_open=True), help="Frame rate of frames whose times are unknown.")
@click.option("--decode", is_flag=True, help="Lamps transmit ids: decode the ids first, then track.")
@click.option("--lamps", "table", metavar="FILE.csv", help="Table of lamps with the columns id,x,y,z[,radius] [m].")
@click.option("--realtime", is_flag=True, help="Play files in real time and drop frames as with a camera.")
@click.option("--out", metavar="FILE.jsonl", help="Write the record of every frame as JSON, one per line.")
@click.option("--tum", metavar="FILE.tum", help="Write poses in TUM format, for evo.")
@click.option("--bag", metavar="NAME|NAME.bag", help="Write poses to a new ROS 2 or ROS 1 bag.")
@click.option("--rerun", metavar="FILE.rrd", help="Write a recording for the Rerun viewer.")
@click.option("--plot", metavar="FILE.png", help="Draw the path, the states, and the errors if the truth is known.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON lines instead of text.")
@click.option("--quiet", is_flag=True, help="Print only the summary.")
@prior_options
@click.pass_context
def command(
    ctx: click.Context, scene: str, source: str, topic: str | None, fps: float | None, decode: bool,
    table: str | None, realtime: bool, out: str | None, tum: str | None, bag: str | None, rerun: str | None,
    plot: str | None, as_json: bool, quiet: bool, prior: occ.Prior,
) -> None:
    """\b
    $ libocc sequence irregular_six walk --out walk --fps 10 --frames 3
    walk: 3 of 3 frames, 3 of them new (png, plain)
    $ libocc position irregular_six --source walk --tum walk.tum
        time s  state           x m       y m       z m  sigma mm  lamps
         0.000  tracking     1.6000    1.8001    0.4000      0.09  0 1 2 3 4 5
    ...

    Computes the camera's pose for every frame of a source as soon as the frame arrives, from the lamps of
    SCENE. The state is searching, tracking, coasting (no lamps: the predicted pose with a growing sigma),
    lost (no pose), or skipped. Skipped frames are unreadable, repeated or late; the reason is printed.
    Frames of a live camera are dropped if they arrive too fast; the summary on stderr has their number.

    --decode needs no prior: positions start when the ids of the lamps are decoded.

    --bag writes to /libocc/pose a PoseWithCovarianceStamped of the camera's optical frame (x right, y down,
    z forward) in the frame `map`, the world frame of the scene. Its covariance has the order [x, y, z,
    rotations about x, y, z] along the world's axes. /libocc/fix has every record as JSON. --tum and
    /libocc/pose have no predicted poses.

    Exit code 0: done, at least one frame has a position; 1: no frame has one; 2: bad input, or an output
    could not be written (the others are complete); 130: stopped by Ctrl-C or SIGTERM, all files are
    complete.
    """
    loaded = scene_of(scene, table)
    with error_context(source):
        frames = open_source(source, fps, topic)
    with error_context("prior"):
        positioner = positioner_of(loaded, prior, decode, frames.live or realtime)
    outputs = outputs_of(loaded, out, tum, bag, rerun)
    recording = any((out, tum, bag, rerun, plot))
    run = Run(Screen(as_json, quiet), outputs, [] if plot is not None else None, recording)
    with stopped_by_signals() as stop, closing_all(frames, outputs):
        shown = quiet or not sys.stdout.isatty()
        follower = Follower(loaded, positioner)
        run.process(records(frames, follower, stop, realtime, report), source, frames.total if shown else None)
        interrupted = stop.is_set() and not run.outputs_gone
    if run.kept is not None and plot is not None:
        from ..position.plot import draw

        with error_context(plot), whole_file(plot) as file:
            draw(file, run.kept, loaded, title=f"{source}: {run.summary.text().splitlines()[0]}")
    report(run.summary.text())
    if interrupted:
        report("interrupted; all files written so far are complete")
        ctx.exit(INTERRUPTED)
    if run.failed:
        ctx.exit(Failure.exit_code)
    ctx.exit(0 if run.summary.first_pose_s is not None else 1)
