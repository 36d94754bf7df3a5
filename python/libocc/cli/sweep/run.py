# SPDX-License-Identifier: Apache-2.0
"""Computes the missing points of a folder and writes the tables."""

from collections.abc import Iterable
from typing import Any

from ..progress import Advance
from ..result_folder import ResultFolder, table
from ..workers import run_jobs
from .plan import Sweep, check_point
from .point import Point, compute_point, point_name


def points_of(sweep: Sweep) -> list[Point]:
    return [
        Point(
            i, sweep.base, dict(zip(sweep.parameters, values, strict=True)), sweep.images, sweep.seed,
            sweep.keep, sweep.image_format,
        )
        for i, values in enumerate(sweep.values())
    ]


def check_points(points: list[Point], advance: Advance) -> None:
    """Checks that all points can be rendered. Raises: ValueError naming the point."""
    for point in points:
        try:
            check_point(point.base, point.values)
        except ValueError as error:
            raise ValueError(f"point {point.index}, {point.values}: {error}") from error
        advance()


def is_done(folder: ResultFolder, point: Point) -> bool:
    """True if the last file of the point exists, and all files that it lists."""
    name = point_name(point.index)
    return folder.has(name) and all(map(folder.has, folder.read_json(name)["files"]))


def run_sweep(
    folder: ResultFolder, points: list[Point], workers: int, scheduler: str | None, advance: Advance
) -> bool:
    """Computes points; returns True after Ctrl-C, which keeps finished points. Raises: OSError, ValueError."""
    return folder.keep(
        run_jobs(compute_point, points, workers, scheduler, lambda: advance(0)), advance
    )


def done_points(folder: ResultFolder, points: list[Point], advance: Advance) -> list[Point]:
    done = []
    for point in points:
        if is_done(folder, point):
            done.append(point)
        advance()
    return done


def write_tables(folder: ResultFolder, done: list[Point]) -> None:
    """Writes results.csv, and times.csv with the times, which differ between runs."""
    folder.write("results.csv", table(_rows(folder, done)))
    if done and "time" in done[0].keep:
        folder.write("times.csv", table(_times(folder, done)))


def _rows(folder: ResultFolder, points: list[Point]) -> Iterable[dict[str, Any]]:
    for point in points:
        for row in folder.read_json(point_name(point.index))["rows"]:
            yield {"point": point.index, **point.values, **row}


def _times(folder: ResultFolder, points: list[Point]) -> Iterable[dict[str, Any]]:
    for point in points:
        for row in folder.read_json(f"times/{point.index:06d}.json"):
            yield {"point": point.index, **row}
