# SPDX-License-Identifier: Apache-2.0
"""Networks of AICON 3D Studio: flat files .ior, .eor, .obc, .phc and .scale with the same stem.

Lengths are in millimetres, image coordinates in millimetres on the sensor from its centre with y upwards. The meaning
of the columns: Loesler, JAICOV, example with AICON's flat files (github.com/applied-geodesy/bundle-adjustment, wiki).
The rotation is R = R_x(omega) R_y(phi) R_z(kappa) from the camera (x right, y up, z backwards) to the object; the
distortion is a polynomial in ideal coordinates (libocc/camera/brown.hpp, brown_forward).
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._core import Camera, Network, Target
from .fields import Fields, Imported, lines_of

MM = 1e-3
SUFFIXES = (".ior", ".eor", ".obc", ".phc", ".scale")
EOR = ("image", "camera", "x", "y", "z", "omega", "phi", "kappa", "order", "active", "state")
FREE = ("f_px", "cx_px", "cy_px", "a1", "a2", "a3", "b1", "b2")


def main_file(path: Path) -> Path:
    """The only .phc file of a folder; other paths as they are."""
    files = sorted(path.glob("*.[pP][hH][cC]")) if path.is_dir() else []
    return files[0] if len(files) == 1 else path


def is_aicon(path: Path) -> bool:
    return main_file(path).suffix.lower() in SUFFIXES


class AiconCamera:
    """A camera of a .ior file; converts image coordinates to pixels."""

    def __init__(self, head: Fields, rest: list[Fields]):
        self.name = head.text(0, "camera")
        ck = head.number(2, "ck")
        if not ck < 0:
            raise head.fail("ck", "negative", head.text(2, "ck"))
        principal = head.vector(3, ("xh", "yh"))
        a1, a2 = head.vector(5, ("A1", "A2"))
        r0 = head.number(7, "R0")
        a3 = rest[0].number(0, "A3")
        b1, b2 = rest[1].vector(0, ("B1", "B2"))
        c1, c2 = rest[2].vector(0, ("C1", "C2"))
        sensor = rest[3]
        size_mm = np.array([sensor.positive(0, "sensor width"), sensor.positive(1, "sensor height")])
        size_px = [sensor.integer(2, "columns", 1), sensor.integer(3, "rows", 1)]
        self.px_per_mm = np.array(size_px) / size_mm
        self.centre_px = (np.array(size_px) - 1) / 2
        self.ck, self.a3 = ck, a3
        focal = -ck * self.px_per_mm
        at = self.pixel(principal)
        try:
            # The rows of libocc grow downwards: terms with an odd power of y change their sign.
            self.model = Camera.brown_forward(
                width=size_px[0], height=size_px[1], fx_px=focal[0], fy_px=focal[1], cx_px=at[0], cy_px=at[1],
                distortion=[a1, a2, a3, b1, -b2, c1, -c2], unit_px=self.px_per_mm[0], r0=r0,
            )
        except ValueError as error:
            raise ValueError(f"{head.where}: camera {self.name}: {error}") from None

    def pixel(self, image_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self.centre_px + self.px_per_mm * image_mm * [1, -1])


def read_cameras(path: Path) -> dict[str, AiconCamera]:
    lines = list(lines_of(path))
    if not lines:
        raise ValueError(f"{path}:1: must have five lines for each camera, got none")
    cameras: dict[str, AiconCamera] = {}
    names = (
        ("camera", "internal", "ck", "xh", "yh", "A1", "A2", "R0"), ("A3",), ("B1", "B2"), ("C1", "C2"),
        ("sensor width", "sensor height", "columns", "rows"),
    )
    for first in range(0, len(lines), 5):
        block = lines[first:first + 5]
        if len(block) < 5:
            raise ValueError(f"{block[-1].where}: must be followed by all five lines of the camera, got {len(block)}")
        for line, fields in zip(block, names):
            line.require(fields, more=True)
        camera = AiconCamera(block[0], block[1:])
        if camera.name in cameras:
            raise ValueError(f"{block[0].where}: camera {camera.name} occurs twice")
        cameras[camera.name] = camera
    return cameras


def rotation(omega: float, phi: float, kappa: float) -> NDArray[np.float64]:
    """R_x(omega) R_y(phi) R_z(kappa): Luhmann et al., Close-Range Photogrammetry, 3rd ed., eq. 2.30."""
    (co, cp, ck), (so, sp, sk) = np.cos([omega, phi, kappa]), np.sin([omega, phi, kappa])
    return np.array([
        [cp * ck, -cp * sk, sp],
        [co * sk + so * sp * ck, co * ck - so * sp * sk, -so * cp],
        [so * sk - co * sp * ck, so * ck + co * sp * sk, co * cp],
    ])


def cam_from_world(position_m: NDArray[np.float64], world_from_image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pose of a camera whose image axes are x right, y up and z backwards."""
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1.0, -1.0, -1.0]) @ world_from_image.T
    pose[:3, 3] = -pose[:3, :3] @ position_m
    return pose


