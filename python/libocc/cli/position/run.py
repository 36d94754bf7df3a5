# SPDX-License-Identifier: Apache-2.0
"""A run on the command line: records to the screen and to outputs, until nobody wants them."""

import os
import sys
from collections.abc import Generator
from contextlib import ExitStack, closing

import click

from .. import Failure
from ..progress import progress
from .outputs import Outputs, json_line
from .record import HEAD, Record, record_text
from .summary import Summary


def tell(text: str) -> None:
    click.echo(text, err=True)


class Screen:
    """Standard output, a line a frame. When nobody reads it any more, or its disk is full, there is
    no more of it."""

    def __init__(self, as_json: bool, quiet: bool):
        self._as_json, self._quiet = as_json, quiet
        self._begun = False
        self.failed = self.gone = False

    @property
    def silent(self) -> bool:
        return self._quiet or self.gone

    def add(self, record: Record) -> None:
        if self.silent:
            return
        lines = [json_line(record)] if self._as_json else [record_text(record)]
        if not self._as_json and not self._begun:
            lines.insert(0, HEAD)
        self._begun = True
        try:
            click.echo("\n".join(lines))
        except OSError as error:
            self.gone = True
            if not isinstance(error, BrokenPipeError):
                self.failed = True
                tell(f"error: standard output: cannot be written: {error.strerror or error}")
            # Python would try once more at its end, and say so.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class Run:
    """Takes records to where they are wanted, until there are no more or nobody wants them."""

    def __init__(self, screen: Screen, outputs: Outputs, kept: list[Record] | None, recording: bool):
        self.summary = Summary()
        self.kept = kept
        self._screen, self._outputs, self._recording = screen, outputs, recording
        self._broken = False

    def through(self, all_records: Generator[Record, None, None], source: str, total: int | None) -> None:
        """total: for a bar, which a screen full of lines has no place for."""
        with ExitStack() as bars, closing(all_records):
            advance = bars.enter_context(progress("positioning", total)) if total is not None else None
            try:
                for record in all_records:
                    self._add(record)
                    if advance is not None:
                        advance()
                    if self.unheard:
                        return
            except (OSError, ValueError) as error:
                text = str(error) if str(error).startswith(source) else f"{source}: {error}"
                if self.summary.frames == 0:
                    raise Failure(text) from error
                self._broken = True
                tell(f"error: {text}")

    def _add(self, record: Record) -> None:
        self.summary.add(record)
        self._outputs.add(record)
        self._screen.add(record)
        if self.kept is not None:
            self.kept.append(record)

    @property
    def unheard(self) -> bool:
        """Nothing that was wanted can be written any more."""
        if not self._recording:
            return self._screen.gone
        return self._outputs.none_left and self.kept is None and self._screen.silent

    @property
    def failed(self) -> bool:
        """What and why has been told."""
        return self._broken or self._screen.failed or bool(self._outputs.failures)
