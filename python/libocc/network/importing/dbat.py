# SPDX-License-Identifier: Apache-2.0
"""Scripts of DBAT, the Damped Bundle Adjustment Toolbox: an XML file that names tables of measurements.

Read are the cameras, the control points and the image points; poses and points start from resections of the control
points and intersections. Pixels have the centre of the first pixel at (0, 0). Format: Boerlin, Murtiyoso, Grussenmeyer,
"Implementation of a script-based bundle adjustment with DBAT", LC3D 2019, and github.com/niclasborlin/dbat.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ..._core import Camera, Datum, DatumKind, Network, Target, start_values
from ..tables import decoded
from .fields import Fields, Imported, lines_of

Element = ElementTree.Element
Control = dict[str, tuple[NDArray[np.float64], NDArray[np.float64] | None]]  # positions, sigmas
POINT_FIELDS = ("id", "label", "x", "y", "z", "sx", "sy", "sz", "sxy", "sxyz")
MARK_FIELDS = ("im", "id", "x", "y", "sx", "sy", "sxy")


def is_dbat(path: Path) -> bool:
    if path.suffix.lower() != ".xml":
        return False
    with open(path, "rb") as file:
        return b"dbat_script_version" in file.read(4096)


class Table:
    """A table of the script with the names of its fields."""

    def __init__(self, script: Path, element: Element, base: Path, known: tuple[str, ...], needed: tuple[str, ...]):
        text = (element.text or "").strip()
        self.fields = [name.strip() for name in element.get("format", "").split(",")]
        for name in self.fields:
            if name not in known:
                raise ValueError(f"{script}: attribute `format` of {text!r}: field {name!r} is unknown; allowed: "
                                 f"{', '.join(known)}")
        for name in needed:
            if name not in self.fields:
                raise ValueError(f"{script}: attribute `format` of {text!r}: has no field {name!r}")
        self.separator = element.get("sep", ",")
        self.path = base / text
        self.moved = not self.path.exists() and (script.parent / Path(text).name).exists()
        if self.moved:
            self.path = script.parent / Path(text).name

    def rows(self) -> list[Fields]:
        rows = list(lines_of(self.path, self.separator))
        for row in rows:
            row.require(self.fields)
        return rows

    def text(self, row: Fields, name: str) -> str:
        return row.text(self.fields.index(name), name)

    def numbers(self, row: Fields, *names: str) -> NDArray[np.float64]:
        return np.array([row.number(self.fields.index(name), name) for name in names])

    def sigmas(self, row: Fields, axes: tuple[str, ...], common: str) -> NDArray[np.float64] | None:
        """Standard deviations of the axes; None if the table has none."""
        names = [common] * len(axes) if common in self.fields else list(axes)
        if any(name not in self.fields for name in names):
            return None
        values = self.numbers(row, *names)
        if (values < 0).any():
            raise row.fail(names[0], "zero or positive", values.tolist())
        return values


class DbatReader:
    def __init__(self, path: Path, sigma_px: float | None):
        self.path, self.sigma_px = path, sigma_px
        try:
            root = ElementTree.fromstring(decoded(path, path.read_bytes()).encode())
        except ElementTree.ParseError as error:
            raise ValueError(f"{path}:{error.position[0]}: is not valid XML: {error}") from None
        found = root.find("input")
        if root.tag != "document" or found is None:
            raise ValueError(f"{path}: has no element `document/input`")
        self.input: Element = found
        self.base = self.folder(self.input.get("base_dir", "$HERE"))
        self.notes: list[str] = []

    def folder(self, text: str) -> Path:
        """A folder of the script; $DBAT and $HOME are not known and replaced by the script's folder."""
        here = self.path.parent
        for name in ("$HERE", "$DBAT", "$HOME"):
            text = text.replace(name, str(here))
        return here / text

    def element(self, parent: Element, name: str) -> Element:
        found = parent.find(name)
        if found is None:
            raise ValueError(f"{self.path}: has no element `{name}` in `{parent.tag}`")
        return found

    def value(self, camera: Element, name: str, count: int = 1, default: list[float] | None = None) -> list[float]:
        found = camera.find(name)
        if found is None and default is not None:
            return default
        text = (self.element(camera, name).text or "").strip()
        try:
            values = [float(cell) for cell in text.split(",")]
        except ValueError:
            values = []
        if len(values) != count or not np.isfinite(values).all():
            raise ValueError(f"{self.path}: element `{name}`: must be {count} numbers, got {text!r}")
        return values

    def table(self, name: str, known: tuple[str, ...], needed: tuple[str, ...]) -> Table | None:
        section = self.input.find(name)
        if section is None:
            return None
        table = Table(self.path, self.element(section, "file"), self.base, known, needed)
        if table.moved:
            self.notes.append(f"{table.path.name} was read from the script's folder")
        return table

    def camera(self) -> tuple[Camera, list[str]]:
        cameras = self.element(self.input, "cameras").findall("camera")
        if len(cameras) != 1:
            raise ValueError(f"{self.path}: element `cameras`: must have one camera, got {len(cameras)}")
        camera = cameras[0]
        (unit,) = [(self.element(camera, "unit").text or "").strip()]
        if unit != "mm":
            raise ValueError(f"{self.path}: element `unit`: must be mm, got {unit!r}")
        (model,) = self.value(camera, "model", default=[3])
        if model not in (2, 3):
            raise ValueError(f"{self.path}: element `model`: must be 2 or 3 (backward), got {model:g}")
        width, height = self.value(camera, "image", 2)
        if width < 1 or height < 1 or width % 1 or height % 1:
            raise ValueError(f"{self.path}: element `image`: must be two whole numbers, got {width:g},{height:g}")
        sensor = [cell.strip() for cell in (self.element(camera, "sensor").text or "").split(",")]
        try:
            height_mm = float(sensor[1])
        except (IndexError, ValueError):
            height_mm = 0.0
        if not height_mm > 0:
            raise ValueError(f"{self.path}: element `sensor`: must have a positive height, got {sensor}")
        (focal,), (aspect,) = self.value(camera, "focal"), self.value(camera, "aspect", default=[1.0])
        n_k, n_p = (int(self.value(camera, name, default=[0.0])[0]) for name in ("nK", "nP"))
        if not 0 <= n_k <= 3 or n_p not in (0, 2):
            raise ValueError(f"{self.path}: elements `nK` and `nP`: must be 0 to 3, and 0 or 2, got {n_k} and {n_p}")
        per_mm = height / height_mm
        lens = [f"a{k + 1}" for k in range(n_k)] + ["b1", "b2"][:n_p]
        try:
            made = Camera.brown_backward(
                width=int(width), height=int(height), fx_px=focal * per_mm / aspect, fy_px=focal * per_mm,
                cx_px=(width - 1) / 2, cy_px=(height - 1) / 2, distortion=[0.0] * 7, unit_px=per_mm,
            )
        except ValueError as error:
            raise ValueError(f"{self.path}: element `camera`: {error}") from None
        return made, ["fx_px", "fy_px", "cx_px", "cy_px", *lens]

    def read(self) -> Imported:
        camera, free = self.camera()
        control: Control = {}
        table = self.table("ctrl_pts", POINT_FIELDS, ("id", "x", "y", "z"))
        for row in table.rows() if table else []:
            assert table is not None
            name = table.text(row, "id")
            if name in control:
                raise ValueError(f"{row.where}: control point {name} occurs twice")
            control[name] = table.numbers(row, "x", "y", "z"), table.sigmas(row, ("sx", "sy", "sz"), "sxyz")
        if len(control) < 4:
            raise ValueError(f"{self.path}: needs four control points for start values, got {len(control)}")

        marks = self.table("image_pts", MARK_FIELDS, ("im", "id", "x", "y"))
        if marks is None:
            raise ValueError(f"{self.path}: has no element `image_pts` in `input`")
        names: dict[str, int] = {name: k for k, name in enumerate(control)}
        images: dict[str, int] = {}
        seen: list[dict[int, NDArray[np.float64]]] = []
        sigmas: list[dict[int, NDArray[np.float64]]] = []
        lines: dict[tuple[int, int], int] = {}
        for row in marks.rows():
            image = images.setdefault(marks.text(row, "im"), len(images))
            point = names.setdefault(marks.text(row, "id"), len(names))
            if image == len(seen):
                seen.append({})
                sigmas.append({})
            first = lines.setdefault((image, point), row.line)
            if first != row.line:
                raise ValueError(f"{row.where}: point {marks.text(row, 'id')} occurs twice in image "
                                 f"{marks.text(row, 'im')}, first in line {first}")
            sigma = marks.sigmas(row, ("sx", "sy"), "sxy")
            if self.sigma_px is not None:
                sigma = np.full(2, self.sigma_px)
            if sigma is not None and not (sigma > 0).all():
                raise row.fail("sxy", "positive", sigma.tolist())
            seen[image][point] = marks.numbers(row, "x", "y")
            sigmas[image][point] = np.ones(2) if sigma is None else sigma
        if self.sigma_px is None and not {"sx", "sxy"} & set(marks.fields):
            self.notes.append("the image points have no standard deviations: 1 px is assumed")
        return self.network(camera, free, control, names, images, seen, sigmas)

    def network(
        self, camera: Camera, free: list[str], control: Control,
        names: dict[str, int], images: dict[str, int], seen: list[dict[int, NDArray[np.float64]]],
        sigmas: list[dict[int, NDArray[np.float64]]],
    ) -> Imported:
        known = {names[name]: position for name, (position, _) in control.items()}
        poses, points = start_values([camera] * len(images), cast(Any, seen), cast(Any, known))
        network = Network()
        network.add_camera("camera", camera, free)
        indices: dict[int, int] = {}
        for name, k in names.items():
            if k not in points:
                continue
            sigma = control[name][1] if name in control else None
            fixed = name in control and (sigma is None or not (sigma > 0).all())
            indices[k] = network.add_point(name, points[k], fixed)
            if sigma is not None and not fixed:
                network.add_control(Target.point(indices[k]), points[k], np.diag(sigma**2))
        left_out = [name for name, k in images.items() if k not in poses]
        if left_out:
            self.notes.append(f"{len(left_out)} images have too few known points for a pose and were left out: "
                              f"{', '.join(left_out[:8])}")
        lost = [name for name, k in names.items() if k not in points]
        if lost:
            self.notes.append(f"{len(lost)} points are not visible from two directions and were left out: "
                              f"{', '.join(lost[:8])}")
        for name, k in images.items():
            if k in poses:
                image = network.add_image(name, 0, poses[k])
                for point in seen[k]:
                    if point in indices:
                        network.observe(image, [Target.point(indices[point])], seen[k][point][None], sigmas[k][point])
        self.notes.append("the operations and the output of the script are not used; the skew is kept zero")
        return Imported(network, Datum(kind=DatumKind.control), notes=self.notes)


def read_dbat(path: str | Path, *, sigma_px: float | None = None) -> Imported:
    """Reads a script of DBAT with its tables. sigma_px: in place of the tables' sigmas.

    Raises: OSError; ValueError naming file, line or element, and value.
    """
    return DbatReader(Path(path), sigma_px).read()
