# SPDX-License-Identifier: Apache-2.0
"""Catalogue of hard cases: one YAML file per case; the keys are listed in `data/hard_cases/README.md`."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ... import samples
from ...yaml_files import Loader, parse_yaml, yaml_text
from . import clouds, triangles
from .views import View

FOLDER = samples.FOLDER / "hard_cases"
SCHEMA = "libocc-hard-case/1"
VERDICTS = ("solved", "refused", "either", "error")
GENERATORS: dict[str, Callable[..., View]] = {
    f.__name__: f
    for f in (
        triangles.ceiling, triangles.symmetric, triangles.danger_cylinder, triangles.line,
        triangles.in_plane, clouds.cloud, clouds.target, clouds.grazing, clouds.cube,
        clouds.mismatched, clouds.bad_input,
    )
}


@dataclass(frozen=True)
class Case:
    """A kind of degenerate or ill-conditioned problem, and the expected result of a correct solver."""

    name: str
    title: str
    why: str
    generator: str
    points: int
    seed: int
    count: int
    verdict: str
    slow_count: int = 1000
    reason: str = ""
    parameters: dict[str, Any] = field(default_factory=dict)
    sweep: dict[str, list[Any]] = field(default_factory=dict)
    truth: str = "view"
    tolerance_factor: float = 64.0

    def rows(self) -> list[tuple[str, dict[str, Any]]]:
        """Name and parameters of each value of the sweep; one row without a sweep."""
        if not self.sweep:
            return [("", self.parameters)]
        (key, values), = self.sweep.items()
        return [(f"{key}={value}", {**self.parameters, key: value}) for value in values]


class _Loader(Loader):
    """A duplicate key is an error."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        duplicate = [key for i, key in enumerate(keys) if key in keys[:i]]
        if duplicate:
            raise ValueError(f"key {duplicate[0]!r} is given twice")
        return dict(super().construct_mapping(node, deep=deep))


KINDS: dict[str, Any] = {
    "title": str, "why": str, "generator": str, "points": int, "seed": int, "count": int,
    "verdict": str, "slow_count": int, "reason": str, "parameters": dict, "sweep": dict,
    "truth": str, "tolerance_factor": (int, float),
}
REQUIRED = ("schema", "title", "why", "generator", "points", "seed", "count", "verdict")


def read_case(path: Path) -> Case:
    """Reads a case. Raises: OSError; ValueError naming file, key and value."""
    try:
        return _checked(path.stem, parse_yaml(yaml_text(path), _Loader))
    except ValueError as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from error


def _one_of(key: str, value: Any, known: Any) -> None:
    if value not in known:
        raise ValueError(f"{key}: {value!r} is not one of {', '.join(sorted(known))}")


def _checked(name: str, data: Any) -> Case:
    if not isinstance(data, dict):
        raise ValueError(f"must be a mapping of keys, got {data!r}")
    for key in REQUIRED:
        if key not in data:
            raise ValueError(f"{key}: is missing")
    schema = data.pop("schema")
    if schema != SCHEMA:
        raise ValueError(f"schema: {schema!r} is not {SCHEMA!r}")
    for key, value in data.items():
        _one_of("key", key, KINDS)
        if not isinstance(value, KINDS[key]) or isinstance(value, bool):
            kind = KINDS[key].__name__ if isinstance(KINDS[key], type) else "number"
            raise ValueError(f"{key}: {value!r} is not a {kind}")
    _one_of("verdict", data["verdict"], VERDICTS)
    _one_of("generator", data["generator"], GENERATORS)
    _one_of("truth", data.get("truth", "view"), ("view", "mate", "none"))
    for key in ("count", "slow_count"):
        if data.get(key, 1) < 1:
            raise ValueError(f"{key}: {data[key]} must be at least 1")
    for key in ("points", "seed"):
        if data[key] < 0:
            raise ValueError(f"{key}: {data[key]} must not be negative")
    if data["verdict"] == "either" and not data.get("reason"):
        raise ValueError("reason: is missing; verdict either requires it")
    _check_parameters(data)
    return Case(name=name, **data)


def _check_parameters(data: dict[str, Any]) -> None:
    generator = GENERATORS[data["generator"]]
    known = set(inspect.signature(generator).parameters) - {"rng", "points"}
    sweep = data.get("sweep", {})
    for key in data.get("parameters", {}):
        _one_of(f"parameters of {data['generator']}", key, known)
    for key, values in sweep.items():
        _one_of(f"sweep of {data['generator']}", key, known)
        if not isinstance(values, list) or not values:
            raise ValueError(f"sweep: {key}: {values!r} is not a list of values")
    if len(sweep) > 1:
        raise ValueError(f"sweep: one parameter at most, got {', '.join(sweep)}")


def catalogue(folder: Path = FOLDER) -> list[Case]:
    """All cases that come with libocc, by name."""
    found = [read_case(path) for path in sorted(folder.glob("*.yaml"))]
    if not found:
        raise OSError(f"{folder}: contains no hard cases")
    return found
