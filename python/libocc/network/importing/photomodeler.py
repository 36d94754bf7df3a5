# SPDX-License-Identifier: Apache-2.0
"""Networks of PhotoModeler (text export of the bundle solution), as DBAT reads them.

The file has a head of five lines, six lines for each picture, and blocks of control points, object points and image
points that end with a blank line. Pixels have the centre of the first pixel at (0, 0); cameras are in millimetres, with
the principal point measured from that pixel and y upwards. The distortion is a polynomial in measured coordinates
(libocc/camera/brown.hpp, brown_backward). Format: Boerlin, Damped Bundle Adjustment Toolbox, manual and loadpm
(github.com/niclasborlin/dbat).
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._core import Camera, Datum, DatumKind, Network, Target
from .aicon import cam_from_world, rotation
from .fields import Fields, Imported, lines_of, text_of

FREE = ("fx_px", "fy_px", "cx_px", "cy_px", "a1", "a2", "a3", "b1", "b2")
INNER = ("picture", "focal length", "xp", "yp", "format width", "format height", "K1", "K2", "K3", "P1", "P2")
OUTER = ("picture", "x", "y", "z", "kappa", "phi", "omega")
POINT = ("point", "x", "y", "z", "sx", "sy", "sz")
MARK = ("picture", "point", "x", "y", "sx", "sy")
TITLE = "Bundle Soln PhotoModeler"


def is_photomodeler(path: Path) -> bool:
    if path.suffix.lower() != ".txt":
        return False
    with open(path, "rb") as file:
        return b"PhotoModeler" in file.readline(200)


def read_control(path: Path) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64] | None]]:
    """Control points of DBAT: lines `id, label, x, y, z` and, if they have errors, `sx, sy, sz` or one sigma."""
    control: dict[str, tuple[NDArray[np.float64], NDArray[np.float64] | None]] = {}
    for line in lines_of(path, ","):
        line.require(("id", "label", "x", "y", "z"), more=True)
        name = line.text(0, "id")
        if name in control:
            raise ValueError(f"{line.where}: control point {name} occurs twice")
        if len(line) not in (5, 6, 8):
            raise ValueError(f"{line.where}: must have 5, 6 or 8 fields (id, label, x, y, z, sigmas), got {len(line)}")
        sigmas = None
        if len(line) > 5:
            sigmas = np.array([line.number(5 + (k if len(line) == 8 else 0), "sigma") for k in range(3)])
            if (sigmas < 0).any():
                raise line.fail("sigma", "zero or positive", line.text(5, "sigma"))
        control[name] = line.vector(2, ("x", "y", "z")), sigmas if sigmas is not None and (sigmas > 0).all() else None
    return control


class PhotoModelerReader:
    def __init__(self, path: Path, control_path: Path | None, sigma_px: float | None):
        self.path, self.sigma_px = path, sigma_px
        text = text_of(path)
        self.lines = [Fields(path, number, line.split()) for number, line in enumerate(text.splitlines(), 1)]
        self.at = 0
        self.control_path = control_path
        self.control = read_control(control_path) if control_path else {}
        self.network = Network()
        self.notes: list[str] = []
        self.images: dict[int, int] = {}
        self.points: dict[str, int] = {}
        self.has_errors = False

    def next(self, names: tuple[str, ...], *, more: bool = False) -> Fields:
        if self.at >= len(self.lines):
            raise ValueError(f"{self.path}:{len(self.lines)}: the file ends before the line with {', '.join(names)}")
        line = self.lines[self.at]
        self.at += 1
        line.require(names, more=more)
        return line

    def block(self, names: tuple[str, ...]) -> Iterator[Fields]:
        """Lines up to the next blank line."""
        while self.at < len(self.lines):
            line = self.lines[self.at]
            self.at += 1
            if not line.cells:
                return
            line.require(names)
            yield line

    def read_head(self) -> tuple[int, int]:
        self.at = 1  # after the title
        head = self.next(("tolerance", "iterations"), more=True)
        if len(head) < 4:
            raise ValueError(f"{head.where}: has no image size; add its columns and rows [px] at the end of the line")
        self.at = 5
        return head.integer(2, "columns", 1), head.integer(3, "rows", 1)

    def camera(self, line: Fields, size: tuple[int, int]) -> Camera:
        focal, xp, yp = (line.number(k, INNER[k]) for k in (1, 2, 3))
        px_per_mm = np.array(size) / [line.positive(4, INNER[4]), line.positive(5, INNER[5])]
        k1, k2, k3, p1, p2 = line.vector(6, INNER[6:])
        try:
            # The rows of libocc grow downwards: terms with an odd power of y change their sign.
            return Camera.brown_backward(
                width=size[0], height=size[1], fx_px=focal * px_per_mm[0], fy_px=focal * px_per_mm[1],
                cx_px=xp * px_per_mm[0], cy_px=yp * px_per_mm[1], distortion=[k1, k2, k3, p1, -p2, 0, 0],
                unit_px=px_per_mm[1],
            )
        except ValueError as error:
            raise ValueError(f"{line.where}: {error}") from None

    def read_images(self, size: tuple[int, int]) -> None:
        cameras: dict[tuple[str, ...], int] = {}
        names: set[str] = set()
        while self.at < len(self.lines) and self.lines[self.at].cells:
            title = self.next(("picture", "file"), more=True)
            number = title.integer(0, "picture", 0)
            if number in self.images:
                raise ValueError(f"{title.where}: picture {number} occurs twice")
            outer = self.next(OUTER)
            self.at += 2  # sigmas, covariances
            inner = self.next(INNER)
            self.at += 1  # sigmas
            values = tuple(inner.cells[1:])
            if values not in cameras:
                label = f"camera {len(cameras) + 1}"
                cameras[values] = self.network.add_camera(label, self.camera(inner, size), list(FREE))
            kappa, phi, omega = np.radians(outer.vector(4, OUTER[4:]))
            pose = cam_from_world(outer.vector(1, OUTER[1:4]), rotation(omega, phi, kappa))
            name = Path(" ".join(title.cells[1:]).replace("\\", "/")).name
            name = f"{number} {name}" if name in names else name
            names.add(name)
            self.images[number] = self.network.add_image(name, cameras[values], pose)
        self.at += 1

    def add_points(self) -> None:
        known = {line.text(0, "point"): (line, True) for line in self.block(POINT)}
        again = []  # smart points are counted from 1 again; their image points have no sigmas
        for line in self.block(POINT):
            name = line.text(0, "point")
            if name in known and not known[name][1]:
                again.append(name)
            known.setdefault(name, (line, False))
        if again:
            self.notes.append(f"{len(again)} points with a number that occurs before (smart points) were left out: "
                              f"{', '.join(again[:8])}")
        for name, (line, is_control) in known.items():
            position = line.vector(1, POINT[1:4])
            if name in self.control:
                position, sigmas = self.control[name]
            else:
                stated = line.vector(4, POINT[4:])
                sigmas = stated if (stated > 0).all() else None
                if not is_control:
                    self.points[name] = self.network.add_point(name, position)
                    continue
            self.points[name] = self.network.add_point(name, position, sigmas is None)
            if sigmas is not None:
                self.has_errors = True
                self.network.add_control(Target.point(self.points[name]), position, np.diag(sigmas**2))
        absent = [name for name in self.control if name not in self.points]
        if absent:
            self.notes.append(f"{self.control_path}: {len(absent)} control points are not in the network: "
                              f"{', '.join(absent[:8])}")

    def read_marks(self) -> None:
        unknown, without_sigma = 0, 0
        seen: dict[tuple[int, str], int] = {}
        for line in self.block(MARK):
            image, name = line.integer(0, "picture", 0), line.text(1, "point")
            at, sigma = line.vector(2, MARK[2:4]), line.vector(4, MARK[4:])
            if image not in self.images or name not in self.points:
                unknown += 1
                continue
            if not (sigma > 0).all():
                without_sigma += 1
                continue
            if self.sigma_px is not None:
                sigma = np.full(2, self.sigma_px)
            first = seen.setdefault((image, name), line.line)
            if first != line.line:
                raise ValueError(f"{line.where}: point {name} occurs twice in picture {image}, first in line {first}")
            self.network.observe(self.images[image], [Target.point(self.points[name])], at[None], sigma)
        if unknown:
            self.notes.append(f"{unknown} image points of pictures or points that are not in the network were left out")
        if without_sigma:
            self.notes.append(f"{without_sigma} image points without a standard deviation were left out")

    def datum(self) -> Datum:
        if self.has_errors or any(self.network.points_fixed):
            return Datum(kind=DatumKind.control)
        return Datum()


def read_photomodeler(
    path: str | Path, *, control: str | Path | None = None, sigma_px: float | None = None
) -> Imported:
    """Reads a text export of PhotoModeler, with pixels as unit of the image points' sigmas.

    control: file of DBAT with known points, which replace those of the export; points without sigmas are error-free.
    sigma_px: in place of the file's sigmas.
    Raises: OSError; ValueError naming file, line, field and value.
    """
    reader = PhotoModelerReader(Path(path), Path(control) if control else None, sigma_px)
    size = reader.read_head()
    reader.read_images(size)
    reader.add_points()
    reader.read_marks()
    reader.notes.append("the polygons and curves at the end of a PhotoModeler file are not read")
    return Imported(reader.network, reader.datum(), notes=reader.notes)
