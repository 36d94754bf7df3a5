# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

import libocc as occ

from ... import samples
from .. import error_context, json_option, overlay_option, print_json, report
from ..files import whole_file


def tag_dict(tag: occ.targets.AprilTag) -> dict[str, Any]:
    return {
        "family": tag.family,
        "id": tag.id,
        "hamming": tag.hamming,
        "decision_margin": tag.decision_margin,
        "centre_px": tag.centre_px.tolist(),
        "corners_px": tag.corners_px.tolist(),
        "covariance_px2": tag.covariance_px2.tolist(),
        "refined": tag.refined,
    }


def tags_text(tags: list[occ.targets.AprilTag], known: set[int]) -> str:
    lines = ["   id      x px      y px  side px  sigma px  margin  map"]
    for tag in tags:
        side = float(((tag.corners_px[1] - tag.corners_px[0]) ** 2).sum() ** 0.5)
        sigma = float((tag.covariance_px2.trace(axis1=1, axis2=2).mean() / 2) ** 0.5)
        lines.append(
            f"{tag.id:5d} {tag.centre_px[0]:9.3f} {tag.centre_px[1]:9.3f} {side:8.1f} {sigma:9.3f}"
            f" {tag.decision_margin:7.1f}  {'yes' if tag.id in known else 'no'}"
        )
    return "\n".join(lines)


@click.command(short_help="Detect AprilTags, and compute the camera's pose from a map of tags.")
@click.argument("image")
@click.option("--map", "scene_name", metavar="SCENE", help="Scene with a list `tags`, for the pose.")
@click.option("--family", default="tag36h11", show_default=True, help="Family of the tags.")
@click.option("--decimate", type=float, default=1.0, show_default=True,
              help="Detect in an image reduced by this factor.")
@json_option
@overlay_option
def command(
    image: str, scene_name: str | None, family: str, decimate: float, as_json: bool, overlay: str | None
) -> None:
    """\b
    $ libocc tags wall_of_tags_1 --map wall_of_tags
       id      x px      y px  side px  sigma px  margin  map
        3   151.454   169.711     64.8     0.029   160.0  yes
    ...

    Lists the AprilTags of IMAGE and, with a map, the camera's pose. Exit code 0: tags were detected and,
    with a map, there is one pose; 1: no tags, or no unique pose; 2: bad input.
    """
    scene = None
    if scene_name is not None:
        with error_context(scene_name):
            scene = samples.load_scene(scene_name)
    with error_context(image):
        pixels = occ.read_image(samples.find_image(image))
        camera = scene.camera if scene else None
        tags = occ.targets.detect_april_tags(pixels, family=family, decimate=decimate, camera=camera)
    known = {tag.id for tag in scene.tags if tag.family == family} if scene else set()
    fix = occ.targets.locate_by_tags(tags, scene) if scene else None
    if overlay is not None:
        from ..tags_plot import draw

        with error_context(overlay), whole_file(overlay) as file:
            draw(file, pixels, tags, known, f"{image}: {len(tags)} tags")
    if as_json:
        found: dict[str, Any] = {"tags": [tag_dict(tag) for tag in tags]}
        print_json(found | ({"fix": report.fix_dict(fix)} if fix else {}))
    else:
        click.echo(tags_text(tags, known))
        if fix is not None:
            click.echo(report.fix_text(fix))
    click.get_current_context().exit(0 if tags and (fix is None or fix.ok) else 1)
