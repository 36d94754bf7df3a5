# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

import libocc as occ

from ... import samples
from .. import error_context, json_option, print_json
from ..pose_options import pose_options
from ..poses import facing_pose

UNITS = ((1e-3, "us", 1e6), (1.0, "ms", 1e3), (float("inf"), "s", 1.0))


@click.command(short_help="List the effects of a scene, their influence and their computing time.")
@click.argument("scene")
@pose_options
@click.option("--noise/--no-noise", default=True, show_default=True)
@click.option(
    "--repetitions",
    type=click.IntRange(0),
    default=9,
    show_default=True,
    help="Images per time measurement; 0: no times.",
)
@json_option
def command(scene: str, cam_from_world: Any, noise: bool, repetitions: int, as_json: bool) -> None:
    """\b
    $ libocc explain irregular_six --repetitions 0
    camera at 2.000 2.100 -1.342 m, looks along 0.000 0.000 1.000
    effect           use   rendered  grey levels        px   position      cost  why
    extent           on    yes               255     0.103    18.9 mm         -  on
    light_gradient   on    yes              3.56     0.084    15.4 mm         -  on
    ...

    Lists every effect that libocc can simulate: its setting in SCENE, whether an image contains it, and
    upper bounds of the changes when it is left out: of any pixel, of any lamp's centroid, and of a
    position solved from the centroids. For noise these are standard deviations. The column `cost` is the
    measured time that the effect takes per image. Without --position or --pose the camera faces the
    lamps from a position where all of them are in view.
    """
    with error_context(scene):
        lamps = samples.load_scene(scene)
        pose = facing_pose(lamps) if cam_from_world is None else cam_from_world
        explained = occ.explain(lamps, pose, noise=noise, repetitions=repetitions)
    if as_json:
        print_json(
            {
                "cam_from_world": pose.tolist(),
                "render_s": explained.render_s if repetitions else None,
                "effects": [effect_dict(effect, bool(repetitions)) for effect in explained.effects],
            }
        )
        return
    axis, position = pose[2, :3], -pose[:3, :3].T @ pose[:3, 3]
    click.echo(f"camera at {numbers(position)} m, looks along {numbers(axis)}")
    click.echo("effect           use   rendered  grey levels        px   position      cost  why")
    for effect in explained.effects:
        click.echo(line(effect, bool(repetitions)))
    if repetitions:
        click.echo(f"one image: {duration(explained.render_s)}")


def numbers(values: Any) -> str:
    return " ".join(f"{value:.3f}" for value in values)


def duration(seconds: float) -> str:
    for below, unit, factor in UNITS:
        if seconds < below:
            break
    return f"{seconds * factor:.3g} {unit}"


def line(effect: Any, timed: bool) -> str:
    """One line of text; an effect that the scene does not need has no bounds."""
    use = {"automatic": "auto"}.get(effect.use.name, effect.use.name)
    start = f"{effect.effect:15}  {use:4}  {'yes' if effect.applied else 'no':8}"
    if not effect.called_for:
        return f"{start}  {'-':>11}  {'-':>8}  {'-':>9}  {'-':>8}  {effect.reason}"
    cost = duration(max(0.0, effect.cost_s)) if timed else "-"
    place = f"{effect.position_bound_m * 1e3:.3g} mm"
    bounds = f"{effect.bound_dn:11.3g}  {effect.bound_px:8.3g}  {place:>9}"
    return f"{start}  {bounds}  {cost:>8}  {effect.reason}"


def effect_dict(effect: Any, timed: bool) -> dict[str, Any]:
    names = ("effect", "called_for", "applied", "bound_dn", "bound_px", "position_bound_m", "reason")
    data = {name: getattr(effect, name) for name in names}
    return {**data, "use": effect.use.name, "cost_s": effect.cost_s if timed else None}
