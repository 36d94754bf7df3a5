# SPDX-License-Identifier: Apache-2.0
"""Networks of other programs: the same network in each format, real networks with their reports, malformed files."""

import bz2
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import libocc as occ
from libocc.cli import main
from libocc.network.importing import format_of, import_network

SHARED = Path(__file__).parents[3] / "shared/data/networks"
Target = occ.network.Target


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def rotation(omega: float, phi: float, kappa: float) -> np.ndarray:
    def about(axis: int, angle: float) -> np.ndarray:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[[i, j, i, j], [i, j, j, i]] = np.cos(angle), np.cos(angle), -np.sin(angle), np.sin(angle)
        return turn
    return np.asarray(about(0, omega) @ about(1, phi) @ about(2, kappa))


class Field:
    """Points and images with the axes of photogrammetry: x right, y up, z backwards."""

    def __init__(self, images: int = 6, points: int = 25):
        random = np.random.default_rng(4)
        self.points = random.uniform(-0.5, 0.5, (points, 3))
        self.angles = [random.uniform(-0.3, 0.3, 3) + [0, 0, 1.3 * k] for k in range(images)]
        self.turns = [rotation(*angles) for angles in self.angles]
        self.centres = [turn @ random.uniform([-0.2, -0.2, 2.2], [0.2, 0.2, 2.6]) for turn in self.turns]

    def ideal(self, image: int) -> np.ndarray:
        """x / -z and y / -z of all points."""
        seen = (self.points - self.centres[image]) @ self.turns[image]
        return np.asarray(seen[:, :2] / -seen[:, 2:])


FIELD = Field()
CK, R0, A1, A2, B1, B2, C1, C2 = 28.8, 12.0, -1.1e-4, 1.5e-7, 6e-6, -9e-6, -7e-5, 3e-5


def brown(x: np.ndarray, y: np.ndarray, a: tuple[float, ...], r0: float, b: tuple[float, ...], c: tuple[float, ...]
          ) -> tuple[np.ndarray, np.ndarray]:
    t = x * x + y * y
    g = a[0] * (t - r0**2) + a[1] * (t**2 - r0**4)
    return (x + x * g + b[0] * (t + 2 * x * x) + 2 * b[1] * x * y + c[0] * x + c[1] * y,
            y + y * g + b[1] * (t + 2 * y * y) + 2 * b[0] * x * y)


def aicon_files() -> dict[str, list[str]]:
    files: dict[str, list[str]] = {"ior": [
        f"1 -999 {-CK} 0.02 0.05 {A1} {A2} {R0}", "0.0", f"{B1} {B2}", f"{C1} {C2}", "36.0 24.0 7200 4800",
    ]}
    files["obc"] = [
        f"{100 + k} {' '.join(repr(float(1000 * v)) for v in at)} 0.01 0.01 0.01 6 1 1 0"
        for k, at in enumerate(FIELD.points)
    ] + ["999 0 0 0 0 0 0 0 0 1 0"]
    files["eor"] = [
        f"{k + 1} 1 {' '.join(repr(float(1000 * v)) for v in FIELD.centres[k])} "
        f"{' '.join(repr(float(v)) for v in FIELD.angles[k])} 0 307 3" for k in range(len(FIELD.centres))
    ]
    files["phc"] = []
    for k in range(len(FIELD.centres)):
        x, y = brown(*(CK * FIELD.ideal(k)).T, (A1, A2), R0, (B1, B2), (C1, C2))
        files["phc"] += [
            f"{k + 1} {100 + p} {float(x[p] + 0.02)!r} {float(y[p] + 0.05)!r} 0.0005 0.001 0 0 1 1 1"
            for p in range(len(x))
        ]
    files["phc"].append("1 100 0 0 0.0005 0.0005 0 0 1 0 1")  # not active
    length = float(1000 * np.linalg.norm(FIELD.points[3] - FIELD.points[8]))
    files["scale"] = [f'0 "Scale bar 1" 103 108 {length!r} 0.01 1']
    return files


def write_aicon(folder: Path, files: dict[str, list[str]]) -> Path:
    for suffix, lines in files.items():
        (folder / f"job.{suffix}").write_text("\n".join(lines) + "\n")
    return folder / "job.phc"


