# SPDX-License-Identifier: Apache-2.0
"""`libocc position`: output and files for every source, and the end of a run."""

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from stream_support import render, walk, write_bag, write_folder

import libocc as occ
from libocc import samples
from libocc.cli.poses import upward_pose
from libocc.cli.position.follow import Follower, records
from libocc.cli.position.outputs import JsonLines, Outputs, Tum
from libocc.cli.position.positioner import TrackerPositioner
from libocc.cli.position.summary import Summary
from libocc.streams.frames import StreamFrame

FRAMES = 12


@pytest.fixture(scope="module")
def frames(scene):
    return render(scene, FRAMES)


@pytest.fixture
def run(libocc, tmp_path: Path, frames):
    """Runs a command line beside the folder of frames `walk`."""
    write_folder(tmp_path / "walk", frames)
    return libocc


def records_of(path):
    return [json.loads(line) for line in Path(path).read_text().splitlines()]


def test_every_frame_has_a_line_and_a_record(run, frames):
    code, out, err = run("position", "irregular_six", "--source", "walk", "--out", "w.jsonl")
    assert code == 0, err
    lines = out.splitlines()
    assert lines[0].split()[:3] == ["time", "s", "state"] and len(lines) == 1 + FRAMES
    records = records_of("w.jsonl")
    for record, line, (time_s, _, pose) in zip(records, lines[1:], frames, strict=True):
        assert record["state"] == "tracking" and record["time_s"] == time_s
        assert line.split()[:2] == [f"{time_s:.3f}", "tracking"]
        true_m = -pose[:3, :3].T @ pose[:3, 3]
        assert record["error_m"] == pytest.approx(np.array(record["position_m"]) - true_m, abs=1e-9)
        sigma_m = np.sqrt(np.diag(record["position_covariance_m2"]))
        assert np.all(np.abs(record["error_m"]) < 6 * sigma_m + 1e-4)
    assert f"{FRAMES} frames: {FRAMES} tracking" in err and "against the truth: mean 0." in err


def test_json_lines_are_printed_as_they_are_written(run):
    code, out, _ = run("position", "irregular_six", "--source", "walk", "--json", "--out", "w.jsonl")
    printed = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and printed == records_of("w.jsonl")


def test_tum_is_a_trajectory(run):
    assert run("position", "irregular_six", "--source", "walk", "--quiet", "--tum", "w.tum")[0] == 0
    read = occ.Trajectory.load("w.tum")
    assert len(read) == FRAMES
    for time_s in (walk().begin_s, walk().begin_s + 0.31):
        off = read.cam_from_world(time_s) - walk().cam_from_world(time_s)
        assert np.abs(off).max() < 2e-3


@pytest.mark.parametrize("name", ["poses", "poses.bag"])
@pytest.mark.parametrize("source", ["in", "in.bag"])
def test_bags_in_and_out(run, frames, name, source):
    highlevel = pytest.importorskip("rosbags.highlevel")
    write_bag(Path(source), frames)
    code, _, err = run("position", "irregular_six", "--source", source, "--quiet", "--bag", name, "--out", "w.jsonl")
    assert code == 0, err
    records = records_of("w.jsonl")
    with highlevel.AnyReader([Path(name)]) as bag:
        got = {c.topic: [] for c in bag.connections}
        for connection, stamp_ns, raw in bag.messages():
            got[connection.topic].append((stamp_ns, bag.deserialize(raw, connection.msgtype)))
    assert len(got["/libocc/pose"]) == len(got["/libocc/fix"]) == FRAMES
    for record, (stamp_ns, message), (_, text) in zip(records, got["/libocc/pose"], got["/libocc/fix"], strict=True):
        assert json.loads(text.data) == record
        assert stamp_ns == pytest.approx(1e9 * record["time_s"], abs=2)
        assert message.header.frame_id == "map"
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        assert [place.x, place.y, place.z] == pytest.approx(record["position_m"], abs=1e-9)
        assert turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2 == pytest.approx(1)
        covariance = message.pose.covariance.reshape(6, 6)
        assert covariance[:3, :3] == pytest.approx(np.array(record["position_covariance_m2"]), rel=1e-6, abs=1e-15)


