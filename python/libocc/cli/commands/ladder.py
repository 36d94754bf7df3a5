# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import click
import numpy as np

from ... import samples
from ..._core import LampShape
from ...bench import missing_ladder_steps
from .. import INTERRUPTED, Failure, error_context, json_option, print_json
from ..build import missing_note, require_in_build
from ..files import whole_file
from ..ladder import costs as cost_table, output
from ..ladder.experiment import Experiment, noisier
from ..ladder.figures import Row, advice, rows_of
from ..ladder.measure import Run, Rung, own_rungs, peer_rungs, run
from ..ladder.peers import poselib_peers
from ..progress import progress

PAGE = 120  # columns of text that is not written to a terminal
COST_FRAMES = 8  # max frames of each problem of the cost fit; limits its time


def experiment_of(
    scene: str, lamps: int | None, range_m: float, tilt_deg: float, noise: float,
    read_noise_e: float | None, gain_dn_per_e: float | None, seed: int,
) -> Experiment:
    with error_context(scene):
        loaded = samples.load_scene(scene)
        if lamps is not None:
            if lamps > len(loaded.lamps):
                raise ValueError(f"has {len(loaded.lamps)} lamps, got --lamps {lamps}")
            loaded = loaded.replace(lamps=loaded.lamps[:lamps])
        if len(loaded.lamps) < 3 and not any(lamp.shape == LampShape.rectangle for lamp in loaded.lamps):
            raise ValueError(f"a pose requires three lamps or a rectangle, got {len(loaded.lamps)} without corners")
        sensor = noisier(loaded.sensor, noise)
        if read_noise_e is not None:
            sensor = sensor.replace(read_noise_e=read_noise_e)
        if gain_dn_per_e is not None:
            sensor = sensor.replace(gain_dn_per_e=gain_dn_per_e)
        experiment = Experiment(loaded.replace(sensor=sensor), range_m, tilt_deg, seed)
        experiment.pose(0)
    return experiment


def chosen_rungs(wanted: tuple[str, ...]) -> tuple[list[Rung], list[str]]:
    """Rungs with the given names (all if none are given), and the peer packages that are missing."""
    peers = poselib_peers()
    rungs = {rung.key: rung for rung in own_rungs() + peer_rungs(peers)}
    require_in_build("--rung", wanted, missing_ladder_steps())
    for name in wanted:
        if name not in rungs:
            raise Failure(f"--rung: {name!r} is not one of {', '.join(rungs)}")
    missing = [] if peers or wanted else ["poselib"]
    return [rung for key, rung in rungs.items() if not wanted or key in wanted], missing


def check_outputs(csv_path: str | None, plot_path: str | None, costs_path: str | None) -> None:
    """Checks before the measurement that the output files can be written."""
    for path in (csv_path, plot_path, costs_path):
        if path is None:
            continue
        if not Path(path).resolve().parent.is_dir():
            raise Failure(f"{path}: cannot be written: its folder does not exist")
        if Path(path).is_dir():
            raise Failure(f"{path}: cannot be written: it is a folder")
    if plot_path is not None:
        from ..ladder.plot import ending_of

        with error_context(plot_path):
            ending_of(plot_path)


def write_plot(path: str, rows: list[Row], note: str) -> None:
    from ..ladder import plot

    absent = [row for row in rows if row not in plot.drawable(rows)]
    if absent:
        note += f"; not drawn because never correct: {', '.join(row.name for row in absent)}"
    with error_context(path), whole_file(path) as file:
        plot.draw(file, plot.ending_of(path), rows, "Accuracy against computing time", note)


def write_costs(path: str, experiment: Experiment, frames: int) -> None:
    frames = min(frames, COST_FRAMES)
    with error_context(path):
        with progress("measuring", frames * len(cost_table.problems(experiment))) as advance:
            measured = cost_table.measure(experiment, frames, 1e-3, advance)
        measured.save(path)
    click.echo(f"costs of the refinement's rungs are in {path}", err=True)


def headline(settings: dict[str, Any], result: Run) -> str:
    lamps = sorted(set(result.lamps))
    count = f"{lamps[0]}" if len(lamps) == 1 else f"{lamps[0]} to {lamps[-1]}"
    noise = "" if settings["noise"] == 1 else f", noise x {settings['noise']:g}"
    return (
        f"{settings['scene']}: {count} lamp{'' if count == '1' else 's'} at {settings['range_m']:g} m, tilt "
        f"{settings['tilt_deg']:g} deg{noise}, {result.frames} frame"
        + ("" if result.frames == 1 else "s")
    )


def verdict(best: Row | None, target_mm: float | None, budget_ms: float | None) -> str:
    asked = [f"{target_mm:g} mm"] if target_mm is not None else []
    asked += [f"{budget_ms:g} ms"] if budget_ms is not None else []
    if best is None:
        return f"no rung meets {' in '.join(asked)}"
    reached = f"{1e3 * best.position_rmse_m:.3g} mm in {1e3 * best.time_median_s:.3g} ms"
    return f"recommended for {' in '.join(asked)}: {best.name}, {reached}"


@click.command(short_help="Measure accuracy against computing time.")
@click.argument("scene", default="irregular_six")
@click.option("--lamps", type=click.IntRange(1), metavar="N",
              help="Use only the first N lamps of the scene; fewer than three need a rectangle.")
@click.option("--range", "range_m", type=click.FloatRange(0, min_open=True), default=2.5,
              show_default=True, help="Distance of the camera from the lamps' centroid [m].")
