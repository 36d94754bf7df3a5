# SPDX-License-Identifier: Apache-2.0
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import click

import libocc as occ

from ... import samples
from ...streams.frames import Source
from ...streams.open_source import open_source
from .. import INTERRUPTED, Failure, blamed_on
from ..files import whole_file
from ..position.coded_positioner import CodedPositioner
from ..position.follow import Follower, records
from ..position.lamp_table import lamps_of_table
from ..position.outputs import JsonLines, Output, Outputs, Tum
from ..position.positioner import Positioner, TrackerPositioner
from ..position.run import Run, Screen, tell
from ..position.stopping import stopped_by_signals
from ..prior_options import prior_options


def lamp_code(scene: occ.Scene) -> occ.codes.Code:
    return next((lamp.code.code for lamp in scene.lamps if lamp.code is not None), occ.codes.Code(kind=occ.codes.CodeKind.ufsook))


def scene_of(name: str, table: str | None) -> occ.Scene:
    with blamed_on(name):
        scene = samples.load_scene(name)
    if table is None:
        return scene
    with blamed_on(table):
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
    """Those that are wanted. All are opened before the first frame."""
    made: list[Output] = []
    for path, kind in ((out, JsonLines), (tum, Tum)):
        if path is not None:
            with blamed_on(path):
                made.append(kind(path))
    if bag is not None:
        from ..position.bag_output import BagOutput

        with blamed_on(bag):
            made.append(BagOutput(bag))
    if rerun is not None:
        from ..position.rerun_output import RerunOutput

        with blamed_on(rerun):
            made.append(RerunOutput(rerun, scene))
    return Outputs(made, tell)


@contextmanager
def closing_all(source: Source, outputs: Outputs) -> Iterator[None]:
    """Files are closed whole, whatever happens."""
    try:
        yield
    finally:
        outputs.close()
        source.close()


@click.command(short_help="Where the camera is, live: from a folder, a video, a camera or a ROS bag.")
@click.argument("scene")
@click.option("--source", required=True, metavar="FOLDER|VIDEO|camera:N|BAG", help="Where frames come from.")
@click.option("--topic", metavar="TOPIC", help="Of images in a bag; needed where it has several.")
@click.option("--fps", type=click.FloatRange(0, min_open=True), help="Of frames whose times are unknown.")
@click.option("--decode", is_flag=True, help="Lamps blink their ids: read who is who first, then track.")
@click.option("--lamps", "table", metavar="FILE.csv", help="Lamps by their ids: columns id,x,y,z[,radius] [m].")
@click.option("--realtime", is_flag=True, help="Play files at their pace and drop frames, as of a camera.")
@click.option("--out", metavar="FILE.jsonl", help="Every frame's record as JSON, one a line.")
@click.option("--tum", metavar="FILE.tum", help="Poses as TUM's format has them, for evo.")
@click.option("--bag", metavar="NAME|NAME.bag", help="Poses as a new ROS 2 or ROS 1 bag.")
@click.option("--rerun", metavar="FILE.rrd", help="A recording for Rerun's viewer.")
@click.option("--plot", metavar="FILE.png", help="Path, errors against the truth where there is one, states.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON lines instead of text.")
@click.option("--quiet", is_flag=True, help="Print no line a frame, the summary alone.")
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

    Says of every frame of a source where the camera was, as soon as it has come, by the lamps of SCENE.
    The state is searching, tracking, coasting (no lamps: the predicted pose with its grown sigma), lost
    (no pose), or skipped: frames that cannot be read, are repeated or come late are said with the
    reason. A camera's frames are dropped rather than falling behind; the summary, on stderr, counts them.

    --decode needs no prior: positions begin when the lamps have said who they are.

    --bag has on /libocc/pose a PoseWithCovarianceStamped of the camera's optical frame (x right, y down,
    z forward) in the frame `map`, the scene's world; its covariance is [x, y, z, turns about x, y, z]
    along the world's axes. /libocc/fix has every record as JSON. --tum and /libocc/pose have no
    predicted poses.

    Exit code 0: done, some frame had a position; 1: none had; 2: bad input, or an output that could not
    be written (the others are whole); 130: stopped by Ctrl-C or SIGTERM, all files are whole.
    """
    loaded = scene_of(scene, table)
    with blamed_on(source):
        frames = open_source(source, fps, topic)
    with blamed_on("prior"):
        positioner = positioner_of(loaded, prior, decode, frames.live or realtime)
    outputs = outputs_of(loaded, out, tum, bag, rerun)
    recording = any((out, tum, bag, rerun, plot))
    run = Run(Screen(as_json, quiet), outputs, [] if plot is not None else None, recording)
    with stopped_by_signals() as stop, closing_all(frames, outputs):
        shown = quiet or not sys.stdout.isatty()
        follower = Follower(loaded, positioner)
        run.through(records(frames, follower, stop, realtime, tell), source, frames.total if shown else None)
        interrupted = stop.is_set() and not run.unheard
    if run.kept is not None and plot is not None:
        from ..position.plot import draw

        with blamed_on(plot), whole_file(plot) as file:
            draw(file, run.kept, loaded, title=f"{source}: {run.summary.text().splitlines()[0]}")
    tell(run.summary.text())
    if interrupted:
        tell("interrupted: what there is is whole")
        ctx.exit(INTERRUPTED)
    if run.failed:
        ctx.exit(Failure.exit_code)
    ctx.exit(0 if run.summary.first_pose_s is not None else 1)