def test_a_rerun_recording_is_written(run):
    pytest.importorskip("rerun")
    assert run("position", "irregular_six", "--source", "walk", "--quiet", "--rerun", "w.rrd")[0] == 0
    assert Path("w.rrd").read_bytes()[:3] == b"RRF" and Path("w.rrd").stat().st_size > 5000


def test_a_recording_that_does_not_fit_is_said(run, monkeypatch):
    rerun = pytest.importorskip("rerun")
    code, _, err = run("position", "irregular_six", "--source", "walk", "--rerun", "/dev/full")
    assert code == 2 and "error: /dev/full: cannot be written: " in err and err.count("\n") == 1

    def full(stream, **options):
        raise RuntimeError("File-writer thread shut down prematurely")

    monkeypatch.setattr(rerun.RecordingStream, "flush", full)
    code, _, err = run(
        "position", "irregular_six", "--source", "walk", "--quiet", "--rerun", "w.rrd", "--tum", "w.tum"
    )
    assert code == 2 and "error: w.rrd: cannot be written: File-writer thread" in err and "it is incomplete" in err
    assert len(occ.Trajectory.load("w.tum")) == FRAMES


def test_a_picture_is_drawn(run):
    assert run("position", "irregular_six", "--source", "walk", "--quiet", "--plot", "w.png")[0] == 0
    picture = occ.read_image("w.png")
    assert picture.shape[1] > 1000 and picture.std() > 5


def test_a_prior_resolves_the_symmetry_of_a_square(libocc):
    assert libocc("sequence", "square_four", "walk", "--fps", 5, "--frames", 4, "--out", "s")[0] == 0
    code, out, err = libocc("position", "square_four", "--source", "s")
    assert code == 1 and "searching" in out and "tracking" not in out and "first position" not in err
    code, out, _ = libocc("position", "square_four", "--source", "s", "--prior-heading-deg", 5, "--json")
    assert code == 0 and {json.loads(line)["state"] for line in out.splitlines()} == {"tracking"}


# --- bad frames


def test_bad_frames_are_said_and_left_out(run, frames):
    images = sorted(Path("walk/images").iterdir())
    images[3].write_bytes(b"torn")
    occ.write_image(images[5], np.zeros((48, 64), np.uint8))
    images[7].write_bytes(images[6].read_bytes())
    images[9].unlink()
    truth = json.loads(Path("walk/truth/000011.json").read_text())
    Path("walk/truth/000011.json").write_text(json.dumps({**truth, "time_s": 1.0}))
    code, _, err = run("position", "irregular_six", "--source", "walk", "--quiet", "--out", "w.jsonl")
    assert code == 0, err
    records = {record["name"]: record for record in records_of("w.jsonl")}
    skipped = {name[4:6]: record["reason"] for name, record in records.items() if record["state"] == "skipped"}
    assert skipped.keys() == {"03", "05", "07", "11"}
    assert "000003.png" in skipped["03"] and skipped["05"] == "its size is not that of the camera, 640 x 480"
    assert "its pixels equal those of the previous frame" in skipped["07"] and "late: " in skipped["11"]
    assert records["000010.png"]["warning"] == "1 frame missing before it: 0.100 s after the previous frame"
    assert all(record["state"] == "tracking" for name, record in records.items() if name[4:6] not in skipped)
    assert "4 skipped" in err


def test_lamps_switched_off_give_no_position(run, frames):
    for image in sorted(Path("walk/images").iterdir())[4:]:
        occ.write_image(image, np.zeros((480, 640), np.uint8))
    code, _, _ = run(
        "position", "irregular_six", "--source", "walk", "--quiet", "--out", "w.jsonl", "--tum", "w.tum"
    )
    records = records_of("w.jsonl")
    assert code == 0 and [record["state"] for record in records[:4]] == ["tracking"] * 4
    for record in records[4:]:
        assert record["state"] in ("coasting", "lost", "searching") and record["reason"]
        assert record["predicted"] == (record["state"] == "coasting") == (record["position_m"] is not None)
    sigmas = [np.trace(r["position_covariance_m2"]) for r in records if r["state"] == "coasting"]
    assert np.all(np.diff(sigmas) >= 0)
    assert len(occ.Trajectory.load("w.tum")) == 4


