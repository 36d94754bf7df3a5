# SPDX-License-Identifier: Apache-2.0
"""Jobs in processes, and the bar that tells of them."""

import pytest
from small_room import die, double

from libocc.cli import progress
from libocc.cli.workers import run_jobs


@pytest.mark.parametrize("workers", [1, 2])
def test_every_job_has_its_result(workers):
    jobs = list(range(30))
    assert sorted(run_jobs(double, jobs, workers)) == [(i, 2 * i) for i in jobs]
    assert list(run_jobs(double, [], workers)) == []


def test_a_process_that_dies_is_no_hang():
    with pytest.raises(OSError, match="a worker process was killed"):
        list(run_jobs(die, [1, 2, 3], 2))


def test_progress_shows_only_in_a_long_run(monkeypatch, capsys):
    for quiet, shown in ((1e9, False), (-1.0, True)):
        monkeypatch.setattr(progress, "QUIET_S", quiet)
        monkeypatch.setenv("FORCE_COLOR", "1")  # taken for a terminal
        with progress.progress("rendering", 3) as advance:
            advance(0)
            advance()
        assert ("rendering" in capsys.readouterr().err) == shown
