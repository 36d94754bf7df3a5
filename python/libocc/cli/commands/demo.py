# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from ...samples import Sample, samples
from .. import Failure, error_context, json_option, print_json, report


@dataclass
class Row:
    """Result of one image compared with its ground truth."""

    image: str
    status: str
    error_mm: float
    sigma_mm: float
    rms_px: float
    time_ms: float
    lamps: list[dict[str, float]] = field(default_factory=list)


def prior_of(truth: dict[str, Any]) -> occ.Prior | None:
    """Prior from a sample's truth file, if it has one."""
    if "prior_heading_deg" not in truth:
        return None
    return occ.Prior(
        heading_rad=math.radians(truth["prior_heading_deg"]),
        heading_sigma_rad=math.radians(truth["prior_heading_sigma_deg"]),
    )


def nearest(fix: occ.Fix, position_m: Any) -> occ.Candidate:
    """Candidate nearest to the true position; an ambiguous fix must contain the true pose."""
    return min(fix.candidates, key=lambda c: float(np.linalg.norm(c.position_m - position_m)))


def compared(sample: Sample, fix: occ.Fix, time_ms: float) -> Row:
    status = fix.status.name
    if fix.status is occ.Status.ambiguous:
        status += f", {len(fix.candidates)} poses"
    if not fix.candidates:
        return Row(sample.name, status, math.nan, math.nan, math.nan, time_ms)
    true_position = np.asarray(sample.truth["position_m"])
    candidate = nearest(fix, true_position)
    true_centres = {lamp["id"]: lamp["image_centre_px"] for lamp in sample.truth["lamps"]}
    lamps = [
        {
            "id": id,
            "error_px": float(np.linalg.norm(blob.centroid_px - true_centres[id])),
            "sigma_px": report.sigma_px(blob),
        }
        for id, blob in candidate.lamps.items()
    ]
    error_mm = 1e3 * float(np.linalg.norm(candidate.position_m - true_position))
    sigma_mm = 1e3 * float(np.sqrt(np.trace(candidate.position_covariance_m2)))
    return Row(sample.name, status, error_mm, sigma_mm, candidate.rms_px, time_ms, lamps)


def run(sample: Sample, out: Path) -> Row:
    """Locates one sample and writes its picture."""
    from ..overlay import draw_fix

    with error_context(sample.image):
        scene = occ.Scene.load(sample.scene)
        image = occ.read_image(sample.image)
        fix = occ.locate(image, scene, prior_of(sample.truth))
    picture = out / f"{sample.name}.png"
    with error_context(picture):
        draw_fix(picture, image, fix, scene, title=sample.name)
    return compared(sample, fix, 1e3 * fix.timing_s.total_s)


def table(rows: list[Row]) -> Any:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    out = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name in ("image", "lamp", "error", "sigma", "time"):
        out.add_column(name, justify="left" if name in ("image", "lamp") else "right")
    for row in rows:
        found = not math.isnan(row.error_mm)
        out.add_row(
            f"[bold]{row.image}[/]",
            row.status,
            f"[bold]{row.error_mm:.2f} mm[/]" if found else "-",
            f"{row.sigma_mm:.2f} mm" if found else "-",
            f"{row.time_ms:.1f} ms",
        )
        for lamp in row.lamps:
            numbers = f"{lamp['error_px']:.3f} px", f"{lamp['sigma_px']:.3f} px"
            out.add_row("", f"  {lamp['id']:.0f}", *numbers, "")
        out.add_section()
    return out


@click.command(short_help="Locate the images that come with libocc.")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), default=Path("demo"), show_default=True,
    help="Folder for the annotated pictures.",
)
@json_option
def command(out: Path, as_json: bool) -> None:
    """\b
    $ libocc demo
     image             lamp               error      sigma      time
     ───────────────────────────────────────────────────────────────
    ...

    Locates the camera in every image that comes with libocc, compares the result with the ground truth
    and writes annotated pictures. If several poses fit, the one nearest to the truth is compared. Errors
    and sigmas are given for the position in mm and for each lamp's measured centre in px.
    """
    found = samples()
    if not found:
        raise Failure("libocc was installed without its sample images")
    with error_context(out):
        out.mkdir(parents=True, exist_ok=True)
    from rich.console import Console
    from rich.progress import track

    progress = track(found, "locating", console=Console(stderr=True), transient=True)
    rows = [run(sample, out) for sample in progress]
    if as_json:
        print_json([vars(row) for row in rows])
        return
    Console().print(table(rows))
    click.echo(f"{len(rows)} annotated pictures in {out.resolve()}")