def test_aicons_network_is_read_without_residuals(tmp_path: Path) -> None:
    found = import_network(write_aicon(tmp_path, aicon_files()))
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.free_parameters == [["f_px", "cx_px", "cy_px", "a1", "a2", "b1", "b2"]]
    assert np.allclose(np.asarray(found.network.observations)[0, 6:8], [0.1, 0.2])
    ((start, end, length, sigma, used),) = found.network.distances
    assert length == pytest.approx(np.linalg.norm(FIELD.points[3] - FIELD.points[8])) and sigma == 1e-5 and used
    assert np.allclose(np.asarray(found.network.points_m), FIELD.points)
    text = "\n".join(found.notes)
    assert "1 points are not active and were left out: 999" in text and "1 image points are not active" in text


WRONG_AICON = [
    ("phc", 2, "1 102 x 1 1 1 0 0 1 1 1", "job.phc:3: field `x`: must be a finite number, got 'x'"),
    ("phc", 2, "1 102 1 1 0 1 0 0 1 1 1", "job.phc:3: field `sx`: must be positive, got '0'"),
    ("phc", 2, "1 102 1 1", "job.phc:3: must have at least 11 fields"),
    ("phc", 2, "1 101 1 1 1 1 0 0 1 1 1", "job.phc:3: point 101 occurs twice in image 1, first in line 2"),
    ("eor", 1, "2 7 1 2 3 0 0 0 0 307 3", "job.eor:2: field `camera`: must be one of 1, got '7'"),
    ("eor", 1, "2 1 1 2 3 0 0 0 5 307 3", "job.eor:2: field `order`: must be 0"),
    ("obc", 1, "100 1 2 3 0 0 0 0 1 1 0", "job.obc:2: point 100 occurs twice"),
    ("ior", 0, "1 -999 28.8 0 0 0 0 0", "job.ior:1: field `ck`: must be negative, got '28.8'"),
    ("ior", 4, "36.0 24.0 7200 0", "job.ior:5: field `rows`: must be at least 1, got '0'"),
    ("ior", 4, "", "job.ior:4: must be followed by all five lines of the camera, got 4"),
    ("scale", 0, '0 "bar" 103 777 1 0.01 1', "job.scale:1: field `to`: must be a point of the .obc file, got '777'"),
    ("scale", 0, "0 103 108 1 0.01 1", "job.scale:1: must be a number, a name in quotation marks"),
]


@pytest.mark.parametrize(("suffix", "line", "text", "complaint"), WRONG_AICON, ids=[w[3][:40] for w in WRONG_AICON])
def test_a_malformed_file_of_aicon_is_named(tmp_path: Path, suffix: str, line: int, text: str, complaint: str) -> None:
    files = aicon_files()
    files[suffix][line] = text
    with pytest.raises(ValueError) as raised:
        import_network(write_aicon(tmp_path, files))
    assert complaint in str(raised.value)


def test_names_in_the_encoding_of_windows_and_short_lines_are_read(tmp_path: Path) -> None:
    files = aicon_files()
    path = write_aicon(tmp_path, {**files, "obc": [" ".join(line.split()[:4]) for line in files["obc"][:-1]]})
    (tmp_path / "job.scale").write_bytes(files["scale"][0].replace("Scale bar", "Maßstab").encode("cp1252"))
    found = import_network(path)
    assert len(found.network.point_names) == 25 and len(found.network.distances) == 1
    (tmp_path / "job.obc").write_bytes("100 1 2 3\n".encode("utf-16"))
    with pytest.raises(ValueError, match=r"job\.obc:1: is encoded as UTF-16"):
        import_network(path)


def test_one_sigma_replaces_those_of_the_files(tmp_path: Path) -> None:
    files = aicon_files()
    files["phc"][0] = files["phc"][0].replace("0.0005 0.001", "0 0")
    path = write_aicon(tmp_path, files)
    with pytest.raises(ValueError, match="field `sx`: must be positive"):
        import_network(path)
    found = import_network(path, sigma_px=0.25)
    assert (np.asarray(found.network.observations)[:, 6:8] == 0.25).all()
    with pytest.raises(ValueError, match="sigma_px must be positive and finite, got -1"):
        import_network(path, sigma_px=-1)


