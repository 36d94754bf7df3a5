# SPDX-License-Identifier: Apache-2.0
"""One network in the formats of several programs, as files for the tests of the importers."""

import struct
from pathlib import Path

import numpy as np


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


DBAT = """<?xml version="1.0" encoding="UTF-8"?>
<document dbat_script_version="1.0.0">
  <input base_dir="$HERE">
    <ctrl_pts><file format="id,label,x,y,z,sxyz">measured/control.txt</file></ctrl_pts>
    <image_pts><file format="im,id,x,y,sxy">measured/marks.txt</file></image_pts>
    <cameras><camera>
      <id>1</id><name>A camera</name><unit>mm</unit><sensor>auto,5.4</sensor><image>2400,1800</image>
      <aspect>1</aspect><focal>7.5</focal><model>3</model><nK>2</nK><nP>2</nP>
    </camera></cameras>
  </input>
  <operations><operation>bundle_adjustment</operation></operations>
</document>
"""


def write_dbat(folder: Path) -> Path:
    """A script whose control points are the first six points, two of them error-free."""
    measured = folder / "measured"
    measured.mkdir(exist_ok=True)
    control = [f"{k + 1}, P{k + 1}, {', '.join(repr(float(v)) for v in FIELD.points[k])}, {0.001 if k > 1 else 0}"
               for k in range(6)]
    (measured / "control.txt").write_text("# id, label, x, y, z, sigma\n" + "\n".join(control) + "\n")
    lines = photomodeler_lines()
    first = next(k for k, line in enumerate(lines) if line.startswith("0 1 "))
    marks = [line.split() for line in lines[first:first + 150]]
    (measured / "marks.txt").write_text("".join(f"{im}, {p}, {x}, {y}, 0.1\n" for im, p, x, y, _, _ in marks))
    script = folder / "job.xml"
    script.write_text(DBAT)
    return script


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
