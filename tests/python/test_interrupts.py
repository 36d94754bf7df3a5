# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends every command at once with exit code 130, also during a long call of compiled code."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import libocc as occ
from libocc.cli import COMMANDS, files, interrupts, main

Run = Callable[..., tuple[int, str, str]]
KINDS = [f"calibrate {kind}" for kind in ("camera", "panorama", "lamps", "network")]

# Replaces a step of `libocc demo` by a call of compiled code that takes minutes and does not check for signals.
STUCK = """
import sys
import numpy as np
import libocc.cli.commands.demo as demo
from libocc.cli import files, main

def stuck(*_):
    with files.whole_file("result.png") as file:
        file.write(b"half")
        matrix = np.random.default_rng(1).random((6000, 6000))
        print("started", flush=True)
        np.linalg.svd(matrix)

demo.run = stuck
main(["demo", "--out", "demo"])
"""


def command_of(name: str) -> click.Command:
    command: Any = main
    for word in name.split():
        command = command.get_command(click.Context(command), word)
    assert isinstance(command, click.Command)
    return command


@pytest.mark.parametrize("name", [*(name for name in COMMANDS if name != "calibrate"), *KINDS])
def test_an_interrupt_in_any_command_gives_130(libocc: Run, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    def interrupted(**_: object) -> None:
        signal.raise_signal(signal.SIGINT)
        time.sleep(10)
        pytest.fail("was not interrupted")

    command = command_of(name)
    monkeypatch.setattr(command, "params", [])
    monkeypatch.setattr(command, "callback", interrupted)
    code, out, err = libocc(*name.split())
    assert (code, out, err) == (130, "", "interrupted\n")


def test_handlers_are_restored(libocc: Run) -> None:
    wakeup = signal.set_wakeup_fd(-1)
    signal.set_wakeup_fd(wakeup)
    assert libocc("samples")[0] == 0
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.set_wakeup_fd(wakeup) == wakeup


def test_an_interrupted_block_does_not_end_the_process_in_the_next() -> None:
    """The thread that watches a block may run only after the next block has begun."""
    for _ in range(200):
        with pytest.raises(KeyboardInterrupt), interrupts.interruptible():
            signal.raise_signal(signal.SIGINT)
    with interrupts.interruptible():
        time.sleep(interrupts.GRACE_S + 0.5)


def test_an_ignored_signal_stays_ignored(libocc: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a script that starts libocc in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts.interruptible():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def started(program: str, cwd: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd
    )


@pytest.mark.parametrize("signals", [1, 2])
def test_a_long_call_of_compiled_code_is_ended(tmp_path: Path, signals: int) -> None:
    with started(STUCK, tmp_path) as running:
        assert running.stdout is not None and running.stdout.readline() == "started\n"
        time.sleep(1.0)  # the call is being executed
        begun = time.monotonic()
        for _ in range(signals):
            running.send_signal(signal.SIGINT)
            time.sleep(0.2)
        _, err = running.communicate(timeout=60)
    assert running.returncode == 130 and err.strip() == "interrupted"
    assert time.monotonic() - begun < interrupts.GRACE_S + 8
    assert sorted(os.listdir(tmp_path)) == ["demo"]  # no temporary file, no half-written result


def test_temporary_files_are_forgotten_when_they_are_complete(tmp_path: Path) -> None:
    with files.whole_file(str(tmp_path / "a")) as file:
        file.write(b"whole")
        assert len(interrupts.temporary_files) == 1
    assert not interrupts.temporary_files
    with pytest.raises(ZeroDivisionError), files.whole_file(str(tmp_path / "b")):
        raise ZeroDivisionError
    assert not interrupts.temporary_files and os.listdir(tmp_path) == ["a"]


def test_ctrl_c_just_after_the_renaming_is_no_other_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = os.replace

    def interrupted(source: str, target: str) -> None:
        rename(source, target)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt), files.whole_file(str(tmp_path / "a")) as file:
        file.write(b"whole")
    assert (tmp_path / "a").read_bytes() == b"whole" and not interrupts.temporary_files


def test_bytes_are_on_the_disk_before_a_file_is_renamed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a crash can leave an empty file under the final name."""
    steps = []
    for name in ("fsync", "replace"):
        real = getattr(os, name)
        monkeypatch.setattr(os, name, lambda *given, name=name, real=real: (steps.append(name), real(*given)))
    with files.whole_file(str(tmp_path / "a")) as file:
        file.write(b"whole")
    assert steps == ["fsync", "replace"] and (tmp_path / "a").read_bytes() == b"whole"


def test_the_search_of_a_chessboard_is_interrupted(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(110, 1.0, (1500, 2000)).round().astype(np.uint8)
    occ.write_image(tmp_path / "0.png", noise)
    arguments = [*(["0.png"] * 2000), "--chessboard", "9x6", "--square", "0.03", "--out", "out"]
    program = f"print('started', flush=True)\nfrom libocc.cli import main\nmain({['calibrate', 'camera', *arguments]})"
    with started(program, tmp_path) as running:
        assert running.stdout is not None and running.stdout.readline() == "started\n"
        time.sleep(3)
        assert running.poll() is None
        begun = time.monotonic()
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=60)
    assert running.returncode == 130 and "interrupted" in err
    assert time.monotonic() - begun < interrupts.GRACE_S + 8


def test_pictures_without_a_board_are_rejected_in_seconds(libocc: Run) -> None:
    rng = np.random.default_rng(1)
    for i, sigma in enumerate((0.7, 5)):
        occ.write_image(f"{i}.png", rng.normal(110, sigma, (3000, 4000)).round().astype(np.uint8))
    begun = time.monotonic()
    code, _, err = libocc(
        "calibrate", "camera", "0.png", "1.png", "--chessboard", "9x6", "--square", 0.03, "--out", "o"
    )
    assert code == 2 and "inner corners was detected in any of 2 images" in err
    assert time.monotonic() - begun < 60  # ten minutes without the reduction of the image