def test_a_missing_file_of_aicon_is_named(tmp_path: Path) -> None:
    path = write_aicon(tmp_path, aicon_files())
    (tmp_path / "job.obc").unlink()
    with pytest.raises(FileNotFoundError, match=r"job\.obc"):
        import_network(path)


K1, K2, P1, P2, FOCAL = 4.6e-3, -4.5e-5, -6e-5, -4e-5, 7.46


def photomodeler_lines() -> list[str]:
    inner = f"{FOCAL} 3.6 2.6 7.2 5.4 {K1} {K2} 0 {P1} {P2}"
    sigmas = " ".join(["0"] * 10)
    lines = ["Bundle Soln PhotoModeler Project", " 0.0005 20 2400 1800", "1 1 1 1 1 1 1 1 1", inner, sigmas]
    marks = []
    for k, centre in enumerate(FIELD.centres):
        omega, phi, kappa = np.degrees(FIELD.angles[k])
        place = " ".join(repr(float(v)) for v in (*centre, kappa, phi, omega))
        lines += [f"  {k} C:\\my pictures\\im{k}.jpg", f"{k} {place}", f"{k} 0 0 0 0 0 0", ""]
        lines += [f"{k} {inner}", f"{k} {sigmas}"]
        # measured coordinates: fixed-point iteration of ideal = measured + correction(measured)
        ideal = FOCAL * FIELD.ideal(k).T
        at = ideal.copy()
        for _ in range(200):
            corrected = brown(*at, (K1, K2), 0, (P1, P2), (0, 0))
            at += ideal - np.array(corrected)
        px = (at[0] + 3.6) * 2400 / 7.2, (2.6 - at[1]) * 1800 / 5.4
        marks += [f"{k} {p + 1} {float(px[0][p])!r} {float(px[1][p])!r} 0.1 0.2" for p in range(len(FIELD.points))]
    lines += ["", "1 " + " ".join(repr(float(v)) for v in FIELD.points[0]) + " 0.001 0.002 0.003", ""]
    lines += [f"{p + 1} {' '.join(repr(float(v)) for v in at)} 0.1 0.1 0.1" for p, at in enumerate(FIELD.points)]
    return [*lines, "", *marks, "", "1 1 1", ""]


def test_photomodelers_network_is_read_without_residuals(tmp_path: Path) -> None:
    path = tmp_path / "export.txt"
    path.write_text("\n".join(photomodeler_lines()))
    found = import_network(path)
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.image_names[3] == "im3.jpg"
    ((target, at, matrix),) = found.network.control
    assert target == Target.point(0) and np.allclose(matrix, np.diag([1e-6, 4e-6, 9e-6]))
    assert found.datum.kind is occ.network.DatumKind.control
    known = tmp_path / "control.txt"
    known.write_text("# id, label, x, y, z\n2, a, 1, 2, 3\n5, b, 4, 5, 6, 0.5\n77, c, 0, 0, 0\n")
    controlled = import_network(path, control=known)
    assert [k for k, fixed in enumerate(controlled.network.points_fixed) if fixed] == [1]
    assert np.allclose(controlled.network.points_m[1], [1, 2, 3])
    assert len(controlled.network.control) == 2 and any("77" in note for note in controlled.notes)


def test_smart_points_of_photomodeler_are_left_out_and_named(tmp_path: Path) -> None:
    lines = photomodeler_lines()
    last = max(k for k, line in enumerate(lines) if line.startswith("25 "))
    lines.insert(last + 1, "3 9 9 9 0.1 0.1 0.1")
    mark = max(k for k, line in enumerate(lines) if line.startswith("5 25 "))
    lines.insert(mark + 1, "0 3 100 100 0 0")
    (tmp_path / "export.txt").write_text("\n".join(lines))
    found = import_network(tmp_path / "export.txt")
    assert len(found.network.point_names) == 25 and len(found.network.observations) == 150
    text = "\n".join(found.notes)
    assert "1 points with a number that occurs before (smart points) were left out: 3" in text
    assert "1 image points without a standard deviation were left out" in text


