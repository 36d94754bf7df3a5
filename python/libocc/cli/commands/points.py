# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

import libocc as occ

from ... import samples
from .. import error_context, json_option, print_json
from ..files import whole_file

MESHES = (".obj", ".ply", ".stl")


def object_of(file_or_name: str) -> occ.objects.Object:
    """Object from a file or by its name, or the detectable points of a mesh."""
    if not file_or_name.lower().endswith(MESHES):
        return samples.load_object(file_or_name)
    points = occ.objects.detectable_points(*occ.objects.read_mesh(file_or_name))
    if not points:
        raise ValueError("has no vertex at which long sharp edges meet")
    return occ.objects.Object(name=file_or_name, points=[found.point for found in points])


def rows_of(thing: occ.objects.Object, value: occ.objects.LocalisationValue) -> list[dict[str, Any]]:
    from ..object_plot import order_of

    return [
        {
            "id": thing.points[i].id,
            "label": thing.points[i].label,
            "position_m": thing.points[i].position_m.tolist(),
            "seen": value.points[i].seen,
            "needed": value.points[i].needed,
            "growth": value.points[i].growth,
        }
        for i in order_of(value)
    ]


@click.command(short_help="Compute the value of each point of an object for its pose.")
@click.argument("object", metavar="OBJECT|MESH")
@click.option("--camera", "scene", required=True, metavar="SCENE", help="Scene with the camera.")
@click.option("--distance", "distances", type=float, multiple=True, metavar="M",
              help="Distance of the views; repeatable  [default: 5].")
@click.option("--directions", type=int, default=100, show_default=True, help="Number of viewing directions.")
@click.option("--sigma-px", type=float, default=0.5, show_default=True, help="Sigma of a point in the image.")
@click.option("--out", metavar="FILE.yaml", help="Write the object, for instance that of a mesh.")
@click.option("--plot", metavar="FILE.png", help="Draw the points and their values.")
@json_option
def command(
    object: str,
    scene: str,
    distances: tuple[float, ...],
    directions: int,
    sigma_px: float,
    out: str | None,
    plot: str | None,
    as_json: bool,
) -> None:
    """\b
    $ libocc points beacon --camera parking
    94 % of the views determine the pose, the camera's position to 70.9 mm (median bound)
      id  seen %  needed %  growth  label
       6     100         6   1.238  arm end
       9      43         2   1.193  foot 2
    ...

    Evaluates the points of OBJECT over views from all directions. OBJECT is a YAML file or the name of an
    object that comes with libocc; a MESH (OBJ, PLY or STL) gives the vertices where long sharp edges
    meet. For each point: the share of views that show it, the share of views that have no pose without
    it, and the factor by which the pose's sigmas grow without it in the other views. The most valuable
    points are printed first.
    """
    with error_context(scene):
        camera = samples.load_scene(scene).camera
    with error_context(object):
        try:
            thing = object_of(object)
        except ImportError as error:
            raise ValueError(str(error)) from error
    with error_context("points"):
        views = occ.objects.views_around(thing, list(distances or (5.0,)), directions)
        value = occ.objects.localisation_value(thing, camera, views, sigma_px)
    if out is not None:
        with error_context(out):
            thing.save(out)
    if plot is not None:
        from ..object_plot import draw

        with error_context(plot), whole_file(plot) as file:
            draw(file, thing, value, f"{thing.name}: {100 * value.determined:.0f} % of the views have a pose")
    rows = rows_of(thing, value)
    if as_json:
        bound = {"determined": value.determined, "sigma_m": value.sigma_m, "sigma_rad": value.sigma_rad}
        print_json({"object": thing.name, **bound, "points": rows})
        return
    click.echo(
        f"{100 * value.determined:.0f} % of the views determine the pose, the camera's position to "
        f"{1e3 * value.sigma_m:.1f} mm (median bound)"
    )
    click.echo("  id  seen %  needed %  growth  label")
    for row in rows:
        shares = f"{100 * row['seen']:7.0f} {100 * row['needed']:9.0f}"
        click.echo(f"{row['id']:4d} {shares} {row['growth']:7.3f}  {row['label']}".rstrip())