class AiconReader:
    def __init__(self, path: Path, sigma_px: float | None):
        self.sigma_px = sigma_px
        self.stem = path.with_suffix("")
        self.network = Network()
        self.notes: list[str] = []
        self.points: dict[str, int] = {}
        self.images: dict[str, tuple[int, AiconCamera]] = {}
        self.lines: dict[tuple[str, str], int] = {}

    def file(self, suffix: str) -> Path:
        """The file with this suffix in lower or upper case."""
        upper = self.stem.with_suffix(suffix.upper())
        lower = self.stem.with_suffix(suffix)
        return upper if upper.exists() and not lower.exists() else lower

    def read_points(self) -> None:
        left_out = []
        for line in lines_of(self.file(".obc")):
            line.require(("point", "x", "y", "z"), more=True)
            name = line.text(0, "point")
            if len(line) >= 11 and line.integer(8, "active") == 0:  # after sx, sy, sz and the number of images
                left_out.append(name)
                continue
            if name in self.points:
                raise ValueError(f"{line.where}: point {name} occurs twice")
            self.points[name] = self.network.add_point(name, MM * line.vector(1, ("x", "y", "z")))
        if left_out:
            self.notes.append(f"{len(left_out)} points are not active and were left out: {', '.join(left_out[:8])}")

    def read_images(self) -> None:
        cameras = read_cameras(self.file(".ior"))
        indices: dict[str, int] = {}
        left_out = []
        for line in lines_of(self.file(".eor")):
            line.require(EOR, more=True)
            name, camera_name = line.text(0, "image"), line.text(1, "camera")
            if line.integer(9, "active") == 0 or line.integer(10, "state") == 1:
                left_out.append(name)
                continue
            if line.integer(8, "order") != 0:
                raise line.fail("order", "0 (omega, phi, kappa about moving axes)", line.text(8, "order"))
            if camera_name not in cameras:
                raise line.fail("camera", f"one of {', '.join(cameras)}", camera_name)
            if name in self.images:
                raise ValueError(f"{line.where}: image {name} occurs twice")
            camera = cameras[camera_name]
            if camera_name not in indices:
                free = [p for p in FREE if p != "a3" or camera.a3 != 0]
                indices[camera_name] = self.network.add_camera(f"camera {camera_name}", camera.model, free)
            turn = rotation(*line.vector(5, ("omega", "phi", "kappa")))
            pose = cam_from_world(MM * line.vector(2, ("x", "y", "z")), turn)
            self.images[name] = self.network.add_image(name, indices[camera_name], pose), camera
        if left_out:
            self.notes.append(f"{len(left_out)} images are not active or oriented and were left out: "
                              f"{', '.join(left_out[:8])}")
        self.notes.append("AICON's files do not state which parameters of a camera are fixed: C1 and C2 are kept, "
                          "and A3 if it is zero")

    def read_observations(self) -> None:
        inactive, unknown = 0, 0
        sigma = np.ones(2)
        for line in lines_of(self.file(".phc")):
            line.require(("image", "point", "x", "y", "sx", "sy", "vx", "vy", "method", "active", "code"), more=True)
            image, point = line.text(0, "image"), line.text(1, "point")
            if line.integer(9, "active") == 0:
                inactive += 1
                continue
            at = line.vector(2, ("x", "y"))
            if self.sigma_px is None:
                sigma = np.array([line.positive(4, "sx"), line.positive(5, "sy")])
            if image not in self.images or point not in self.points:
                unknown += 1
                continue
            first = self.lines.setdefault((image, point), line.line)
            if first != line.line:
                raise ValueError(f"{line.where}: point {point} occurs twice in image {image}, first in line {first}")
            index, camera = self.images[image]
            self.network.observe(
                index, [Target.point(self.points[point])], camera.pixel(at)[None],
                sigma * camera.px_per_mm if self.sigma_px is None else self.sigma_px,
            )
        if inactive:
            self.notes.append(f"{inactive} image points are not active and were left out")
        if unknown:
            self.notes.append(f"{unknown} image points of images or points that are not in the network were left out")

    def read_scales(self) -> None:
        path = self.file(".scale")
        if not path.exists():
            return
        for line in lines_of(path):
            # number "name" from to length sigma active; the name may have blanks
            found = re.fullmatch(r'\s*\S+\s+"([^"]*)"\s+(.*)', " ".join(line.cells))
            if not found:
                raise ValueError(f'{line.where}: must be a number, a name in quotation marks, and the bar\'s fields')
            bar = Fields(path, line.line, found[2].split())
            bar.require(("from", "to", "length", "sigma", "active"))
            if bar.integer(4, "active") == 0:
                self.notes.append(f"scale bar {found[1]} is not active and was left out")
                continue
            ends = []
            for k, field in enumerate(("from", "to")):
                if bar.text(k, field) not in self.points:
                    raise bar.fail(field, "a point of the .obc file", bar.text(k, field))
                ends.append(Target.point(self.points[bar.text(k, field)]))
            start, end = ends
            self.network.add_distance(start, end, MM * bar.positive(2, "length"), MM * bar.positive(3, "sigma"))


def read_aicon(path: str | Path, *, sigma_px: float | None = None) -> Imported:
    """Reads a network of AICON 3D Studio; path: any of its files, or a folder with one network.

    sigma_px: standard deviation of all image points, in place of those of the file.

    Raises: OSError; ValueError naming file, line, field and value.
    """
    reader = AiconReader(main_file(Path(path)), sigma_px)
    reader.read_points()
    reader.read_images()
    reader.read_observations()
    reader.read_scales()
    if sigma_px is None:
        reader.notes.append("the sigmas are those of the image points' measurement; AICON's adjustment may use one for "
                            "all, the S0 a priori of its report (sigma_px)")
    return Imported(reader.network, notes=reader.notes)