def test_a_camera_that_is_carried_off_is_found_again_and_the_jump_is_said(run, scene, frames):
    away = occ.look_at([2.6, 2.5, 0.5], [2.5, 2.4, 3], up=[1, 0, 0])
    there = occ.Trajectory([walk().begin_s + FRAMES / 20, 99], [away, away])
    moved = render(scene, 8, there)
    write_folder(Path("far"), frames + moved)
    for i in range(FRAMES, FRAMES + 8):  # the camera stands still
        file = Path(f"far/truth/{i:06d}.json")
        file.write_text(json.dumps({**json.loads(file.read_text()), "velocity": [0.0] * 6}))
    code, _, err = run("position", "irregular_six", "--source", "far", "--quiet", "--out", "w.jsonl")
    assert code == 0, err
    records = records_of("w.jsonl")
    jumps = [record for record in records if record["warning"] == "relocalised: the pose differs from the prediction"]
    assert len(jumps) == 1 and "from where it was expected, confirmed by" in jumps[0]["reason"]
    assert FRAMES < jumps[0]["frame"] < FRAMES + 6
    for record in records:
        assert record["state"] in ("tracking", "coasting")
        if record["state"] == "tracking":
            assert np.linalg.norm(record["error_m"]) < 0.01
        else:
            assert "from where it was expected" in record["reason"]
    assert records[-1]["state"] == "tracking"


def test_a_clock_set_back_begins_anew(run):
    for i in range(6, FRAMES):
        file = Path(f"walk/truth/{i:06d}.json")
        file.write_text(json.dumps({"time_s": 0.05 * i}))
    code, _, err = run("position", "irregular_six", "--source", "walk", "--quiet", "--out", "w.jsonl", "--tum", "w.tum")
    assert code == 0
    records = records_of("w.jsonl")
    assert records[6]["state"] == "skipped" and "clock was set back by 4.9" in records[7]["warning"]
    assert records[8]["state"] == "tracking"
    assert len(occ.Trajectory.load("w.tum")) == 6 and "poses are omitted because their times do not increase" in err


def test_the_last_pose_is_kept_after_a_clock_jump(libocc, scene):
    """In a square of equal lamps only the initial prior resolves the symmetry."""
    square = samples.load_scene("square_four")
    write_folder(Path("s"), render(square, 10))
    for i in range(5, 10):
        file = Path(f"s/truth/{i:06d}.json")
        file.write_text(json.dumps({"time_s": 0.05 * i}))
    code, out, _ = libocc(
        "position", "square_four", "--source", "s", "--prior-heading-deg", 5, "--prior-heading-sigma-deg", 10, "--json"
    )
    records = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and [r["state"] for r in records] == ["tracking"] * 5 + ["skipped"] + ["tracking"] * 4
    steps_m = np.diff([r["position_m"] for r in records if r["position_m"]], axis=0)
    assert np.linalg.norm(steps_m, axis=1).max() < 0.05


# --- bad input


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("irregular_six", "--source", "nowhere"), "nowhere: no such folder, video or bag"),
        (("nosuch", "--source", "walk"), "nosuch"),
        (("square_four", "--source", "bare"), "bare"),
        (
            ("irregular_six", "--source", "bare"),
            "000000.json: no such file, so the times of the frames are unknown: give --fps",
        ),
        (("irregular_six", "--source", "walk", "--topic", "/a"), "--topic: walk is not a bag"),
        (("irregular_six", "--source", "walk", "--decode"), "--decode: no lamp of the scene has a code; give --lamps"),
        (("irregular_six", "--source", "walk", "--lamps", "none.csv"), "none.csv"),
        (("irregular_six", "--source", "walk", "--out", "nowhere/w.jsonl"), "nowhere/w.jsonl: cannot be written"),
        (("irregular_six", "--source", "walk", "--tum", "walk"), "walk: cannot be written"),
        (("irregular_six", "--source", "walk", "--rerun", "nowhere/w.rrd"), "nowhere/w.rrd"),
        (("irregular_six", "--source", "walk", "--bag", "walk"), "walk: exists already"),
        (
            ("irregular_six", "--source", "small", "--fps", 5),
            "its size is 64 x 48, that of the scene's camera is 640 x 480",
        ),
    ],
)
def test_bad_input_is_one_line(run, arguments, message):
    for module in [{"--bag": "rosbags", "--rerun": "rerun"}[a] for a in arguments if a in ("--bag", "--rerun")]:
        pytest.importorskip(module)
    for name, size in (("bare", (480, 640)), ("small", (48, 64))):
        Path(name).mkdir()
        occ.write_image(f"{name}/000000.png", np.zeros(size, np.uint8))
    code, out, err = run("position", *arguments)
    assert code == 2 and out == "" and message in err and err.startswith("error: ") and err.count("\n") == 1