@pytest.mark.parametrize(("line", "text", "complaint"), [
    (1, "0.0005 20", ":2: has no image size"),
    (6, "0 1 2 3 4 5", ":7: must have 7 fields (picture, x, y, z, kappa, phi, omega), got 6"),
    (9, "0 7.46 a 2.6 7.2 5.4 0 0 0 0 0", ":10: field `xp`: must be a finite number, got 'a'"),
    (60, "1 2 3", "must have 7 fields (point, x, y, z, sx, sy, sz), got 3"),
])
def test_a_malformed_file_of_photomodeler_is_named(tmp_path: Path, line: int, text: str, complaint: str) -> None:
    lines = photomodeler_lines()
    lines[line] = text
    (tmp_path / "export.txt").write_text("\n".join(lines))
    with pytest.raises(ValueError) as raised:
        import_network(tmp_path / "export.txt")
    assert complaint in str(raised.value)


def bal_text(focal: float = 500.0) -> str:
    k1, k2 = -0.1, 0.02
    cameras, seen = [], []
    for k, (turn, centre) in enumerate(zip(FIELD.turns, FIELD.centres)):
        angle = np.arccos((np.trace(turn) - 1) / 2)
        world_from_cam = angle / (2 * np.sin(angle)) * np.array([
            turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1],
        ])
        cameras += [*(-world_from_cam), *(-turn.T @ centre), focal, k1, k2]
        p = FIELD.ideal(k)
        t = np.sum(p**2, axis=1, keepdims=True)
        px = focal * p * (1 + k1 * t + k2 * t**2)
        seen += [f"{k} {j} {float(x)!r} {float(y)!r}" for j, (x, y) in enumerate(px)]
    numbers = [*cameras, *FIELD.points.ravel()]
    return "\n".join([f"{len(FIELD.turns)} {len(FIELD.points)} {len(seen)}", *seen, *(repr(float(v)) for v in numbers)])


def test_a_problem_of_bal_is_read_without_residuals(tmp_path: Path) -> None:
    (tmp_path / "problem.txt.bz2").write_bytes(bz2.compress(bal_text().encode()))
    found = import_network(tmp_path / "problem.txt.bz2")
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.free_parameters[0] == ["f_px", "k1", "k2"] and len(found.network.cameras) == 6


