# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path
from typing import Any

import click

from ... import __version__
from .. import INTERRUPTED, Failure, error_context, json_option, print_json
from ..files import whole_file
from ..progress import progress
from ..result_folder import json_bytes, table
from ..trust import output
from ..trust.families import FAMILIES, Family
from ..trust.figures import FamilyRow, RiskRow, family_row, risk_rows, too_often_wrong
from ..trust.measure import Run, run

PAGE = 120  # columns of text that is not written to a terminal
PICTURE, FAMILY_TABLE, RISK_TABLE, EVERYTHING = "trust.png", "families.csv", "risk.csv", "trust.json"
TITLE = "How sure is it? Verdicts, covariances and risks against the truth"


def chosen(names: tuple[str, ...]) -> list[Family]:
    for name in names:
        if name not in FAMILIES:
            raise Failure(f"--family: {name!r} is not one of {', '.join(FAMILIES)}")
    return [family for name, family in FAMILIES.items() if not names or name in names]


def folder_of(out: str) -> Path:
    """Creates the folder before the run. Raises: Failure when it cannot be created."""
    with error_context(out):
        Path(out).mkdir(parents=True, exist_ok=True)
    return Path(out)


def risks_of(result: Run, names: list[str]) -> list[RiskRow]:
    return list(risk_rows([record for name in names for record in result.records[name]]))


def write(
    folder: Path, data: dict[str, Any], rows: list[FamilyRow], risks: list[RiskRow], others: list[RiskRow]
) -> None:
    """Writes all files. others: without the families that are too often wrong."""
    from ..trust import plot

    nested = ("coverage", "risk")
    families = [{k: v for k, v in family.items() if k not in nested} for family in data["families"]]
    problems = max(row.problems for row in rows)
    note = f"libocc {__version__}, {problems} problems of each family, seed {data['seed']}; lines: 95 % intervals"
    with error_context(folder):
        for name, content in (
            (FAMILY_TABLE, table(families)), (RISK_TABLE, table(data["risk"])), (EVERYTHING, json_bytes(data)),
        ):
            with whole_file(str(folder / name)) as file:
                file.write(content)
        with whole_file(str(folder / PICTURE)) as file:
            plot.draw(file, ".png", rows, risks, others, TITLE, note)


def verdict(rows: list[FamilyRow]) -> str:
    fixes, wrong = sum(row.ok for row in rows), sum(row.wrong.hits for row in rows)
    faulty = too_often_wrong(rows)
    text = f"{wrong} of {fixes} fixes that are ok are wrong"
    return text + (f"; significantly more than 1e-4: {', '.join(faulty)}" if faulty else "")


def measured(families: list[Family], count: int, seed: int, threads: int) -> Run:
    with error_context("trust"), progress("solving", count * len(families)) as advance:
        return run(families, count, seed, threads, advance)


@click.command(short_help="Measure how often verdicts and covariances are right.")
@click.option("--family", "names", multiple=True, metavar="NAME", help="Use only this family; repeatable.")
@click.option("--count", type=click.IntRange(1), default=100, show_default=True,
              help="Problems of each family; 100 of all take about 15 s.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the problems.")
@click.option("--threads", type=click.IntRange(1), default=os.cpu_count() or 1,
              help="Number of threads; the figures do not depend on it. Default: all processors.")
@json_option
@click.option("--out", metavar="FOLDER", help=f"Write {PICTURE}, {FAMILY_TABLE}, {RISK_TABLE} and {EVERYTHING}.")
@click.pass_context
def command(
    ctx: click.Context, names: tuple[str, ...], count: int, seed: int, threads: int, as_json: bool, out: str | None
) -> None:
    """\b
    $ libocc trust --family coplanar_four --family outliers --count 20
    family         problems  ok  ambiguous  no pose  other  wrong  inside  median  p99
    ...

    Solves families of simulated problems whose truth is known, and compares verdicts, risks and
    covariances with it: how often a fix that is ok is wrong, how often one with a stated risk of at most
    r is wrong (as with max_risk = 1, so that every fix counts), how often the truth is within 1, 2 and 3
    sigma, and the time. Families: six_lamps, few_rims, few_centres, one_dark, priors, wide, grids, junk,
    coplanar_four (solve_pose), outliers (robust_pose). The same seed gives the same figures, except for
    the times. Ctrl-C ends the run and reports the problems solved so far. Exit code 0: wrong fixes are not
    significantly more frequent than 1e-4; 1: they are, in one of the families; 2: bad input.
    """
    families = chosen(names)
    folder = None if out is None else folder_of(out)
    result = measured(families, count, seed, threads)
    rows = [family_row(family, result.records[family.name]) for family in families]
    faulty = too_often_wrong(rows)
    risks = risks_of(result, list(result.records))
    data = output.plain({"count": count, "seed": seed}, rows, risks, result.interrupted)
    if folder is not None and result.count:
        others = risks_of(result, [name for name in result.records if name not in faulty]) if faulty else []
        write(folder, data, rows, risks, others)
    if as_json:
        print_json(data)
    else:
        from rich.console import Console

        console = Console() if Console().is_terminal else Console(width=PAGE)
        console.print(output.family_table(rows))
        if risks:
            console.print(output.risk_table(risks))
        console.print(output.LEGEND, style="dim", highlight=False)
        click.echo(verdict(rows) + (" before Ctrl-C" if result.interrupted else ""))
    if result.interrupted:
        ctx.exit(INTERRUPTED)
    if faulty:
        ctx.exit(1)