def test_errors_name_what_is_missing(run, monkeypatch):
    for module, options in (("rosbags", ("--bag", "b")), ("rerun", ("--rerun", "w.rrd"))):
        for name in [name for name in sys.modules if name.split(".")[0] == module]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setitem(sys.modules, module, None)
        code, _, err = run("position", "irregular_six", "--source", "walk", *options)
        assert code == 2 and "pip install 'libocc[ro" in err or "pip install 'libocc[rerun]'" in err


def test_a_full_disk_is_reported_and_other_outputs_are_complete(run):
    code, out, err = run(
        "position", "irregular_six", "--source", "walk", "--out", "/dev/full", "--tum", "w.tum"
    )
    assert code == 2 and "error: /dev/full: cannot be written: No space left on device; frame 0" in err
    assert len(occ.Trajectory.load("w.tum")) == FRAMES and len(out.splitlines()) == 1 + FRAMES
    code, out, err = run("position", "irregular_six", "--source", "walk", "--out", "/dev/full", "--quiet")
    assert code == 2 and "1 frames: 1 tracking" in err  # the other frames have no receiver


# --- as a process


def process(*arguments, **options):
    command = [Path(sys.executable).with_name("libocc"), "position", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_the_run_cleanly(tmp_path: Path, frames, number):
    """An endless stream is played in real time."""
    write_folder(tmp_path / "walk", frames * 9)
    highlevel = pytest.importorskip("rosbags.highlevel")
    ran = process(
        "irregular_six", "--source", "walk", "--fps", 10, "--realtime", "--out", "w.jsonl", "--bag", "b", cwd=tmp_path
    )
    assert ran.stdout is not None and ran.stdout.readline() and ran.stdout.readline()
    ran.send_signal(number)
    _, err = ran.communicate(timeout=20)
    assert ran.returncode == 130 and "Traceback" not in err
    assert "interrupted; all files written so far are complete" in err
    assert 1 <= len(records_of(tmp_path / "w.jsonl")) < 9 * FRAMES
    assert (tmp_path / "w.jsonl").read_text().endswith("}\n")
    with highlevel.AnyReader([tmp_path / "b"]) as bag:
        assert bag.topics["/libocc/fix"].msgcount == len(records_of(tmp_path / "w.jsonl"))


def test_a_file_played_at_its_pace_drops_frames_when_nobody_keeps_up(tmp_path: Path, frames):
    """Frames of one second at 2000 frames/s."""
    write_folder(tmp_path / "walk", frames)
    ran = process("irregular_six", "--source", "walk", "--fps", 20000, "--realtime", "--json", cwd=tmp_path)
    out, err = ran.communicate(timeout=60)
    records = [json.loads(line) for line in out.splitlines()]
    assert ran.returncode == 0 and records[-1]["frame"] == FRAMES - 1
    assert len(records) + sum(record["dropped"] for record in records) == FRAMES
    assert not any("missing" in record["warning"] for record in records)


def test_a_closed_pipe_ends_the_run_quietly(tmp_path: Path, frames):
    write_folder(tmp_path / "walk", frames)
    ran = process("irregular_six", "--source", "walk", cwd=tmp_path)
    assert ran.stdout is not None and ran.stderr is not None
    ran.stdout.close()
    err = ran.stderr.read()
    ran.wait(timeout=20)
    assert "Traceback" not in err and "Exception" not in err


def test_a_full_standard_output_is_said(tmp_path: Path, frames):
    write_folder(tmp_path / "walk", frames)
    command = [Path(sys.executable).with_name("libocc"), "position", "irregular_six", "--source", "walk"]
    with open("/dev/full", "w") as full:
        ran = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert ran.returncode == 2 and "standard output: cannot be written: No space left on device" in ran.stderr
    assert "Traceback" not in ran.stderr


# --- lamps that transmit ids


def test_coded_lamps_need_no_prior(libocc):
    """Square of lamps without a prior; the table has their positions."""
    pose = occ.look_at([1.9, 2.05, 0.3], [1.9, 2.1, 3], up=[0, 1, 0])
    stands = occ.Trajectory([0, 2], [pose, pose])
    write_folder(Path("s"), render(samples.load_scene("ufsook_four"), 39, stands, 30), stands)
    table = Path("lamps.csv")
    table.write_text("id,x,y,z\n1,11,1,3\n2,13,1,3\n3,11,3,3\n4,13,3,3\n")  # lamps of the scene, shifted by 10 m
    code, out, err = libocc(
        "position", "ufsook_four", "--source", "s", "--decode", "--lamps", table, "--out", "s.jsonl"
    )
    assert code == 0, err
    records = records_of("s.jsonl")
    first = next(i for i, record in enumerate(records) if record["position_m"] is not None)
    assert 30 <= first < 39 and f"ids were decoded after {first + 1} frames" in records[first]["warning"]
    assert all(r["state"] == "searching" and r["reason"].startswith("decoding ids") for r in records[:first])
    assert all(record["state"] in ("tracking", "coasting") for record in records[first:])
    assert np.linalg.norm(records[-1]["error_m"] - np.array([10, 0, 0])) < 0.01
    assert "first position 1." in err


@pytest.mark.slow
def test_a_phone_walks_among_coded_lamps(libocc):
    """14 s in a grid of twenty lamps, six of them in view, each dark for half of the time."""
    assert libocc("sequence", "ufsook_hall", "phone_walk", "--out", "s", "--workers", 2)[0] == 0
    code, _, err = libocc("position", "ufsook_hall", "--source", "s", "--decode", "--quiet", "--out", "s.jsonl")
    assert code == 0, err
    records = records_of("s.jsonl")
    errors_m = np.array([np.linalg.norm(r["error_m"]) for r in records if r["state"] == "tracking"])
    first = next(i for i, record in enumerate(records) if record["state"] == "tracking")
    assert first < 60 and len(errors_m) > 0.9 * (len(records) - first)
    assert not any(record["state"] == "lost" for record in records)
    assert np.median(errors_m) < 0.015 and errors_m.max() < 0.15


@pytest.mark.slow
def test_a_long_stream_needs_constant_memory(scene, tmp_path: Path):
    """Frames of ten minutes; the memory is compared after a warm-up."""
    angles = np.linspace(0, 2 * np.pi, 61)
    ring = [upward_pose([1.8 + 0.1 * np.cos(a), 1.9 + 0.1 * np.sin(a), 0.4], 0, 2, 40) for a in angles]
    made = render(scene, 60, occ.Trajectory([i / 30 for i in range(61)], ring), 30)

    class Endless:
        name, live, total = "endless", False, None

        def __iter__(self):
            for i in range(18000):
                yield StreamFrame(i, i / 30, made[i % 60][1])

        def close(self):
            pass

    outputs = Outputs([JsonLines(str(tmp_path / "w.jsonl")), Tum(str(tmp_path / "w.tum"))], print)
    summary, follower, resident = Summary(), Follower(scene, TrackerPositioner(scene)), []
    for record in records(Endless(), follower, threading.Event(), False, print):
        summary.add(record)
        outputs.add(record)
        if record.frame in (2000, 17999):
            resident.append(int(Path("/proc/self/statm").read_text().split()[1]) * 4096)
    outputs.close()
    assert summary.states["tracking"] == 18000
    assert resident[1] - resident[0] < 1e6
