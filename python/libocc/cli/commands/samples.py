# SPDX-License-Identifier: Apache-2.0
import click

from ...samples import FOLDER, KINDS, Kind, description
from .. import Failure, json_option, print_json

USES = {
    "scene": "libocc simulate NAME --position 2 2 0.5",
    "image": "libocc locate NAME SCENE",
    "object": "libocc points NAME",
    "trajectory": "libocc sequence SCENE NAME --out FOLDER",
    "sweep": "libocc sweep NAME --out FOLDER",
    "experiment": "libocc guide NAME --out FOLDER",
    "network": "libocc calibrate network NAME --out FOLDER",
}


def plural(kind: Kind) -> str:
    return "trajectories" if kind.name == "trajectory" else f"{kind.name}s"


@click.command(short_help="List the scenes, images and other samples that come with libocc.")
@json_option
def command(as_json: bool) -> None:
    """\b
    $ libocc samples
    scenes: libocc simulate NAME --position 2 2 0.5
      coded_four          The square of four lamps, each with its own blink frequency.
    ...

    Lists the samples that come with libocc, each with one sentence. Every command that reads a scene or
    another file of these kinds accepts the name of a sample in place of a file. The hard cases are listed
    by libocc hard-cases.
    """
    found = {kind.name: kind.paths() for kind in KINDS}
    if not any(found.values()):
        raise Failure(f"libocc was installed without its samples: {FOLDER} has none")
    if as_json:
        print_json(
            [
                {"kind": kind.name, "name": name, "path": str(path), "description": description(kind, path)}
                for kind in KINDS
                for name, path in found[kind.name].items()
            ]
        )
        return
    width = max(len(name) for paths in found.values() for name in paths)
    for kind in KINDS:
        click.echo(f"{plural(kind)}: {USES[kind.name]}")
        for name, path in found[kind.name].items():
            click.echo(f"  {name:{width}}  {description(kind, path)}")
