# SPDX-License-Identifier: Apache-2.0
import csv
from pathlib import Path
from typing import Any

import click
import numpy as np
import yaml

import libocc as occ

from ...yaml_files import parse_yaml, yaml_text
from .. import Failure, error_context, file_names_in_errors, json_option, print_json
from ..exif import camera_tags, exposures_of_series
from ..files import whole_file
from ..progress import progress

COLOURS = ("red", "green", "blue")  # order of channels of read_image()


def exposures_of(given: str) -> list[float] | dict[str, float]:
    """Parses comma-separated numbers, or reads a YAML list, or a YAML mapping or CSV file of image names and times."""
    path = Path(given)
    if path.suffix.lower() in (".yaml", ".yml"):
        data = parse_yaml(yaml_text(path))
        if isinstance(data, dict):
            return {str(name): number(time, f"exposure of {name}") for name, time in data.items()}
        if isinstance(data, list):
            return [number(time, f"exposures[{i}]") for i, time in enumerate(data)]
        raise ValueError("must be a list of times or a mapping from image names to times")
    if path.suffix.lower() == ".csv":
        rows = [row for row in csv.reader(path.read_text().splitlines()) if row]
        if rows and rows[0][-1].strip() == "exposure_s":
            rows = rows[1:]
        if any(len(row) != 2 for row in rows):
            raise ValueError("each line must be IMAGE,SECONDS")
        return {row[0].strip(): number(row[1], f"exposure of {row[0].strip()}") for row in rows}
    return [number(part, "--exposures") for part in given.split(",")]


def number(value: Any, name: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number of seconds, got {value!r}") from None


def in_order(times: list[float] | dict[str, float], images: tuple[str, ...]) -> list[float]:
    """Exposure time of each image, by name if the times have names."""
    if isinstance(times, list):
        return times
    ordered = []
    for image in images:
        found = [time for name, time in times.items() if name in (image, Path(image).name)]
        if len(found) != 1:
            raise ValueError(f"has {len(found)} times for {image}")
        ordered.append(found[0])
    return ordered


def times_of(given: str | None, images: tuple[str, ...]) -> list[float]:
    if given is not None:
        with error_context("--exposures" if "," in given else given):
            return in_order(exposures_of(given), images)
    tags = []
    for image in images:
        with error_context(image):
            tags.append(camera_tags(image))
    try:
        return exposures_of_series(images, tags)
    except ValueError as error:
        raise Failure(str(error)) from error


def sensor_section(response: occ.photometry.RecoveredResponse, samples: int) -> dict[str, Any]:
    """Keys for the section `sensor:` of a scene file."""
    channels = response.channels
    bits = int(np.log2(channels[0].full_scale_dn + 1).round())
    section: dict[str, Any] = {"bit_depth": bits, "black_level_dn": channels[0].black_level_dn}
    tables = [
        {"response": "table", "response_table": [round(value, 9) for value in channel.table(samples)]}
        for channel in channels
    ]
    if len(tables) == 1:
        return {**section, **tables[0]}
    return {**section, "channels": dict(zip(COLOURS, tables))}


def text_of(response: occ.photometry.RecoveredResponse, samples: int) -> str:
    head = "# SPDX-License-Identifier: Apache-2.0\n"
    head += "# Written by `libocc response`: keys for the section `sensor:` of a scene file."
    if len(response.channels) == 3:
        head += "\n# A sensor with `channels` also requires the key `mosaic`, which images do not determine."
    body: str = yaml.safe_dump(
        {"sensor": sensor_section(response, samples)}, sort_keys=False, width=100, default_flow_style=None
    )
    return f"{head}\n{body}"


def summary(response: occ.photometry.RecoveredResponse) -> dict[str, Any]:
    return {
        "status": response.status.name,
        "message": response.message,
        "channels": [
            {
                "lowest_dn": channel.lowest_dn, "highest_dn": channel.highest_dn,
                "chi2": channel.chi2, "dof": channel.dof, "variance_factor": channel.variance_factor,
                "projected": channel.projected, "coefficients": channel.coefficients,
                "median_sigma": float(np.median(channel.sigma[seen(channel)])),
            }
            for channel in response.channels
        ],
    }


def seen(channel: occ.photometry.ChannelResponse) -> Any:
    return (channel.level_dn >= channel.lowest_dn) & (channel.level_dn <= channel.highest_dn)


def sentence(channel: dict[str, Any], name: str) -> str:
    return (
        f"{name}levels {channel['lowest_dn']:.0f} to {channel['highest_dn']:.0f} observed, "
        f"sigma of ln(light) {channel['median_sigma']:.2g}, chi2 {channel['chi2']:.0f} of {channel['dof']}"
    )


def with_depth(images: list[Any], bit_depth: int | None) -> int:
    if bit_depth is not None:
        return bit_depth
    if any(image.dtype == np.uint16 for image in images):
        raise Failure("--bit-depth must be given for 16-bit images")
    return 0


@click.command(short_help="Recover a camera's response curve from an exposure series.")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--exposures", metavar="T,T,...|FILE.yaml|FILE.csv",
              help="Exposure times [s], in the order of the images or by name; default: EXIF data.")
