# SPDX-License-Identifier: Apache-2.0
import importlib

import click

KINDS = ("camera", "panorama", "lamps", "network")


class Kinds(click.Group):
    """Imports a kind of calibration when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(KINDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in KINDS:
            return None
        command: click.Command = importlib.import_module(f"libocc.cli.commands.calibrate_{cmd_name}").command
        return command


@click.group(cls=Kinds, short_help="Calibrate cameras, survey lamps, adjust networks.")
def command() -> None:
    """\b
    $ libocc calibrate network panorama --out calibrated
    sigma0 ...

    Calibrates cameras, surveys lamps and adjusts any photogrammetric network.

    Each kind writes a folder with report.html, result.json, camera files for libocc, OpenCV and ROS,
    and points with their covariance as CSV and PLY.
    """