@pytest.mark.parametrize(("old", "new", "complaint"), [
    ("6 25 150", "6 25 151", "must be a whole number"),
    ("0 1 ", "0 99 ", "problem.txt:3: field `point`: must be a whole number from 0 to 24, got 99"),
    ("0 1 ", "0 0 ", "problem.txt:3: point 0 occurs twice in image 0, first in line 2"),
    ("500.0", "-500.0", "field `f` of camera 0: must be positive, got -500"),
    ("500.0", "x", "field `f`: must be a finite number, got 'x'"),
])
def test_a_malformed_problem_of_bal_is_named(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    (tmp_path / "problem.txt").write_text(bal_text().replace(old, new, 1))
    with pytest.raises(ValueError) as raised:
        import_network(tmp_path / "problem.txt")
    assert complaint in str(raised.value)
    (tmp_path / "problem.txt").write_text("\n".join(bal_text().splitlines()[:-2]))
    with pytest.raises(ValueError, match="the file ends after 24 of 25 groups of x, y, z"):
        import_network(tmp_path / "problem.txt")


def colmap_model() -> tuple[list[tuple[int, str, list[float]]], list[tuple[list[float], int, np.ndarray]]]:
    """Cameras (number, name, parameters) and images (pose, camera, pixels)."""
    cameras = [
        (2, "SIMPLE_RADIAL", [500.0, 320.0, 240.0, -0.1]),
        (4, "OPENCV", [500.0, 510.0, 321.0, 239.0, -0.1, 0.02, 1e-3, -1e-3]),
        (5, "OPENCV_FISHEYE", [400.0, 401.0, 320.0, 240.0, 0.01, -0.02, 0.003, 0.0]),
    ]
    images = []
    for k, (turn, centre) in enumerate(zip(FIELD.turns, FIELD.centres)):
        cam_from_world = np.diag([1.0, -1, -1]) @ turn.T
        model = cameras[k % 3]
        x, y = FIELD.ideal(k).T * np.array([[1], [-1]])
        values = model[2]
        if model[1] == "SIMPLE_RADIAL":
            factor = 1 + values[3] * (x * x + y * y)
            px = np.array([values[0] * factor * x + values[1], values[0] * factor * y + values[2]])
        elif model[1] == "OPENCV":
            k1, k2, p1, p2 = values[4:]
            t = x * x + y * y
            factor = 1 + k1 * t + k2 * t * t
            px = np.array([values[0] * (factor * x + 2 * p1 * x * y + p2 * (t + 2 * x * x)) + values[2],
                           values[1] * (factor * y + 2 * p2 * x * y + p1 * (t + 2 * y * y)) + values[3]])
        else:
            r = np.hypot(x, y)
            a = np.arctan(r)
            scale = a * (1 + values[4] * a**2 + values[5] * a**4 + values[6] * a**6) / r
            px = np.array([values[0] * scale * x + values[2], values[1] * scale * y + values[3]])
        w = np.sqrt(max(0.0, 1 + np.trace(cam_from_world))) / 2
        quaternion = [w, *(np.array([
            cam_from_world[2, 1] - cam_from_world[1, 2], cam_from_world[0, 2] - cam_from_world[2, 0],
            cam_from_world[1, 0] - cam_from_world[0, 1]]) / (4 * w))]
        images.append(([*map(float, quaternion), *map(float, -cam_from_world @ centre)], k % 3 + 1, px.T))
    return cameras, images


def write_colmap(folder: Path, binary: bool) -> None:
    cameras, images = colmap_model()
    count = len(FIELD.points)
    if not binary:
        (folder / "cameras.txt").write_text("# cameras\n" + "".join(
            f"{k + 1} {name} 640 480 {' '.join(map(repr, values))}\n" for k, (_, name, values) in enumerate(cameras)))
        (folder / "images.txt").write_text("# images\n" + "".join(
            f"{k + 1} {' '.join(map(repr, at))} {camera} im {k}.png\n"
            + " ".join(f"{float(x)!r} {float(y)!r} {p + 10}" for p, (x, y) in enumerate(px)) + " 1 2 -1\n"
            for k, (at, camera, px) in enumerate(images)))
        (folder / "points3D.txt").write_text("".join(
            f"{p + 10} {' '.join(repr(float(v)) for v in at)} 0 0 0 0.5 1 0\n" for p, at in enumerate(FIELD.points)))
        return
    (folder / "cameras.bin").write_bytes(struct.pack("<Q", len(cameras)) + b"".join(
        struct.pack(f"<iiQQ{len(values)}d", k + 1, number, 640, 480, *values)
        for k, (number, _, values) in enumerate(cameras)))
    (folder / "images.bin").write_bytes(struct.pack("<Q", len(images)) + b"".join(
        struct.pack("<i7di", k + 1, *at, camera) + f"im {k}.png".encode() + b"\0" + struct.pack("<Q", count + 1)
        + b"".join(struct.pack("<ddq", x, y, p + 10) for p, (x, y) in enumerate(px)) + struct.pack("<ddq", 1, 2, -1)
        for k, (at, camera, px) in enumerate(images)))
    (folder / "points3D.bin").write_bytes(struct.pack("<Q", count) + b"".join(
        struct.pack("<Q3d3BdQii", p + 10, *at, 0, 0, 0, 0.5, 1, 1, 0) for p, at in enumerate(FIELD.points)))


@pytest.mark.parametrize("binary", [False, True])
def test_a_model_of_colmap_is_read_without_residuals(tmp_path: Path, binary: bool) -> None:
    write_colmap(tmp_path, binary)
    found = import_network(tmp_path)
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.free_parameters == [
        ["f_px", "k1"], ["fx_px", "fy_px", "k1", "k2", "p1", "p2"], ["fx_px", "fy_px", "k1", "k2", "k3", "k4"],
    ]
    assert found.network.image_names[2] == "im 2.png" and found.network.point_names[0] == "10"


def test_a_malformed_model_of_colmap_is_named(tmp_path: Path) -> None:
    write_colmap(tmp_path, False)
    cameras = (tmp_path / "cameras.txt").read_text()
    for old, new, complaint in (
        ("OPENCV_FISHEYE", "FOV", "cameras.txt:4: field `model`: must be one of SIMPLE_PINHOLE"),
        (" -0.1\n", "\n", "cameras.txt:2: field `parameters`: must be 4 (f, cx, cy, k1), got 3"),
        ("640", "x", "cameras.txt:2: field `width`: must be a whole number, got 'x'"),
    ):
        (tmp_path / "cameras.txt").write_text(cameras.replace(old, new, 1))
        with pytest.raises(ValueError) as raised:
            import_network(tmp_path)
        assert complaint in str(raised.value)
    write_colmap(tmp_path, True)
    content = (tmp_path / "images.bin").read_bytes()
    for size in (4, 30, 70, len(content) - 3):
        (tmp_path / "images.bin").write_bytes(content[:size])
        with pytest.raises(ValueError, match=r"images\.bin: byte \d+: the (file|name)"):
            import_network(tmp_path)
    (tmp_path / "points3D.bin").unlink()
    with pytest.raises(ValueError, match=r"has no points3D\.bin"):
        import_network(tmp_path)


KALIBR = """cam0:
  camera_model: pinhole
  distortion_model: radtan
  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.7e-05]
  intrinsics: [458.6, 457.3, 367.2, 248.4]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999, -0.0023, 0.0003, -0.11007]
  - [0.0023, 0.9999, -0.0141, 0.0004]
  - [-0.0003, 0.0141, 0.9999, -0.0008]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_model: equidistant
  distortion_coeffs: [0.01, -0.02, 0.003, 0.0]
  intrinsics: [457.6, 456.1, 379.9, 255.2]
  resolution: [752, 480]
  timeshift_cam_imu: 0.01
cam2:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, 0.2]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.2, 0.6, 300.0, 301.0, 375.0, 239.0]
  resolution: [752, 480]
"""


def test_kalibrs_cameras_are_mounts_of_a_rig(tmp_path: Path) -> None:
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR)
    found = import_network(path)
    n = found.network
    assert [camera.kind.name for camera in n.cameras] == ["pinhole", "fisheye", "double_sphere"]
    assert n.cameras[0].fx_px == 458.6 and n.cameras[2].parameters[4].value == -0.2
    assert n.mounts_fixed == [True, False, False] and n.mount_names == ["cam0", "cam1", "cam2"]
    assert np.allclose(n.mount_poses[2][:3, 3], [-0.11007 + 0.2, 0.0004, -0.0008])
    assert any("timeshift_cam_imu" in note for note in found.notes)
    for old, new, complaint in (
        ("resolution: [752, 480]", "resolution: [752]", "`cam0.resolution`: must be a list of 2 numbers"),
        ("radtan", "fov", "`cam0.distortion_model`: must be radtan, equidistant or none, got 'fov'"),
        ("[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.1, 1.0]", "`cam1.T_cn_cnm1`: must be 4 rows of 4 numbers"),
        ("458.6,", "-458.6,", "cam0`: fx_px must be positive"),
    ):
        path.write_text(KALIBR.replace(old, new, 1))
        with pytest.raises(ValueError) as raised:
            import_network(path)
        assert complaint in str(raised.value)


