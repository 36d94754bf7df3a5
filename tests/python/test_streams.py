# SPDX-License-Identifier: Apache-2.0
"""Sources of frames, their order, and what takes records: each by itself."""

import errno
import json
import os
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from stream_support import FPS, raw_image, render, write_bag, write_folder

import libocc as occ
from libocc.cli.position import outputs as outputs_module
from libocc.cli.position.clock import FrameOrder
from libocc.cli.position.lamp_table import lamps_of_table
from libocc.cli.position.latest import Latest
from libocc.cli.position.outputs import JsonLines, Outputs, Tum
from libocc.cli.position.record import Pose, Record, record_dict, record_text
from libocc.cli.position.ros_messages import ros_covariance
from libocc.cli.position.summary import Summary
from libocc.streams.bags import BagSource, pixels_of, pixels_of_file
from libocc.streams.folder import FolderSource
from libocc.streams.frames import StreamFrame
from libocc.streams.open_source import open_source

PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4)


@pytest.fixture(scope="module")
def frames(scene):
    return render(scene, 6)


def numbered(*times_s, **changes):
    return [
        StreamFrame(i, t, PIXELS + np.uint8(i), **changes) if t is not None else StreamFrame(i, t, None, problem="torn")
        for i, t in enumerate(times_s)
    ]


def looked_at(*times_s):
    order = FrameOrder()
    return [order.check(frame) for frame in numbered(*times_s)]


def pose_at(time_s, position_m=(1.0, 2.0, 0.5)):
    pose = occ.look_at(position_m, [1.2, 2.1, 3], up=[0, 1, 0])
    covariance = np.diag([1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6])
    inside = pose[:3, :3].T @ covariance[3:, 3:] @ pose[:3, :3]
    return Pose(time_s, pose, covariance, np.array(position_m), inside)


# --- sources


def test_images_of_a_folder_are_read_on_demand(tmp_path: Path, frames, monkeypatch):
    folder = write_folder(tmp_path / "set", frames)
    read = []
    module = sys.modules[FolderSource.__module__]
    monkeypatch.setattr(module, "read_image", lambda path: (read.append(path), occ.read_image(path))[1])
    source = open_source(str(folder))
    assert isinstance(source, FolderSource) and source.total == 6 and not source.live
    for i, frame in enumerate(source):
        assert len(read) == i + 1
        assert frame.time_s == frames[i][0] and np.array_equal(frame.image, frames[i][1])


def test_an_image_that_cannot_be_read_is_a_frame_with_a_problem(tmp_path: Path, frames):
    folder = write_folder(tmp_path / "set", frames)
    (folder / "images" / "000002.png").write_bytes(b"\x89PNG nothing")
    (folder / "truth" / "000004.json").write_text("{}")
    found = list(open_source(str(folder)))
    assert [frame.image is None for frame in found] == [False, False, True, False, True, False]
    assert "000002.png" in found[2].problem and found[2].time_s == frames[2][0]
    assert "000004.json" in found[4].problem


@pytest.mark.parametrize("name", ["bag", "one.bag"])
@pytest.mark.parametrize("encoding", ["mono8", "png"])
def test_bags_of_both_kinds_give_their_images(tmp_path: Path, frames, name, encoding):
    pytest.importorskip("rosbags")
    bag = write_bag(tmp_path / name, frames, encoding)
    source = open_source(str(bag))
    assert isinstance(source, BagSource) and source.total == 6
    found = list(source)
    source.close()
    assert [frame.time_s for frame in found] == pytest.approx([time_s for time_s, _, _ in frames], abs=1e-8)
    assert all(np.array_equal(f.image, image) for f, (_, image, _) in zip(found, frames, strict=True))


def test_a_bag_without_stamps_has_the_times_of_its_recording(tmp_path: Path, frames):
    pytest.importorskip("rosbags")
    source = open_source(str(write_bag(tmp_path / "bag", frames, stamped=False)))
    assert next(iter(source)).time_s == pytest.approx(frames[0][0] + 0.1)


