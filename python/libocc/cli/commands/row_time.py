# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

import libocc as occ

from ... import samples
from .. import Failure, error_context, json_option, print_json
from ..row_time import NoStripes, Stripes, combined, stripes_of


def stripes_dict(image: str, stripes: Stripes, frequency_hz: float) -> dict[str, Any]:
    row_s, sigma_s = stripes.row_time_s(frequency_hz)
    return {
        "image": image, "row_time_s": row_s, "sigma_s": sigma_s, "period_px": stripes.period_px,
        "periods": stripes.periods, "contrast": stripes.contrast, "readout": stripes.readout, "place": stripes.place,
    }


def line(data: dict[str, Any]) -> str:
    contrast = "" if data["contrast"] is None else f", contrast {100 * data['contrast']:.1f} %"
    where = "on a lamp" if data["place"] == "lamp" else "across the picture"
    stripes = f"{data['periods']:.1f} periods of {data['period_px']:.2f} {data['readout']} {where}{contrast}"
    return f"{data['image']}: {stripes}; row time {data['row_time_s']:.5g} +- {data['sigma_s']:.2g} s"


@click.command(short_help="Measure the row time of a rolling shutter with a lamp of known frequency.")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--frequency-hz", type=click.FloatRange(1, 1e5), required=True,
              help="Frequency of the light: 100 for lamps on mains of 50 Hz, 120 for mains of 60 Hz.")
@click.option("--frequency-sigma-hz", type=click.FloatRange(0), default=0.0, show_default=True,
              help="Standard deviation of that frequency.")
@click.option("--readout", type=click.Choice(["rows", "columns", "unknown"]), default="unknown", show_default=True,
              help="Direction of the shutter; columns if the pixels were rotated.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, images: tuple[str, ...], frequency_hz: float, frequency_sigma_hz: float, readout: str,
    as_json: bool,
) -> None:
    """\b
    $ libocc simulate coded_four --position 1 1 2.2 --out lamp.png
    ...
    $ libocc row-time lamp.png --frequency-hz 2000
    lamp.png: ...

    Measures `sensor.row_time_s` of a camera with a rolling shutter from the stripes in IMAGEs, which are
    combined. Either an evenly lit white surface fills the picture and the light flickers with mains
    (2 periods and more: 20 ms of rows at 100 Hz), or a lamp that blinks faster has stripes on its image;
    then all other lamps are covered. Expose for less than half a period, without saturation. Several
    pictures of different places show whether the surface causes an error.

    Exit code 0: measured; 1: no stripes are visible, or the images contradict each other; 2: bad input.
    """
    if frequency_hz != frequency_hz or not frequency_sigma_hz < frequency_hz:
        raise Failure("--frequency-hz must be a number, and --frequency-sigma-hz smaller")
    found: list[tuple[str, Stripes]] = []
    sizes: list[tuple[int, int]] = []
    problems: list[str] = []
    for image in images:
        with error_context(image):
            pixels = occ.read_image(samples.find_image(image))
        try:
            found.append((image, stripes_of(pixels, frequency_hz, readout)))
            sizes.append(pixels.shape[:2])
        except NoStripes as error:
            problems.append(f"{image}: {error}")
    data = [stripes_dict(image, stripes, frequency_hz) for image, stripes in found]
    for each in data:
        each["contrast"] = each["contrast"] if each["contrast"] == each["contrast"] else None
    result: dict[str, Any] = {"images": data, "problems": problems}
    if found:
        result.update(combined([stripes for _, stripes in found], frequency_hz, frequency_sigma_hz))
    ok = bool(found) and result["consistent"]
    if as_json:
        print_json({"ok": ok, **result})
    else:
        for each in data:
            click.echo(line(each))
        if ok:
            sigma_s = result["sigma_s"]
            count = sizes[0][0 if result["readout"] == "rows" else 1]
            all_ms = 1e3 * count * result["row_time_s"]
            click.echo(
                f"row_time_s: {result['row_time_s']:.5g}  # +- {sigma_s:.2g} s; for `sensor` of a scene; "
                f"{count} {result['readout']} in {all_ms:.1f} ms"
            )
    for problem in problems:
        click.echo(problem, err=True)
    if found and not ok:
        click.echo("the images contradict each other: the surface has a pattern, or the lens or mode differs", err=True)
    if not ok:
        ctx.exit(1)
