# SPDX-License-Identifier: Apache-2.0
"""Jobs in processes, and the bar that tells of them."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

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


CHILDREN = """
import os, signal, sys
from concurrent.futures import ProcessPoolExecutor
from small_room import sleep_long
from libocc.cli.workers import processes

if __name__ == "__main__":
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # ignored if the tests run under nohup
    with processes(2) as (executor, _):
        for _ in range(4):
            executor.submit(sleep_long, None)
        while len(executor._processes) < 2 or not all(p.is_alive() for p in executor._processes.values()):
            pass
        print(*executor._processes, flush=True)
        signal.pause()
"""


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_workers_end_with_their_parent(number, tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(CHILDREN)
    paths = [str(Path(__file__).parent), *sys.path]
    parent = subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)}, start_new_session=True,
    )
    workers = [int(pid) for pid in parent.stdout.readline().split()]
    assert len(workers) == 2 and all(map(is_running, workers))
    time.sleep(2)  # the workers have started and wait or work
    parent.send_signal(number)
    parent.wait()
    parent.stdout.close()
    deadline = time.monotonic() + 20
    while any(map(is_running, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    left = [pid for pid in workers if is_running(pid)]
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert not left


def test_progress_shows_only_in_a_long_run(monkeypatch, capsys):
    for quiet, shown in ((1e9, False), (-1.0, True)):
        monkeypatch.setattr(progress, "QUIET_S", quiet)
        monkeypatch.setenv("FORCE_COLOR", "1")  # taken for a terminal
        with progress.progress("rendering", 3) as advance:
            advance(0)
            advance()
        assert ("rendering" in capsys.readouterr().err) == shown