def test_a_bag_of_several_topics_requires_a_topic(tmp_path: Path, frames):
    pytest.importorskip("rosbags")
    bag = str(write_bag(tmp_path / "bag", frames[:1], topics=("/left", "/right")))
    with pytest.raises(ValueError, match=r"bag: has images on several topics; give --topic with one of /left, /right"):
        open_source(bag)
    with pytest.raises(ValueError, match=r"--topic: '/up' has no images in .*; allowed: /left, /right"):
        open_source(bag, topic="/up")
    assert open_source(bag, topic="/right").total == 1


def test_damaged_bags_are_rejected_by_name(tmp_path: Path):
    pytest.importorskip("rosbags")
    (tmp_path / "torn.bag").write_bytes(b"#ROSBAG V2.0\n" + b"\0" * 40)
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "metadata.yaml").write_text("nothing: 1\n")
    for name in ("torn.bag", "empty"):
        with pytest.raises(ValueError, match=f"{name}: is not a bag that rosbags can read"):
            open_source(str(tmp_path / name))


def test_pixels_of_messages():
    padded = raw_image("mono8", 2, 3, 4, [1, 2, 3, 0, 4, 5, 6])  # the last row may lack its padding
    assert pixels_of(padded).tolist() == [[1, 2, 3], [4, 5, 6]]
    deep = raw_image("mono16", 1, 2, 4, [1, 0, 0, 1], bigendian=1)
    assert pixels_of(deep).tolist() == [[256, 1]] and pixels_of(deep).dtype == np.uint16
    colour = pixels_of(raw_image("bgr8", 1, 2, 6, range(6)))
    assert colour.shape == (1, 2, 3) and colour.flags.c_contiguous and colour.tolist() == [[[2, 1, 0], [5, 4, 3]]]
    assert pixels_of(raw_image("rgb8", 1, 2, 6, range(6))).tolist() == [[[0, 1, 2], [3, 4, 5]]]
    assert pixels_of(raw_image("bgra8", 1, 1, 4, range(4))).tolist() == [[[2, 1, 0, 3]]]
    with pytest.raises(ValueError, match="encoding must be one of .*, got 'yuv422'"):
        pixels_of(raw_image("yuv422", 1, 2, 4, range(4)))
    with pytest.raises(ValueError, match="3 bytes of step 2 cannot hold 2 x 2 mono8"):
        pixels_of(raw_image("mono8", 2, 2, 2, range(3)))
    with pytest.raises(ValueError, match="cannot be read as an image"):
        pixels_of_file(b"nothing")


def test_a_video_gives_its_frames_at_its_rate(tmp_path: Path, frames):
    cv2 = pytest.importorskip("cv2")
    path = str(tmp_path / "walk.avi")
    height, width = frames[0][1].shape
    writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"MJPG"), FPS, (width, height))
    for _, image, _ in frames:
        writer.write(np.repeat(image[:, :, None], 3, axis=2))
    writer.release()
    found = list(open_source(path))
    assert [frame.time_s for frame in found] == pytest.approx([i / FPS for i in range(6)])
    assert np.corrcoef(found[5].image[:, :, 0].ravel(), frames[5][1].ravel())[0, 1] > 0.98
    assert [frame.time_s for frame in open_source(path, fps=10)][1] == pytest.approx(0.1)


class FakeCapture:
    """A video of four frames whose second cannot be decoded; a camera gives them again and again."""

    def __init__(self, what):
        self.camera, self.at = isinstance(what, int), 0

    def isOpened(self):
        return True

    def get(self, what):
        return {"fps": 10.0, "count": 4}[what]

    def set(self, what, value):
        pass

    def read(self):
        self.at += 1
        if self.camera:
            time.sleep(0.002)
            return self.at % 5 != 0, PIXELS
        return self.at in (1, 3, 4), PIXELS

    def release(self):
        self.released = True


@pytest.fixture
def fake_opencv(monkeypatch):
    fake = SimpleNamespace(VideoCapture=FakeCapture, CAP_PROP_FPS="fps", CAP_PROP_FRAME_COUNT="count")
    monkeypatch.setitem(sys.modules, "cv2", fake)


