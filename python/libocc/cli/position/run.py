# SPDX-License-Identifier: Apache-2.0
"""A run of `libocc position`: sends records to standard output and to files."""

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


def report(text: str) -> None:
    """Prints a line on stderr."""
    click.echo(text, err=True)


class Screen:
    """Writes one line per frame to standard output, until its pipe is closed or its disk is full."""

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
                report(f"error: standard output: cannot be written: {error.strerror or error}")
            # Otherwise Python flushes stdout at exit and reports a second error.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class Run:
    """Sends records to standard output and to all outputs, until the records end or no output is left."""

    def __init__(self, screen: Screen, outputs: Outputs, kept: list[Record] | None, recording: bool):
        self.summary = Summary()
        self.kept = kept
        self._screen, self._outputs, self._recording = screen, outputs, recording
        self._broken = False

    def process(self, all_records: Generator[Record, None, None], source: str, total: int | None) -> None:
        """Processes all records. total: number of frames for a progress bar, None for no bar."""
        with ExitStack() as bars, closing(all_records):
            advance = bars.enter_context(progress("positioning", total)) if total is not None else None
            try:
                for record in all_records:
                    self._add(record)
                    if advance is not None:
                        advance()
                    if self.outputs_gone:
                        return
            except (OSError, ValueError) as error:
                text = str(error) if str(error).startswith(source) else f"{source}: {error}"
                if self.summary.frames == 0:
                    raise Failure(text) from error
                self._broken = True
                report(f"error: {text}")

    def _add(self, record: Record) -> None:
        self.summary.add(record)
        self._outputs.add(record)
        self._screen.add(record)
        if self.kept is not None:
            self.kept.append(record)

    @property
    def outputs_gone(self) -> bool:
        """True if none of the requested outputs can be written any more."""
        if not self._recording:
            return self._screen.gone
        return self._outputs.none_left and self.kept is None and self._screen.silent

    @property
    def failed(self) -> bool:
        """True if an error occurred; it was reported on stderr."""
        return self._broken or self._screen.failed or bool(self._outputs.failures)
