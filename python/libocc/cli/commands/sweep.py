# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import click

from ... import __version__, samples
from .. import INTERRUPTED, error_context
from ..progress import progress
from ..result_folder import ResultFolder, content_hash
from ..sweep.plan import read_sweep
from ..sweep.run import check_points, done_points, points_of, run_sweep, write_tables


@click.command(short_help="Render and evaluate a scene over ranges of its parameters.")
@click.argument("sweep")
@click.option("--out", required=True, metavar="FOLDER",
              help="New folder, or that of an interrupted run with the same settings.")
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Number of processes.")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask cluster; replaces local processes.")
@click.pass_context
def command(ctx: click.Context, sweep: str, out: str, workers: int, scheduler: str | None) -> None:
    """\b
    $ libocc sweep exposure --out exposure
    exposure: 6 of 6 points, 6 of them new; table in exposure/results.csv

    SWEEP is a YAML file, or the name of one that comes with libocc: exposure. It has a scene, a pose, and
    parameters by their path in the scene file (sensor.exposure_s, lamps[0].power_w, lamps[*].power_w,
    pose.position_m[2]) with values, ranges or random draws, combined as a grid or zipped, and the results
    to keep: images, truth, detect, locate, time. See data/sweeps/README.md.

    The same command continues an interrupted run. The files do not depend on the number of workers,
    except for the times. All points are checked before the first one is rendered. Exit code 0: done;
    2: bad input; 130: Ctrl-C, finished points are kept.
    """
    with error_context(sweep):
        path = samples.find_sweep(sweep)
        plan = read_sweep(str(path))
    settings = {
        "kind": "sweep", "libocc": __version__, "sweep file (sha256)": content_hash(Path(path).read_bytes()),
        "scene and pose (sha256)": content_hash(plan.base.encode()),
    }
    points = points_of(plan)
    with error_context(sweep), progress("checking", len(points)) as advance:
        check_points(points, advance)
    with error_context(out):
        folder = ResultFolder(out, settings)
        with progress("checking results", len(points)) as advance:
            before = {point.index for point in done_points(folder, points, advance)}
        todo = [point for point in points if point.index not in before]
        with error_context(scheduler or sweep), progress("sweeping", len(todo)) as advance:
            interrupted = run_sweep(folder, todo, workers, scheduler, advance)
        with progress("gathering", len(points)) as advance:
            done = done_points(folder, points, advance)
        write_tables(folder, done)
    new = len(done) - len(before)
    click.echo(f"{out}: {len(done)} of {len(points)} points, {new} of them new; table in {out}/results.csv")
    if interrupted:
        click.echo("interrupted: the same command continues from here", err=True)
        ctx.exit(INTERRUPTED)