def test_a_torn_frame_of_a_video_is_said_and_the_rest_is_read(fake_opencv, tmp_path: Path):
    (tmp_path / "v.mp4").touch()
    found = list(open_source(str(tmp_path / "v.mp4")))
    assert [(frame.index, frame.problem) for frame in found] == [(0, ""), (1, "cannot be decoded"), (2, ""), (3, "")]


def test_a_camera_is_live_and_its_clock_is_now(fake_opencv):
    source = open_source("camera:0")
    assert source.live and source.total is None
    frames = iter(source)
    found = [next(frames) for _ in range(6)]
    assert abs(found[0].time_s - time.time()) < 5
    assert [frame.image is None for frame in found] == [False, False, False, False, True, False]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("camera:front", "camera:front: a camera must be given as camera:N"),
        ("nowhere", "nowhere: no such folder, video or bag"),
        (".", "contains no images"),
    ],
)
def test_invalid_sources_are_rejected(name, message, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises((OSError, ValueError), match=message):
        open_source(name)


# --- order


def test_frames_in_order_are_used_and_missing_ones_counted():
    found = looked_at(0.0, 0.1, 0.2, 0.3, 0.7, 0.8)
    assert all(verdict.usable for verdict in found)
    assert [verdict.warning for verdict in found if verdict.warning] == [
        "3 frames missing before it: 0.400 s after the previous frame"
    ]
    order = FrameOrder()
    for frame in numbered(0.0, 0.1, 0.2):
        order.check(frame)
    assert order.check(StreamFrame(9, 0.6, PIXELS), dropped=3).warning == ""  # on purpose


def test_a_late_frame_is_left_out_and_a_clock_set_back_begins_anew():
    late = looked_at(1.0, 1.1, 1.05, 1.2)
    assert [verdict.usable for verdict in late] == [True, True, False, True]
    assert "late: 0.050 s earlier" in late[2].reason and not late[3].restart
    back = looked_at(100.0, 100.1, 3.0, 3.1, 3.2)
    assert [verdict.usable for verdict in back] == [True, True, False, True, True]
    assert back[3].restart and "the clock was set back by 97.000 s" in back[3].warning
    assert not back[4].restart and not back[4].warning


def test_repeated_frames_are_skipped():
    assert "its time equals that of the previous frame" in looked_at(0.0, 0.0)[1].reason
    order = FrameOrder()
    assert order.check(StreamFrame(0, 0.0, PIXELS)).usable
    again = order.check(StreamFrame(1, 0.1, PIXELS.copy()))
    assert not again.usable and "its pixels equal those of the previous frame" in again.reason
    dark = np.zeros((3, 4), np.uint8)
    assert order.check(StreamFrame(2, 0.2, dark)).usable and order.check(StreamFrame(3, 0.3, dark)).usable


def test_frames_without_a_time_or_an_image_are_left_out():
    found = looked_at(0.0, None, float("nan"), 0.1)
    assert [verdict.usable for verdict in found] == [True, False, False, True]
    assert found[1].reason == "torn" and "its time is nan" in found[2].reason


# --- live


class Script:
    """Source that yields frames on request."""

    name, live, total = "script", True, None

    def __init__(self, frames, error=None):
        self.frames, self.error = frames, error

    def __iter__(self):
        yield from self.frames
        if self.error:
            raise self.error

    def close(self):
        pass


def test_who_is_slow_gets_the_newest_frame_and_every_problem():
    frames = numbered(0.0, 0.1, None, 0.3, 0.4)
    latest = Latest(Script(frames), threading.Event())
    latest._thread.join(5)
    taken = list(latest)
    assert [frame.index for frame in taken] == [2, 4]
    assert latest.dropped == 3 and latest.close()


def test_exceptions_of_a_source_are_raised_after_its_frames():
    latest = Latest(Script(numbered(0.0), OSError("unplugged")), threading.Event())
    latest._thread.join(5)
    taken = iter(latest)
    assert next(taken).index == 0
    with pytest.raises(OSError, match="unplugged"):
        next(taken)
    assert latest.close()


def test_files_are_played_at_their_pace_and_stop_ends_them():
    stop = threading.Event()
    begun = time.monotonic()
    latest = Latest(Script(numbered(7.0, 7.05, 7.1, 1e6, 1e6 + 1000)), stop, paced=True)
    taken = list(latest)
    assert [frame.index for frame in taken][:2] == [0, 1] and taken[-1].index == 4
    assert 0.1 <= time.monotonic() - begun < 5  # not a thousand seconds
    stop.set()
    assert latest.close()


# --- records and outputs


def test_records_are_json_and_text():
    record = Record(3, 0.1, "coasting", "no lamps", pose=pose_at(0.1), dropped=2)
    data = json.loads(json.dumps(record_dict(record), allow_nan=False))
    assert data["predicted"] is True and data["position_m"] == [1.0, 2.0, 0.5] and data["dropped"] == 2
    lost = record_dict(Record(4, None, "skipped", "torn"))
    assert lost.keys() == data.keys() and lost["position_m"] is None and lost["time_s"] is None
    assert record_text(record).split()[:5] == ["0.100", "coasting", "1.0000", "2.0000", "0.5000"]
    assert record_text(Record(4, None, "lost", "no lamps")).split() == ["-", "lost", *"----", "-", "no", "lamps"]


def test_tum_files_are_read_back_and_have_no_predictions(tmp_path: Path):
    path = str(tmp_path / "a.tum")
    tum = Tum(path)
    times_s = [1.7e9 + i / 30 for i in range(4)]
    for i, time_s in enumerate(times_s):
        state = "coasting" if i == 1 else "tracking"
        tum.add(Record(i, time_s, state, pose=pose_at(time_s, (1 + 0.1 * i, 2, 0.5))))
    tum.add(Record(9, 3.0, "tracking", pose=pose_at(3.0)))
    assert tum.close() == f"{path}: 1 poses are omitted because their times do not increase"
    lines = Path(path).read_text().splitlines()
    assert lines[0].startswith("# timestamp tx ty tz qx qy qz qw") and len(lines) == 1 + 3
    read = np.loadtxt(path)  # eight numbers, space between, `#` a comment: what evo takes
    assert read.shape == (3, 8) and np.linalg.norm(read[:, 4:], axis=1) == pytest.approx(1)
    assert read[:, 0] == pytest.approx([times_s[0], *times_s[2:]], abs=1e-6)
    back = occ.Trajectory.load(path)
    assert back.cam_from_world(times_s[2]) == pytest.approx(pose_at(0, (1.2, 2, 0.5)).cam_from_world, abs=1e-9)


def test_a_full_disk_leaves_complete_lines_and_the_other_outputs(tmp_path: Path, monkeypatch):
    path, messages = str(tmp_path / "a.jsonl"), []
    full, whole = JsonLines(path), Tum(str(tmp_path / "a.tum"))
    outputs = Outputs([full, whole], messages.append)
    record = Record(0, 0.1, "tracking", pose=pose_at(0.1))
    outputs.add(record)
    size = Path(path).stat().st_size
    write = os.write

    def nearly_full(file, data):
        if file != full._file._file:
            return write(file, data)
        if len(data) > 100:
            return write(file, data[:100])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(outputs_module.os, "write", nearly_full)
    outputs.add(Record(1, 0.2, "tracking", pose=pose_at(0.2)))
    outputs.add(Record(2, 0.3, "tracking", pose=pose_at(0.3)))
    outputs.close()
    assert Path(path).stat().st_size == size and json.loads(Path(path).read_text())["frame"] == 0
    assert len((tmp_path / "a.tum").read_text().splitlines()) == 1 + 3
    (message,) = messages
    reason = "No space left on device; frame 1 and all later frames are missing in it"
    assert message == f"error: {path}: cannot be written: {reason}"


def test_covariances_are_ros_s_own(pose):
    """Compares with the covariance of random poses: position and rotation of perturbed cameras in the world."""
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(np.diag([1, 2, 3, 4, 5, 6]) * 1e-8 + 3e-9)
    covariance = root @ root.T
    found = ros_covariance(Pose(0.0, pose, covariance, np.zeros(3), np.eye(3)))
    drawn = []
    for delta in (root @ rng.standard_normal((6, 20000))).T:
        moved = occ.smoothing.moved_pose(pose, delta, 1.0)
        turn = moved[:3, :3].T @ pose[:3, :3]
        place = -moved[:3, :3].T @ moved[:3, 3] + pose[:3, :3].T @ pose[:3, 3]
        drawn.append([*place, turn[2, 1], turn[0, 2], turn[1, 0]])
    sampled = np.cov(np.array(drawn).T)
    scale = np.sqrt(np.outer(np.diag(found), np.diag(found)))
    assert np.abs((sampled - found) / scale).max() < 0.05
    inside = pose[:3, :3].T @ covariance[3:, 3:] @ pose[:3, :3]
    assert found[:3, :3] == pytest.approx(inside)


# --- lamp tables


def test_a_table_gives_the_positions_of_lamps(root: Path, tmp_path: Path):
    room = occ.Scene.load(root / "data" / "scenes" / "ufsook_four.yaml")
    table = tmp_path / "lamps.csv"
    table.write_text("id,x,y,z\n# a comment\n7,1,1,3\n\n9,3,1,2.5\n")
    made = lamps_of_table(str(table), room, occ.codes.Code(kind=occ.codes.CodeKind.ufsook))
    assert [lamp.id for lamp in made.lamps] == [7, 9] and made.lamps[1].centre_m.tolist() == [3, 1, 2.5]
    assert made.lamps[0].radius_m == room.lamps[0].radius_m and made.lamps[0].code.id == 7


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r":1: columns must be id,x,y,z or id,x,y,z,radius, got ''"),
        ("id,x,z,y\n", r":1: columns must be"),
        ("id,x,y,z\n", r": has no lamps"),
        ("id,x,y,z\n1,1,1,3\n1,2,2,3\n", r":3: id 1 occurs twice"),
        ("id,x,y,z\n1,1,1\n", r":2: must have 4 values, got 3"),
        ("id,x,y,z\none,1,1,3\n", r":2: id must be a whole number, got 'one'"),
        ("id,x,y,z\n1,1,high,3\n", r":2: y must be a number \[m\], got 'high'"),
        ("id,x,y,z\n1,1,nan,3\n", r":2: y must be finite, got 'nan'"),
        ("id,x,y,z,radius\n1,1,1,3,-0.1\n", r":2: radius must be positive, got '-0.1'"),
        ("id,x,y,z\n300,1,1,3\n", r":2: .*id must be below 256"),
    ],
)
def test_a_bad_table_is_rejected_with_its_line(root: Path, tmp_path: Path, text, message):
    room = occ.Scene.load(root / "data" / "scenes" / "ufsook_four.yaml")
    table = tmp_path / "lamps.csv"
    table.write_text(text)
    with pytest.raises(ValueError, match=f"lamps.csv{message}"):
        lamps_of_table(str(table), room, occ.codes.Code(kind=occ.codes.CodeKind.ufsook))


# --- the summary


def test_a_summary_has_quantiles_of_times_and_errors():
    summary = Summary()
    for i in range(1000):
        pose = pose_at(0.1 * i)
        summary.add(Record(i, 0.1 * i, "tracking", pose=pose, took_s=1e-3 * (i + 1), error_m=np.array([3e-3, 0, 4e-3])))
    summary.add(Record(1000, 100.0, "skipped", "torn", took_s=50.0))
    assert summary.took.quantile_s(0.5) == pytest.approx(0.5, rel=0.02)
    assert summary.took.quantile_s(0.99) == pytest.approx(0.99, rel=0.02)
    lines = summary.text().splitlines()
    assert lines[0] == "1001 frames: 1000 tracking, 1 skipped" and lines[1].startswith("first position 0.000 s")
    nees = np.array([3e-3, 0, 4e-3]) @ np.linalg.solve(pose.position_covariance_m2, [3e-3, 0, 4e-3])
    assert lines[3] == (
        f"against the truth: mean 5.00 mm, RMSE 5.00 mm, max 5.00 mm; mean NEES {nees:.2f} (3 expected)"
    )
    assert Summary().text() == "0 frames: none"