@click.option("--method", type=click.Choice([*occ.photometry.ResponseMethod.__members__]), default="levels",
              show_default=True, help="Free curve (levels), or a basis of few functions for two or three exposures.")
@click.option("--black-level-dn", type=float, default=0, show_default=True, help="Stored level without light.")
@click.option("--bit-depth", type=click.IntRange(8, 16), help="Bit depth of the levels in 16-bit images.")
@click.option("--basis-functions", type=click.IntRange(1, 8), default=3, show_default=True)
@click.option("--samples", type=click.IntRange(16, 65536), default=256, show_default=True,
              help="Number of entries of the response table.")
@click.option("--out", default="response.yaml", show_default=True, metavar="FILE.yaml")
@click.option("--plot", "plot_path", metavar="FILE.png", help="Draw curve, sigmas and residuals.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, images: tuple[str, ...], exposures: str | None, method: str, black_level_dn: float,
    bit_depth: int | None, basis_functions: int, samples: int, out: str, plot_path: str | None, as_json: bool,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --exposure-s 4e-6 --out a.png
    ...
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --exposure-s 8e-6 --out b.png
    ...
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --exposure-s 2e-5 --out c.png
    ...
    $ libocc response a.png b.png c.png --exposures 4e-6,8e-6,2e-5 --black-level-dn 2
    levels ...

    Recovers the response curve of the camera from IMAGEs of one static scene with several exposure
    times, by Debevec and Malik's method weighted with the observed pixel noise, and writes it as keys
    for the section `sensor:` of a scene file. Only the ratios of the times are used. Colour images give
    one curve per channel. --exposures is a list of times, a YAML list, or a YAML mapping or CSV file of
    image names and times. Without it the times are read from the EXIF data, and f-number and ISO speed
    must be constant. Exit code 0: recovered; 1: the images do not determine the curve; 2: bad input.
    """
    times = times_of(exposures, images)
    pixels = []
    with progress("reading", len(images)) as advance:
        for image in images:
            with error_context(image):
                pixels.append(occ.read_image(image))
            advance()
    depth = with_depth(pixels, bit_depth)
    with file_names_in_errors(images):
        response = occ.photometry.recover_response(
            pixels, times, method=occ.photometry.ResponseMethod[method], black_level_dn=black_level_dn,
            bit_depth=depth, basis_functions=basis_functions,
        )
    data = summary(response)
    if as_json:
        print_json(data)
    else:
        names = [f"{colour}: " for colour in COLOURS] if len(data["channels"]) > 1 else [""]
        for channel, name in zip(data["channels"], names):
            click.echo(sentence(channel, name))
    if response.message:
        click.echo(f"{response.status.name}: {response.message}", err=True)
    if not response.ok:
        ctx.exit(1)
    with error_context(out), whole_file(out) as file:
        file.write(text_of(response, samples).encode())
    if plot_path is not None:
        from ..response_plot import draw

        with error_context(plot_path), whole_file(plot_path) as file:
            draw(file, response, times)
