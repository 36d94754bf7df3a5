# SPDX-License-Identifier: Apache-2.0
import json

import click

from ...samples import FOLDER
from .. import Failure, error_context
from ..files import whole_file


def text_of(kind: str) -> str:
    """JSON Schema of a kind of file. Raises: Failure for an unknown kind."""
    from ...yaml_files import suggestion
    from ..schemas import SCHEMAS

    if kind not in SCHEMAS:
        raise Failure(f"unknown kind of file {kind!r}; {suggestion(kind, list(SCHEMAS))}")
    return json.dumps(SCHEMAS[kind], indent=1, ensure_ascii=False) + "\n"


@click.command(short_help="Print the JSON Schema of a kind of YAML file, for editors.")
@click.argument("kind", required=False)
@click.option("--out", metavar="FILE.json", help="Write the schema to a file.")
def command(kind: str | None, out: str | None) -> None:
    """\b
    $ libocc schema scene --out scene.schema.json
    scene.schema.json: JSON Schema of scene files

    Prints the JSON Schema of a kind of YAML file; without KIND, lists the kinds and the schema files that
    come with libocc. With this first line in a YAML file, an editor with the YAML language server (in
    VS Code: the extension YAML) completes keys, shows their meaning and marks misspelt ones:

    \b
        # yaml-language-server: $schema=scene.schema.json

    A schema checks keys, types and names of choices. libocc also checks ranges, ids and rules on several
    keys when it reads the file.
    """
    if kind is None:
        if out is not None:
            raise Failure("--out: needs the kind of file, such as libocc schema scene --out scene.schema.json")
        from ..schemas import SCHEMAS

        for name in SCHEMAS:
            click.echo(f"{name:10}  {FOLDER / 'schemas' / f'{name}.schema.json'}")
        return
    text = text_of(kind)
    if out is None:
        click.echo(text, nl=False)
        return
    with error_context(out), whole_file(out) as file:
        file.write(text.encode())
    click.echo(f"{out}: JSON Schema of {kind} files")