def test_a_target_of_kalibr_is_a_fixed_body(tmp_path: Path) -> None:
    path, target = tmp_path / "camchain.yaml", tmp_path / "target.yaml"
    path.write_text(KALIBR)
    grid = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n"
    target.write_text(grid)
    n = import_network(path, target=target).network
    assert n.body_names == ["target"] and n.bodies_fixed == [True]
    corners = np.asarray(n.body_corners_m[0])
    assert corners.shape == (120, 3)
    tag = corners[4 * 7:4 * 8]  # second row, second column
    assert np.allclose(tag[0], [0.088 * 1.3, 0.088 * 1.3, 0]) and np.allclose(tag[2] - tag[0], [0.088, 0.088, 0])
    target.write_text(
        "target_type: checkerboard\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.05\n")
    corners = np.asarray(import_network(path, target=target).network.body_corners_m[0])
    assert corners.shape == (42, 3) and np.allclose(corners[7], [0.05, 0.06, 0])
    for old, new, complaint in (
        ("'aprilgrid'", "circlegrid", "`target_type`: must be aprilgrid or checkerboard, got 'circlegrid'"),
        ("tagCols: 6", "tagCols: 0", "`tagCols`: must be a whole number, 1 or more, got 0"),
        ("tagSize: 0.088", "tagSize: -1", "`tagSize`: must be positive, got -1"),
    ):
        target.write_text(grid.replace(old, new))
        with pytest.raises(ValueError) as raised:
            import_network(path, target=target)
        assert complaint in str(raised.value)
    with pytest.raises(ValueError, match="target: must be omitted for the format aicon"):
        import_network(write_aicon(tmp_path, aicon_files()), target=target)


