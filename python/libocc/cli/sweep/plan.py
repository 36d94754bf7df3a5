# SPDX-License-Identifier: Apache-2.0
"""Reading and checking of sweep files."""

import itertools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import samples
from ..._core import Scene, plan_render
from ...yaml_files import parse_yaml, read_yaml, refuse_unknown, suggestion
from ..dataset.images import check_format
from ..poses import pose_of
from .paths import set_path
from .ranges import values_of, whole_number

SCHEMA = "libocc-sweep/1"
KEYS = ("schema", "scene", "pose", "parameters", "combine", "images", "seed", "keep", "format")
KEEPS = ("images", "truth", "detect", "locate", "time")


@dataclass(frozen=True)
class Sweep:
    base: str  # scene and pose as JSON, without the parameters
    parameters: dict[str, list[Any]]  # values by path
    combine: str
    images: int
    seed: int
    keep: tuple[str, ...]
    image_format: str

    def values(self) -> list[tuple[Any, ...]]:
        """Parameter values of each point; the last parameter varies fastest."""
        if self.combine == "zip":
            return list(zip(*self.parameters.values(), strict=True))
        return list(itertools.product(*self.parameters.values()))


def scene_and_pose(base: str, values: dict[str, Any]) -> tuple[Scene, Any]:
    """Scene and pose of a point. Raises: ValueError naming path and value."""
    data = json.loads(base)
    for path, value in values.items():
        set_path(data, path, value)
    pose = pose_of(data.pop("pose"))
    try:
        return Scene.parse(json.dumps(data)), pose  # JSON is YAML too
    except ValueError as error:
        where, _, reason = str(error).partition(": ")
        raise ValueError(reason if where.startswith("<text>") else str(error)) from error


def check_point(base: str, values: dict[str, Any]) -> None:
    """Checks that a point can be rendered. Raises: ValueError naming path and value."""
    scene, pose = scene_and_pose(base, values)
    plan_render(scene, pose)


def read_sweep(path: str) -> Sweep:
    """Reads a sweep file. Raises: OSError; ValueError naming file and key."""
    data = read_yaml(path)
    try:
        return _sweep_of(data, Path(path).parent)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _sweep_of(data: Any, folder: Path) -> Sweep:
    if not isinstance(data, dict):
        raise ValueError(f"must be a mapping with {', '.join(KEYS)}")
    refuse_unknown(data, KEYS, "sweep")
    if data.get("schema") != SCHEMA:
        raise ValueError(f"schema must be {SCHEMA}, got {data.get('schema')!r}")
    pose, parameters = data.get("pose"), data.get("parameters")
    if not isinstance(pose, dict):
        raise ValueError(f"pose must be a mapping with position_m, got {pose!r}")
    if not isinstance(parameters, dict) or not parameters:
        raise ValueError(f"parameters must be a mapping of at least one path, got {parameters!r}")
    seed = whole_number("seed", data.get("seed", 0), 0)
    sweep = Sweep(
        base=json.dumps({**_scene_data(data.get("scene"), folder), "pose": pose}, default=str),
        parameters={str(p): values_of(str(p), values, seed) for p, values in parameters.items()},
        combine=_word("combine", data.get("combine", "grid"), ("grid", "zip")),
        images=whole_number("images", data.get("images", 1), 1),
        seed=seed,
        keep=_keep(data.get("keep", ["images"])),
        image_format=str(data.get("format", "png")),
    )
    check_format(sweep.image_format)
    _check_values(sweep)
    return sweep


def _scene_data(name: Any, folder: Path) -> dict[str, Any]:
    """Content of the scene file, so that every key of the file can be set."""
    if not isinstance(name, str):
        raise ValueError(f"scene must be a file or the name of a scene that comes with libocc, got {name!r}")
    beside = folder / name
    path = beside if beside.exists() else samples.find_scene(name)
    scene = Scene.load(path)
    data: dict[str, Any] = read_yaml(path)
    if "file" in data["camera"]:  # relative to the scene
        data["camera"] = parse_yaml(scene.format())["camera"]
    for lamp in data["lamps"]:
        if "photometry" in lamp:  # so is this
            named = lamp["photometry"]
            file = named["file"] if isinstance(named, dict) else named
            lamp["photometry"] = {"file": str((path.parent / str(file)).absolute())}
    return data


def _word(name: str, value: Any, known: tuple[str, ...]) -> str:
    if value not in known:
        raise ValueError(f"{name}: unknown {value!r}; {suggestion(str(value), known)}")
    return str(value)


def _keep(names: Any) -> tuple[str, ...]:
    if not isinstance(names, list) or not names:
        raise ValueError(f"keep must be a list of some of {', '.join(KEEPS)}, got {names!r}")
    return tuple(_word("keep", word, KEEPS) for word in names)


def _check_values(sweep: Sweep) -> None:
    """Checks the numbers of values, and each value of a grid together with the first values of the other parameters."""
    counts = {path: len(values) for path, values in sweep.parameters.items()}
    if sweep.combine == "zip" and len(set(counts.values())) > 1:
        raise ValueError(f"combine: zip requires the same number of values for each parameter, got {counts}")
    if sweep.combine == "zip":
        return  # values of different points need not be compatible
    first = {path: values[0] for path, values in sweep.parameters.items()}
    for path, values in sweep.parameters.items():
        for value in values:
            try:
                check_point(sweep.base, {**first, path: value})
            except ValueError as error:
                raise ValueError(f"parameters.{path}: {value!r}: {error}") from error
