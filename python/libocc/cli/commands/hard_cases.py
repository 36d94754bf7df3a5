# SPDX-License-Identifier: Apache-2.0
import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from ...pose import missing_solvers
from .. import Failure, error_context, json_option, print_json
from ..build import missing_note, require_in_build
from ..hard_cases.cases import Case, catalogue
from ..hard_cases.matrix import Cell, by_case, own_harmless, run
from ..hard_cases.methods import OWN, Method, own_methods, peer_methods
from ..progress import progress

PAGE = 160  # columns of text that is not written to a terminal


def chosen(kind: str, wanted: tuple[str, ...], known: dict[str, Any]) -> list[Any]:
    """Selects the values with the given names; all of them if no names are given."""
    for name in wanted:
        if name not in known:
            raise Failure(f"--{kind}: {name!r} is not one of {', '.join(known)}")
    return [value for name, value in known.items() if not wanted or name in wanted]


def tables(cells: list[Cell], cases: list[Case], methods: list[Method], width: int) -> Iterator[Any]:
    """Tables with a row per case and a column per solver, as many columns as fit; key() explains the column numbers."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    from ..hard_cases.show import grouped, style_of, text_of

    found = {(c.case, c.row, c.family, c.method): c for c in cells}
    order = [case.name for _, members in grouped(cases) for case in members]
    rows = sorted(dict.fromkeys((c.case, c.row) for c in cells), key=lambda key: order.index(key[0]))
    labels = [f"{case} {row}".strip() for case, row in rows]
    columns = max(1, (width - max(map(len, labels)) - 4) // 5)
    for first in range(0, len(methods), columns):
        out = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
        out.add_column("case", no_wrap=True)
        shown = methods[first : first + columns]
        for i in range(len(shown)):
            out.add_column(str(first + i + 1), justify="right", no_wrap=True)
        for (case, row), label in zip(rows, labels):
            of_row = [found.get((case, row, method.family, method.name)) for method in shown]
            texts = [Text(text_of(cell), style=style_of(cell)) if cell else Text() for cell in of_row]
            out.add_row(Text(label), *texts)
        yield out


def key(methods: list[Method]) -> str:
    """Legend of the column numbers and signs."""
    from ..hard_cases.show import Show

    families: dict[str, list[str]] = {}
    for i, method in enumerate(methods, 1):
        families.setdefault(method.family, []).append(f"{i} {method.name}")
    lines = [f"{family}: {', '.join(names)}" for family, names in families.items()]
    signs = ", ".join(f"{show.sign} {show.label}" for show in Show)
    return "\n".join([*lines, f"{signs}; a number: percentage of such answers"])


def write_csv(path: str, cells: list[Cell]) -> None:
    with error_context(path), Path(path).open("w", newline="") as file:
        writer = csv.DictWriter(file, list(cells[0].as_dict()))
        writer.writeheader()
        writer.writerows(cell.as_dict() for cell in cells)


def draw(path: str, cells: list[Cell], cases: list[Case], methods: list[Method]) -> None:
    from ..hard_cases import picture

    with error_context(path):
        picture.draw(path, by_case(cells), cases, methods)


def verdict(cells: list[Cell]) -> str:
    """Summary that corresponds to the exit code."""
    own = [c for c in cells if c.family == "libocc" and c.method in OWN]
    bad = [f"{c.method} on {c.case} {c.row}".strip() for c in own if not c.harmless]
    problems = sum(c.total for c in own)
    if bad:
        return f"{' and '.join(OWN)}: a wrong answer without warning: {'; '.join(bad)}"
    return f"{' and '.join(OWN)}: a correct answer or a justified refusal in all of {problems} problems"


@click.command(short_help="Run the pose solvers on degenerate and ill-conditioned problems.")
@click.option("--solver", "solvers", multiple=True, metavar="NAME", help="Use only this solver; repeatable.")
@click.option("--case", "names", multiple=True, metavar="NAME", help="Use only this case; repeatable.")
@click.option("--count", type=click.IntRange(1), help="Problems per row; replaces the number of the case.")
@click.option("--peers", is_flag=True, help="Also run the solvers of OpenCV and PoseLib, if installed.")
@click.option("--sweep", is_flag=True, help="One row for each value of a case's parameter.")
@json_option
@click.option("--csv", "csv_path", metavar="FILE.csv", help="Write the counts.")
@click.option("--plot", "plot_path", metavar="FILE.png", help="Draw the table.")
@click.pass_context
def command(
    ctx: click.Context,
    solvers: tuple[str, ...],
    names: tuple[str, ...],
    count: int | None,
    peers: bool,
    sweep: bool,
    as_json: bool,
    csv_path: str | None,
    plot_path: str | None,
) -> None:
    """\b
    $ libocc hard-cases --solver p3p --case equilateral_on_axis --case no_triangle
    case                 1
    ──────────────────────
    equilateral_on_axis  ●
    no_triangle          ○
    ...

    Runs every pose solver on a catalogue of degenerate and ill-conditioned problems and compares each
    answer with reference poses computed with 100 digits. Exit code 0: libocc's solvers (auto, p3p) give
    a correct answer or a justified refusal for every problem; 1: not so; 2: bad input.
    """
    with error_context("hard cases"):
        cases = chosen("case", names, {case.name: case for case in catalogue()})
    require_in_build("--solver", solvers, missing_solvers())
    methods = chosen("solver", solvers, {method.name: method for method in own_methods()})
    if not solvers:
        click.echo(missing_note(missing_solvers()), nl=False, err=True)
    if peers:
        found, missing = peer_methods()
        methods += found
        for package in missing:
            click.echo(f"not installed, not used: {package}", err=True)
    with progress("solving", sum(len(case.rows()) for case in cases)) as advance:
        cells = run(cases, methods, count, advance)
    if not cells:
        raise Failure("no selected solver accepts the number of points of a selected case")
    if csv_path is not None:
        write_csv(csv_path, cells)
    if plot_path is not None:
        draw(plot_path, cells, cases, methods)
    if as_json:
        print_json([cell.as_dict() for cell in cells])
    else:
        from rich.console import Console

        console = Console() if Console().is_terminal else Console(width=PAGE)
        for part in tables(cells if sweep else by_case(cells), cases, methods, console.width):
            console.print(part)
        click.echo(key(methods))
        click.echo(verdict(cells))
    if not own_harmless(cells):
        ctx.exit(1)