@click.option("--tilt-deg", type=click.FloatRange(0, 89), default=10, show_default=True,
              help="Angle of the view to the lamps' normal; azimuth and roll are random.")
@click.option("--noise", type=click.FloatRange(0, min_open=True), default=1, show_default=True,
              help="Factor of the sensor's noise, at the same brightness.")
@click.option("--read-noise-e", type=click.FloatRange(0),
              help="Read noise [electrons]; replaces that of the scene.")
@click.option("--gain-dn-per-e", type=click.FloatRange(0, min_open=True),
              help="Gain [grey levels per electron]; replaces that of the scene.")
@click.option("--frames", type=click.IntRange(1), default=200, show_default=True,
              help="Number of images, each with its own pose and noise; 200 take about 5 s.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True,
              help="Seed of poses and noise.")
@click.option("--rung", "wanted", multiple=True, metavar="NAME", help="Use only this rung; repeatable.")
@click.option("--min-time-us", type=click.FloatRange(0, min_open=True), default=50, show_default=True,
              help="Minimum time for which each rung is called repeatedly.")
@click.option("--target-mm", type=click.FloatRange(0, min_open=True),
              help="Recommend the fastest rung within this position error.")
@click.option("--budget-ms", type=click.FloatRange(0, min_open=True),
              help="Recommend the most accurate rung within this time.")
@json_option
@click.option("--csv", "csv_path", metavar="FILE.csv", help="Write the table.")
@click.option("--plot", "plot_path", metavar="FILE.png|svg", help="Draw time against error.")
@click.option("--costs", "costs_path", metavar="FILE.yaml",
              help="Also measure the cost table for locate --costs.")
@click.pass_context
def command(
    ctx: click.Context, scene: str, lamps: int | None, range_m: float, tilt_deg: float, noise: float,
    read_noise_e: float | None, gain_dn_per_e: float | None, frames: int, seed: int,
    wanted: tuple[str, ...], min_time_us: float, target_mm: float | None, budget_ms: float | None,
    as_json: bool, csv_path: str | None, plot_path: str | None, costs_path: str | None,
) -> None:
    """\b
    $ libocc ladder --frames 5 --rung solve_pose --rung rims --rung direct
    irregular_six: 6 lamps at 2.5 m, tilt 10 deg, 5 frames
    ...

    Runs all pose methods on the same simulated images of SCENE, a YAML file or the name of a scene that
    comes with libocc. The lamps are identified. Methods: closed-form solvers on the lamps' centroids, the
    refinement by points, centres, rims and all pixels, methods of the literature that use the shapes of
    luminaires, and, if installed, the solvers of OpenCV and PoseLib. Of one rectangle, those that use its
    corners or its rim remain. For each method the table has the time, the error, its ratio to the
    Cramer-Rao bound, and the rates of failures (no answer) and outliers (error above 10 times the bound,
    including the bias of points). Run it on an idle machine; more frames are more precise. Ctrl-C ends
    the run and prints the results so far. Exit code 0: measured; 1: no rung meets --target-mm and
    --budget-ms; 2: bad input.
    """
    check_outputs(csv_path, plot_path, costs_path)
    experiment = experiment_of(
        scene, lamps, range_m, tilt_deg, noise, read_noise_e, gain_dn_per_e, seed
    )
    rungs, missing = chosen_rungs(wanted)
    for package in missing:
        click.echo(f"not installed, not used: {package} (pip install 'libocc[peers]')", err=True)
    if not wanted:
        click.echo(missing_note(missing_ladder_steps()), nl=False, err=True)
    with error_context(scene), progress("measuring", frames) as advance:
        result = run(experiment, rungs, frames, 1e-6 * min_time_us, advance)
    rows = rows_of(result)
    if not rows:
        if result.interrupted:
            ctx.exit(INTERRUPTED)
        raise Failure(f"{scene}: too few lamps were detected, or no selected rung accepts their number")
    settings = {
        "scene": samples.find_scene(scene).stem, "lamps": len(experiment.scene.lamps),
        "range_m": range_m, "tilt_deg": tilt_deg, "noise": noise, "seed": seed,
        "read_noise_e": experiment.scene.sensor.read_noise_e,
        "gain_dn_per_e": experiment.scene.sensor.gain_dn_per_e,
    }
    detect_s = float(np.median(result.detect_s))
    if csv_path is not None:
        with error_context(csv_path), whole_file(csv_path) as file:
            file.write(output.csv_bytes(rows))
    if plot_path is not None:
        note = f"{headline(settings, result)}; without detection, {1e3 * detect_s:.2g} ms"
        write_plot(plot_path, rows, note)
    asked = target_mm is not None or budget_ms is not None
    best = advice(
        rows, None if target_mm is None else 1e-3 * target_mm,
        None if budget_ms is None else 1e-3 * budget_ms,
    )
    if as_json:
        data = output.plain(settings, result, rows, detect_s)
        print_json({**data, "missing": missing, "advice": best.name if asked and best else None})
    else:
        from rich.console import Console

        click.echo(headline(settings, result) + (" before Ctrl-C" if result.interrupted else ""))
        console = Console() if Console().is_terminal else Console(width=PAGE)
        console.print(output.table(rows))
        click.echo(f"detection, not included above: {1e3 * detect_s:.2g} ms")
        console.print(output.note(rows), style="dim", highlight=False)
        if asked:
            click.echo(verdict(best, target_mm, budget_ms))
    if result.interrupted:
        ctx.exit(INTERRUPTED)
    if costs_path is not None:
        write_costs(costs_path, experiment, frames)
    if asked and best is None:
        ctx.exit(1)