def test_the_command_writes_a_network_that_can_be_adjusted(tmp_path: Path) -> None:
    source = write_aicon(tmp_path, aicon_files())
    code, text, _ = run("import-network", source, "--out", tmp_path / "converted")
    assert code == 0 and text.startswith("aicon: 1 cameras, 6 images, 25 points, 150 observations, 1 distances")
    assert "note: AICON's files do not state" in text
    adjust = ("--no-robust", "--json", "--out")
    code, converted, _ = run("calibrate", "network", tmp_path / "converted/network.yaml", *adjust, tmp_path / "a")
    assert code == 0
    code, direct, _ = run("calibrate", "network", source, *adjust, tmp_path / "b")
    assert code == 0
    first, second = json.loads(converted), json.loads(direct)
    assert first["datum_defect"] == 6 and first["redundancy"] == second["redundancy"] == 301 - 7 - 36 - 75 + 6
    assert any("AICON's files" in warning for warning in second["warnings"])
    camera = occ.read_camera(tmp_path / "b/camera 1.yaml")
    sigmas = np.sqrt(np.diag(camera.parameter_covariance))
    assert camera.kind is occ.CameraKind.brown_forward and sigmas[0] > 0 and sigmas[1] == pytest.approx(sigmas[0])


def test_other_sources_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing\n")
    code, _, err = run("import-network", tmp_path / "notes.txt", "--out", tmp_path / "out")
    assert code == 2 and "is in none of the formats aicon, colmap, kalibr, dbat, photomodeler, bal" in err
    assert format_of(Path(__file__).parents[2] / "data/calibration/panorama/network.yaml") is None
    path = write_aicon(tmp_path, aicon_files())
    with pytest.raises(ValueError, match="control: must be omitted for the format aicon"):
        import_network(path, control="x")


# Values and standard deviations of AICON's report of its example.
AICON_REPORT = {
    "f_px": (28.78507, 2.513178e-4), "cx_px": (1.734892e-2, 3.441658e-4), "cy_px": (5.668731e-2, 3.262600e-4),
    "a1": (-1.096069e-4, 2.978787e-8), "a2": (1.495660e-7, 7.655524e-11), "b1": (5.798428e-6, 1.190972e-7),
    "b2": (-8.644540e-6, 1.043919e-7),
}


@pytest.mark.skipif(not (SHARED / "aicon").exists(), reason="needs the networks of other programs")
def test_aicons_example_gives_the_values_of_its_report() -> None:
    px_per_mm = np.array([8688 / 35.968, 5792 / 23.979])
    found = import_network(SHARED / "aicon/example.phc", sigma_px=0.0005 * px_per_mm[0])  # S0 a priori 0.0005 mm
    adjusted = occ.network.adjust(found.network)
    assert adjusted.ok and adjusted.rejected == []  # as in the report
    assert (adjusted.observations, adjusted.unknowns, adjusted.defect) == (19945, 1147, 6)
    assert adjusted.redundancy == 18804
    assert adjusted.sigma0 * 0.0005 == pytest.approx(0.000405, abs=1e-6)
    assert adjusted.sigma0 * 0.0005 * px_per_mm[0] == pytest.approx(0.098, abs=5e-4)
    known = occ.network.precision(adjusted.network).scaled(adjusted.sigma0**2)
    camera = adjusted.network.cameras[0]
    centre = np.array([(8688 - 1) / 2, (5792 - 1) / 2])
    values = {name: occ.network.free_parameter_value(camera, name).value for name in AICON_REPORT}
    values["f_px"] /= px_per_mm[0]
    values["cx_px"] = (values["cx_px"] - centre[0]) / px_per_mm[0]
    values["cy_px"] = (centre[1] - values["cy_px"]) / px_per_mm[1]
    values["b2"] = -values["b2"]
    units = dict.fromkeys(AICON_REPORT, 1.0) | {"f_px": px_per_mm[0], "cx_px": px_per_mm[0], "cy_px": px_per_mm[1]}
    for k, name in enumerate(adjusted.network.free_parameters[0]):
        value, sigma = AICON_REPORT[name]
        assert values[name] == pytest.approx(value, abs=0.25 * sigma), name
        assert np.sqrt(known.parameters(0)[k, k]) / units[name] == pytest.approx(sigma, rel=1e-3), name


