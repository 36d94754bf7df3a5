# SPDX-License-Identifier: Apache-2.0
"""The command line: `libocc demo | simulate | sequence | sweep | detect | identify | locate | map | ...`.

Each command is a module in `commands/` that is imported when the command is called, which keeps start-up short.
"""

import importlib
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import IO, Any

import click

from .._core import __version__
from .interrupts import INTERRUPTED as INTERRUPTED, interruptible

COMMANDS = (
    "demo",
    "samples",
    "new-scene",
    "schema",
    "targets",
    "simulate",
    "explain",
    "sequence",
    "sweep",
    "map",
    "detect",
    "identify",
    "recognise",
    "points",
    "locate",
    "position",
    "decode",
    "tags",
    "ladder",
    "hard-cases",
    "trust",
    "response",
    "light",
    "calibrate",
    "import-network",
    "survey",
    "measure",
    "row-time",
    "guide",
)


class Failure(click.ClickException):
    """Error of the command line: prints one line on stderr; exit code 2."""

    exit_code = 2

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo("error: " + " ".join(self.message.split()), file=file, err=file is None)


@contextmanager
def error_context(path: object) -> Iterator[None]:
    """Turns errors of the block into a Failure whose message starts with `path`."""
    try:
        yield
    except (OSError, ValueError, TypeError) as error:
        text = str(error)
        raise Failure(text if text.startswith(str(path)) else f"{path}: {text}") from error


@contextmanager
def file_names_in_errors(images: Sequence[str]) -> Iterator[None]:
    """Replaces `images[N]` in error messages by the file name."""
    try:
        yield
    except ValueError as error:
        raise Failure(re.sub(r"images\[(\d+)\]", lambda found: images[int(found[1])], str(error))) from error


class Commands(click.Group):
    """Imports a command when it is called. Ctrl-C ends it with exit code 130."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with interruptible():
                return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            ctx.exit(INTERRUPTED)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"libocc.cli.commands.{cmd_name.replace('-', '_')}")
        command: click.Command = module.command
        return command


@click.command(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def main() -> None:
    """Computes a camera's position from an image of lamps.

    \b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --seed 1 --out room.png
    $ libocc locate room.png irregular_six
    """


def print_json(data: Any) -> None:
    """Prints plain data as JSON."""
    import json

    click.echo(json.dumps(data, indent=1))


json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")
overlay_option = click.option(
    "--overlay", type=click.Path(dir_okay=False), metavar="FILE.png", help="Write an annotated picture."
)
