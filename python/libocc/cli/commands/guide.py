# SPDX-License-Identifier: Apache-2.0
import io
import json
from pathlib import Path
from typing import Any

import click

from ... import __version__, samples
from ...guide.docking_test import DockingTest
from ...guide.experiment import Experiment, experiment_of
from ...yaml_files import read_yaml
from .. import INTERRUPTED, error_context, json_option, print_json
from ..guide.runs import Job, Run, columns_of, done_runs, is_done, job_data, metrics_table, run_all
from ..guide.summary import docking_dict, docking_table, summarised, text_of
from ..progress import progress
from ..result_folder import ResultFolder, content_hash, json_bytes

DRAWN_PATHS = 30  # more paths hide each other in the picture


def changed(data: Any, runs: int | None, seed: int | None) -> Any:
    if not isinstance(data, dict):
        return data  # experiment_of() raises the error
    return data | {key: value for key, value in (("runs", runs), ("seed", seed)) if value is not None}


def settings_of(experiment: Experiment, data: Any) -> dict[str, Any]:
    """Settings that determine the runs; the number of runs is not among them, so that runs can be added."""
    followed = {key: value for key, value in data.items() if key not in ("runs", "docking_test")}
    route = experiment.route.sampled(0.05).round(9).tolist()
    text = json.dumps([followed, route, experiment.scene.format()])
    return {
        "kind": "guide", "libocc": __version__, "scene": experiment.scene_name, "seed": experiment.options.seed,
        "experiment_sha256": content_hash(text.encode()),
    }


def test_of(experiment: Experiment, runs: list[Run]) -> DockingTest | None:
    if experiment.route.dock is None:
        return None
    return DockingTest(experiment.limits, [run.repetition() for run in runs])


def write_tables(
    folder: ResultFolder, experiment: Experiment, runs: list[Run], test: DockingTest | None
) -> dict[str, Any]:
    data = summarised(experiment, runs, test)
    folder.write("summary.json", json_bytes(data))
    folder.write("metrics.csv", metrics_table(runs))
    if test is not None:
        folder.write("docking_f3499.csv", docking_table(test))
        folder.write("docking_f3499.json", json_bytes(docking_dict(test)))
    return data


def write_pictures(
    folder: ResultFolder, experiment: Experiment, runs: list[Run], test: DockingTest | None, name: str
) -> None:
    from ..guide.pictures import draw_dockings, draw_errors, draw_paths

    def write(file: str, draw: Any, *given: Any) -> None:
        drawn = io.BytesIO()
        draw(drawn, *given)
        folder.write(file, drawn.getvalue())

    # Errors are drawn for the worst run: one that did not arrive, else the one with the largest cross-track error.
    worst = max(runs, key=lambda run: (not run.arrived, run.summary["cross_track_rmse_m"]))
    with progress("drawing", 3) as advance:
        some = [columns_of(folder, run.index, "records") for run in runs[:DRAWN_PATHS]]
        write("paths.png", draw_paths, experiment, some, f"{name}: {len(runs)} runs")
        advance()
        title = f"{name}: run {worst.index}, {worst.summary['outcome']}; bands: 3 sigma"
        columns = (columns_of(folder, worst.index, kind) for kind in ("records", "frames"))
        write("errors.png", draw_errors, *columns, title)
        advance()
        if test is not None:
            write("dockings.png", draw_dockings, test, f"{name}: {test.successes} of {len(runs)} within the limits")
        advance()


def write_animation(folder: ResultFolder, experiment: Experiment, run: Run, name: str) -> None:
    from ..guide.animation import animated, steps_of

    columns = columns_of(folder, run.index, "records")
    with progress("animating", len(steps_of(columns))) as advance:
        folder.write("run.gif", animated(experiment, columns, f"{name}: run {run.index}", advance))


@click.command(short_help="Simulate a vehicle that is guided by lamps, in closed loop.")
@click.argument("experiment")
@click.option("--out", required=True, metavar="FOLDER",
              help="New folder, or that of an interrupted run with the same settings.")
@click.option("--runs", type=click.IntRange(1), help="Number of runs; replaces that of the file.")
@click.option("--seed", type=click.IntRange(0), help="Seed of the first run; replaces that of the file.")
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Number of processes.")
@click.option("--animation/--no-animation", default=True, show_default=True, help="Write run.gif of the first run.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, experiment: str, out: str, runs: int | None, seed: int | None, workers: int, animation: bool,
    as_json: bool,
) -> None:
    """\b
    $ libocc guide short_drive --out drive --no-animation
    2 of 2 runs of 1.47 m: 2 arrived
    ...

    Simulates a vehicle on a route in closed loop: true pose, rendered image, tracker, controller, motion.
    EXPERIMENT is a YAML file (data/experiments/README.md), or the name of one that comes with libocc:
    four_lamps, lamp_failure, narrow_fixed, narrow_pan_tilt, narrow_route, short_drive.

    FOLDER has the records (CSV), metrics (JSON) and trajectories (TUM format, for evo) of each run, the
    metrics of all runs, a docking test after ASTM F3499, pictures and an animation. The same command
    continues an interrupted run; a larger --runs adds runs to the existing ones. Exit code 0: every run
    arrived, and the docking test was passed (if there is a dock and there are enough runs); 1: not so;
    2: bad input; 130: Ctrl-C, finished runs are kept.
    """
    with error_context(experiment):
        path = str(samples.find_experiment(experiment))
    with error_context(path):
        data = changed(read_yaml(path), runs, seed)
        with progress("planning", 1):
            loaded = experiment_of(data, Path(path).parent)
    with error_context(out):
        folder = ResultFolder(out, settings_of(loaded, data))
    jobs = [Job(job_data(data), str(Path(path).parent), i) for i in range(loaded.runs) if not is_done(folder, i)]
    with error_context(path), progress("driving", len(jobs)) as advance:
        interrupted = run_all(folder, jobs, workers, advance)
    done = done_runs(folder, loaded.runs)
    if done:
        with error_context(out):
            test = test_of(loaded, done)
            summary = write_tables(folder, loaded, done, test)
            if not interrupted:
                name = Path(path).stem
                write_pictures(folder, loaded, done, test, name)
                if animation:
                    write_animation(folder, loaded, done[0], name)
        print_json(summary) if as_json else click.echo(text_of(summary, done))
    if interrupted:
        click.echo("interrupted: the same command continues from here", err=True)
        ctx.exit(INTERRUPTED)
    ctx.exit(0 if succeeded(done, test) else 1)


def succeeded(runs: list[Run], test: DockingTest | None) -> bool:
    enough = test is not None and len(runs) >= test.limits.repetitions
    return all(run.arrived for run in runs) and (test is None or not enough or test.passed)
