# SPDX-License-Identifier: Apache-2.0
"""`libocc sequence`: reproducible files, interrupted runs, bad input."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from small_room import contents, write_all

import libocc as occ
from libocc.cli import result_folder
from libocc.cli.dataset import write

LINE = ["sequence", "room.yaml", "walk.yaml", "--fps", 20]


@pytest.fixture
def run(libocc, tmp_path: Path):
    """Runs a command line in a folder with a small scene, a trajectory and a sweep."""
    write_all(tmp_path)
    return libocc


@pytest.mark.parametrize("layout", ["plain", "bop", "coco"])
def test_any_number_of_workers_writes_the_same_bytes(run, layout):
    for workers in (1, 2, 3):
        code, out, err = run(*LINE, "--layout", layout, "--out", f"set{workers}", "--workers", workers)
        assert code == 0, err
        assert out == f"set{workers}: 10 of 10 frames, 10 of them new (png, {layout})\n"
    assert contents("set1") == contents("set2") == contents("set3")


def test_frames_may_be_rendered_in_parts(run):
    assert run(*LINE, "--out", "whole")[0] == 0
    assert run(*LINE, "--out", "parts", "--frames", "6:")[1].startswith("parts: 4 of 4 frames, 4 of them new")
    assert run(*LINE, "--out", "parts", "--frames", 3)[1].startswith("parts: 3 of 3 frames, 3 of them new")
    assert len(occ.Trajectory.load("parts/trajectory.txt")) == 7
    assert run(*LINE, "--out", "parts")[1].startswith("parts: 10 of 10 frames, 3 of them new")
    assert contents("whole") == contents("parts")


def test_existing_frames_are_not_rendered_again(run, monkeypatch):
    assert run(*LINE, "--out", "set")[0] == 0
    before = contents("set")
    monkeypatch.setattr(write, "render_frame", None)
    assert run(*LINE, "--out", "set")[1] == "set: 10 of 10 frames, 0 of them new (png, plain)\n"
    assert contents("set") == before


def test_a_half_written_frame_does_not_count(run):
    assert run(*LINE, "--out", "set")[0] == 0
    before = contents("set")
    Path("set/truth/000004.json").unlink()
    Path("set/images/000007.png").unlink()
    Path("set/images/.libocc-left").write_bytes(b"half")
    assert run(*LINE, "--out", "set")[1].startswith("set: 10 of 10 frames, 2 of them new")
    assert contents("set") == before


def fails_at(count, monkeypatch):
    """The count-th file finds the disk full, when half of it is written."""
    real, calls = result_folder.whole_file, []

    class Full:
        def __init__(self, file):
            self.file = file

        def write(self, content):
            self.file.write(content[: len(content) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def whole_file(path):
        from contextlib import contextmanager

        @contextmanager
        def opened():
            calls.append(path)
            with real(path) as file:
                yield Full(file) if len(calls) == count else file

        return opened()

    monkeypatch.setattr(result_folder, "whole_file", whole_file)


@pytest.mark.parametrize("count", [2, 7, 8])
def test_a_full_disk_leaves_complete_files_and_the_run_can_continue(run, monkeypatch, count):
    assert run(*LINE, "--out", "whole")[0] == 0
    with monkeypatch.context() as patch:
        fails_at(count, patch)
        code, out, err = run(*LINE, "--out", "set")
    assert code == 2 and out == ""
    assert "No space left on device" in err and "the same command continues" in err and "set/" in err
    whole, part = contents("whole"), contents("set")
    assert len(part) == count - 1 and all(whole[name] == part[name] for name in part)
    assert run(*LINE, "--out", "set")[0] == 0
    assert contents("set") == whole


def test_a_small_file_system_fills_up(run, tmp_path):
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=120k", "tmpfs", str(small)]
    if os.geteuid() != 0 or subprocess.run(mount, check=False, capture_output=True).returncode != 0:
        pytest.skip("no right to mount a file system")
    try:
        code, _, err = run(*LINE, "--out", small / "set")
        assert code == 2 and "No space left on device" in err
        for path in (small / "set/truth").glob("*.json"):
            json.loads(path.read_text())
            occ.read_image(small / "set/images" / f"{path.stem}.png")
        assert len(list((small / "set/truth").iterdir())) > 0 and not list((small / "set").rglob(".libocc-*"))
        subprocess.run(["mount", "-o", "remount,size=9m", str(small)], check=True)
        assert run(*LINE, "--out", small / "set")[0] == 0
        assert run(*LINE, "--out", "whole")[0] == 0
        assert contents(small / "set") == contents("whole")
    finally:
        subprocess.run(["umount", str(small)], check=True)


def test_an_unwritable_folder_is_named(run):
    Path("file").write_text("")
    code, _, err = run(*LINE, "--out", "file/set")
    assert code == 2 and "file/set" in err and err.count("\n") == 1


def test_ctrl_c_keeps_finished_results(run, monkeypatch):
    real, calls = write.render_frame, []

    def render(frame):
        calls.append(frame)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return real(frame)

    monkeypatch.setattr(write, "render_frame", render)
    code, out, err = run(*LINE, "--out", "set")
    assert code == 130 and out.startswith("set: 3 of 10 frames, 3 of them new") and "continues from here" in err
    assert len(occ.Trajectory.load("set/trajectory.txt")) == 3
    monkeypatch.undo()


def test_ctrl_c_reaches_a_run_in_several_processes(run, tmp_path):
    command = [sys.executable, "-m", "libocc.cli", *map(str, LINE[:3]), "--fps", "2000", "--out", "set"]
    command += ["--workers", "2"]
    ran = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("set/truth/0*.json")) and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(ran.pid, signal.SIGINT)  # as a terminal does: to every process
    out, _ = ran.communicate(timeout=60)
    assert ran.returncode == 130, out
    found = sorted(path.stem for path in tmp_path.glob("set/truth/*.json"))
    assert 0 < len(found) < 900 and out.startswith(f"set: {len(found)} of ")
    for stem in found:
        json.loads((tmp_path / f"set/truth/{stem}.json").read_text())
        occ.read_image(tmp_path / f"set/images/{stem}.png")


@pytest.mark.parametrize(
    "options, text",
    [
        (("--seed", 1), "set: contains the result of other settings: seed was 0, is 1"),
        (("--fps", 10), "fps was 20.0, is 10.0"),
        (("--layout", "coco"), "layout was plain, is coco"),
        (("--format", "pgm"), "format was png, is pgm"),
        (("--no-noise",), "noise was True, is False"),
    ],
)
def test_a_folder_with_another_result_is_rejected(run, options, text):
    assert run(*LINE, "--out", "set", "--frames", 1)[0] == 0
    before = contents("set")
    code, _, err = run(*LINE, "--out", "set", *options)
    assert code == 2 and text in err and contents("set") == before


def test_a_folder_with_other_files_is_rejected(run, tmp_path):
    code, _, err = run(*LINE, "--out", tmp_path)
    assert code == 2 and "is not empty and has no results of libocc" in err


@pytest.mark.parametrize(
    "line, text",
    [
        (["--format", "pnq"], "--format: unknown image format 'pnq'; did you mean png?"),
        (["--layout", "boop"], "--layout: unknown layout 'boop'; did you mean bop?"),
        (["--layout", "bop", "--format", "pgm"], "layout bop allows png, got pgm"),
        (["--frames", "x"], "--frames: must be N or FROM:TO, got 'x'"),
        (["--frames", "1:2:3"], "--frames: must be N or FROM:TO, got '1:2:3'"),
        (["--frames", "50:60"], "none of the 10 frames is in '50:60'"),
    ],
)
def test_wrong_options(run, line, text):
    code, _, err = run(*LINE, "--out", "set", *line)
    assert code == 2 and text in err and not Path("set").exists()


GOOD = "{time_s: 0, position_m: [0, 0, 0]}"


@pytest.mark.parametrize(
    "waypoints, text",
    [
        (f"{GOOD}, {GOOD}", "key `waypoints[1].time_s`: must be later than the previous one, got 0"),
        (f"{GOOD}, {{time_s: 1, position_m: [0, .nan, 0]}}", "`waypoints[1].position_m`: must be a list of 3 finite"),
        ("{time_s: .inf, position_m: [0, 0, 0]}", "key `waypoints[0].time_s`: must be a finite number, got .inf"),
        ("{time_s: 0}", "key `waypoints[0].position_m`: is missing"),
        ("{time_s: 0, position: [0, 0, 0]}", "position_m"),
        (f"{GOOD[:-1]}, positoin_m: 3}}", "key `waypoints[0].positoin_m`: is not known, got 3; did you mean"),
        ("{time_s: 0, position_m: [0, 0]}", "must be a list of 3 finite numbers, got a list of 2"),
        (f"{GOOD[:-1]}, look_at_m: [0, 0, 1], tilt_deg: 3}}", "tilt_deg`: must not be given together with"),
        (f"{GOOD[:-1]}, look_at_m: [0, 0, 1]}}", "up"),
        (f"{GOOD[:-1]}, up: [0, 0, 1]}}", "`waypoints[0].up`: must be absent without `look_at_m`"),
        ("", "key `waypoints`: must be a list of at least one"),
        ("{time_s: 0, position_m: [0, 0, 0]", "not YAML"),
    ],
)
def test_bad_waypoints(run, waypoints, text):
    Path("bad.yaml").write_text(f"schema: libocc-trajectory/1\nwaypoints: [{waypoints}]\n")
    code, _, err = run("sequence", "room.yaml", "bad.yaml", "--out", "set")
    assert code == 2 and text in err and "bad.yaml" in err and err.count("\n") == 1
    assert not Path("set").exists()


@pytest.mark.parametrize(
    "text, reason",
    [
        ("0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", "bad.txt:2: times must increase"),
        ("0 0 0 nan 0 0 0 1\n", "bad.txt:1: must be finite numbers, got nan"),
        ("0 0 0 0 0 0 0 1\n0.001 0 0 0 0 0 0 1\n", "bad.txt: must last at least one frame"),
    ],
)
def test_bad_tum_files(run, text, reason):
    Path("bad.txt").write_text(text)
    code, _, err = run("sequence", "room.yaml", "bad.txt", "--out", "set")
    assert code == 2 and reason in err


def test_tum_and_waypoints_make_the_same_frames(run):
    occ.Trajectory.load("walk.yaml").save("walk.txt")
    for name in ("yaml", "txt"):
        assert run("sequence", "room.yaml", f"walk.{name}", "--fps", 5, "--out", name)[0] == 0
    a, b = (occ.read_image(f"{name}/images/000001.png").astype(int) for name in ("yaml", "txt"))
    assert np.abs(a - b).max() <= 1
