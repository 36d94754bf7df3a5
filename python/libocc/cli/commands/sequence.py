# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

from ... import Trajectory, __version__, samples
from ...yaml_files import suggestion
from .. import INTERRUPTED, Failure, error_context
from ..dataset.frames import Frame, frames_of
from ..dataset.images import FORMATS, check_format
from ..dataset.write import LAYOUTS, missing_frames, write_frames, write_set_files
from ..progress import progress
from ..result_folder import ResultFolder, content_hash


def chosen(frames: list[Frame], wanted: str | None) -> list[Frame]:
    """Selects frames: `N` the first N; `FROM:TO` a range without its end, as in Python."""
    if wanted is None:
        return frames
    parts = (":" + wanted if ":" not in wanted else wanted).split(":")
    try:
        begin, end = (int(part) if part else None for part in parts)
    except ValueError as error:
        raise Failure(f"--frames: must be N or FROM:TO, got {wanted!r}") from error
    if not (taken := frames[begin:end]):
        raise Failure(f"--frames: none of the {len(frames)} frames is in {wanted!r}")
    return taken


@click.command(short_help="Render the images of a moving camera as a data set with ground truth.")
@click.argument("scene")
@click.argument("trajectory")
@click.option("--out", required=True, metavar="FOLDER",
              help="New folder, or that of an interrupted run with the same settings.")
@click.option("--fps", type=click.FloatRange(0, min_open=True), default=30, show_default=True)
@click.option("--format", "image_format", default="png", show_default=True, metavar="|".join(FORMATS))
@click.option("--layout", default="plain", show_default=True, metavar="|".join(LAYOUTS))
@click.option("--frames", "wanted", metavar="N | FROM:TO", help="Only the first N frames, or a range.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the noise.")
@click.option("--noise/--no-noise", default=True, show_default=True)
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Number of processes.")
@click.pass_context
def command(
    ctx: click.Context, scene: str, trajectory: str, out: str, fps: float, image_format: str, layout: str,
    wanted: str | None, seed: int, noise: bool, workers: int,
) -> None:
    """\b
    $ libocc sequence irregular_six walk --out walk --fps 10 --frames 3
    walk: 3 of 3 frames, 3 of them new (png, plain)

    Renders the images of SCENE's camera along TRAJECTORY; each row is rendered from the camera's pose
    during its exposure. TRAJECTORY is a file in TUM format (`t tx ty tz qx qy qz qw`, the camera's pose
    in the world), a YAML file of waypoints, or the name of one that comes with libocc: walk.

    Writes the image of each frame and its ground truth as JSON: pose, velocity, effects with their
    bounds, and for each lamp its centre, rim, masks and electrons. The layouts bop and coco follow those
    benchmarks. The same command continues an interrupted run. The files do not depend on the number of
    workers. Exit code 0: done; 2: bad input; 130: Ctrl-C, finished frames are kept.
    """
    with error_context(scene):
        loaded = samples.load_scene(scene)
    if layout not in LAYOUTS:
        raise Failure(f"--layout: unknown layout {layout!r}; {suggestion(layout, list(LAYOUTS))}")
    made = LAYOUTS[layout](loaded)
    with error_context("--format"):
        check_format(image_format)
    if image_format not in made.formats:
        raise Failure(f"--format: layout {layout} allows {', '.join(made.formats)}, got {image_format}")
    with error_context(trajectory):
        path = Trajectory.load(samples.find_trajectory(trajectory))
        every = frames_of(loaded, path, fps, image_format, seed, noise)
    frames = chosen(every, wanted)
    settings: dict[str, Any] = {
        "kind": "sequence", "libocc": __version__, "scene_sha256": content_hash(loaded.format().encode()),
        "trajectory_sha256": content_hash(path.format().encode()), "fps": fps, "format": image_format,
        "layout": layout, "seed": seed, "noise": noise,
    }
    with error_context(out):
        folder = ResultFolder(out, settings)
        todo = len(missing_frames(folder, made, frames))
        with progress("rendering", todo) as advance:
            interrupted = write_frames(folder, made, frames, workers, advance)
        left = len(missing_frames(folder, made, frames))
        with progress("gathering", len(frames) - left) as advance:
            write_set_files(folder, made, image_format, advance)
    click.echo(
        f"{out}: {len(frames) - left} of {len(frames)} frames, {todo - left} of them new "
        f"({image_format}, {layout})"
    )
    if interrupted:
        click.echo("interrupted: the same command continues from here", err=True)
        ctx.exit(INTERRUPTED)