@pytest.mark.skipif(not (SHARED / "aicon").exists(), reason="needs the networks of other programs")
def test_aicons_example_starts_from_its_images_alone(tmp_path: Path) -> None:
    reference = import_network(SHARED / "aicon/example.phc").network
    files = {name: content.decode().splitlines() for name, content in occ.network.network_files(reference).items()}
    files["images.csv"] = [",".join(line.split(",")[:2]) for line in files["images.csv"]]
    files["points.csv"] = [line.split(",")[0] for line in files["points.csv"]]
    for name, lines in files.items():
        (tmp_path / name).write_text("\n".join(lines) + "\n")
    plain = {"robust": False, "snooping": False}
    network, _ = occ.network.read_network(tmp_path / "network.yaml")  # 115 images, 150 points
    started, expected = occ.network.adjust(network, **plain), occ.network.adjust(reference, **plain)
    assert started.ok and started.redundancy == expected.redundancy
    assert started.cost == pytest.approx(expected.cost, rel=1e-6)


@pytest.mark.skipif(not (SHARED / "dbat").exists(), reason="needs the networks of other programs")
def test_dbats_example_gives_the_values_of_its_reports() -> None:
    dbat = SHARED / "dbat"
    plain = {"robust": False, "snooping": False}
    export = import_network(dbat / "camcal-pmexport.txt", control=dbat / "camcal-fixed.txt")
    found = occ.network.adjust(export.network, datum=export.datum, **plain)
    assert found.ok and (found.observations, found.unknowns, found.redundancy) == (4148, 423, 3725)
    camera = found.network.cameras[0]
    px_per_mm = 1704 / 5.43764
    known = occ.network.precision(found.network, export.datum).scaled(found.sigma0**2)
    assert camera.fy_px / px_per_mm == pytest.approx(7.45700, abs=0.5 * 0.00105)
    assert np.sqrt(known.parameters(0)[1, 1]) / px_per_mm == pytest.approx(0.00105, abs=5e-6)

    # DBAT minimises residuals of corrected coordinates: its sigma0 is that of our residuals on the ideal image.
    def ideal(pixel: np.ndarray) -> np.ndarray:
        bearing = np.asarray(camera.unproject(pixel))
        return np.array([camera.fx_px, camera.fy_px]) * bearing[:2] / bearing[2]

    total = 0.0
    steps = 1e-3 * np.eye(2)
    for row, residual in zip(np.asarray(found.network.observations), occ.network.image_residuals_px(found.network)):
        jacobian = np.stack([(ideal(row[4:6] + d) - ideal(row[4:6] - d)) / 2e-3 for d in steps], axis=1)
        total += float(np.sum((jacobian @ residual / 0.1) ** 2))
    assert np.sqrt(total / found.redundancy) == pytest.approx(1.6148, abs=2e-3)

    free = import_network(dbat / "camcal-pmexport.txt")
    assert occ.network.adjust(free.network, **plain).defect == 7


@pytest.mark.skipif(not (SHARED / "dbat").exists(), reason="needs the networks of other programs")
def test_a_script_of_dbat_gives_the_solution_of_its_export() -> None:
    dbat = SHARED / "dbat"
    script = import_network(dbat / "camcaldemo.xml")
    assert len(script.network.image_names) == 21 and sum(script.network.points_fixed) == 4
    plain = {"robust": False, "snooping": False}
    found = occ.network.adjust(script.network, datum=script.datum, **plain)
    export = import_network(dbat / "camcal-pmexport.txt", control=dbat / "camcal-fixed.txt")
    expected = occ.network.adjust(export.network, datum=export.datum, **plain)
    assert found.ok and expected.ok
    assert found.redundancy == expected.redundancy and found.sigma0 == pytest.approx(expected.sigma0, rel=1e-6)
