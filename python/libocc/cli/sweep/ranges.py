# SPDX-License-Identifier: Apache-2.0
"""Values of a parameter in a sweep: a list, equal steps, or random draws."""

import math
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from ...yaml_files import suggestion

Rng = np.random.Generator
STEPS: dict[str, Callable[[float, float, int], Any]] = {"linear": np.linspace, "log": np.geomspace}
DRAWS: dict[str, Callable[[Rng, float, float, int], Any]] = {
    "uniform": lambda rng, low, high, count: rng.uniform(low, high, count),
    "log_uniform": lambda rng, low, high, count: np.exp(rng.uniform(np.log(low), np.log(high), count)),
    "normal": lambda rng, mean, sigma, count: rng.normal(mean, sigma, count),
}
KINDS = ("values", *STEPS, *DRAWS)


def values_of(path: str, given: Any, seed: int) -> list[Any]:
    """Values of a parameter.

    given: a list of values, or a mapping {KIND: [a, b], count: n, seed: draws only}.

    Raises: ValueError naming the parameter.
    """
    if isinstance(given, list):
        given = {"values": given}
    if not isinstance(given, dict):
        raise ValueError(f"parameters.{path} must be a list of values or a range, got {given!r}")
    kinds = [key for key in given if key in KINDS]
    allowed = {"values": ()}.get(kinds[0] if kinds else "", ("count", "seed"))
    for key in given:
        if key not in (*kinds, *allowed):
            raise ValueError(f"parameters.{path}: unknown key {key!r}; {suggestion(key, (*KINDS, *allowed))}")
    if len(kinds) != 1:
        raise ValueError(f"parameters.{path} must have one of {', '.join(KINDS)}")
    kind = kinds[0]
    if kind == "values":
        return _listed(path, given[kind])
    a, b = _ends(f"parameters.{path}.{kind}", given[kind], kind)
    count = whole_number(f"parameters.{path}.count", given.get("count"), 1)
    if kind in STEPS:
        if "seed" in given:
            raise ValueError(f"parameters.{path}.seed must be absent: {kind} steps are not random")
        return [float(v) for v in STEPS[kind](a, b, count)]
    own = whole_number(f"parameters.{path}.seed", given.get("seed", seed), 0)
    rng = np.random.Generator(np.random.Philox(key=[own, zlib.crc32(path.encode())]))
    return [float(v) for v in DRAWS[kind](rng, a, b, count)]


def _listed(path: str, values: Any) -> list[Any]:
    if not isinstance(values, list) or not values:
        raise ValueError(f"parameters.{path}.values must be a list of at least one value, got {values!r}")
    return values


def whole_number(name: str, value: Any, min_value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < min_value:
        raise ValueError(f"{name} must be a whole number not below {min_value}, got {value!r}")
    return value


def _ends(name: str, ends: Any, kind: str) -> tuple[float, float]:
    numbers = [v for v in ends if isinstance(v, (int, float)) and not isinstance(v, bool)] if (
        isinstance(ends, list)
    ) else []
    if len(numbers) != 2 or len(ends) != 2 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} must be two finite numbers, got {ends!r}")
    a, b = map(float, numbers)
    if kind == "normal":
        if b <= 0:
            raise ValueError(f"{name} must be [mean, sigma] with sigma positive, got {ends!r}")
    elif a == b or (kind in DRAWS and a > b):
        raise ValueError(f"{name} is an empty range, got {ends!r}")
    if kind.startswith("log") and (a <= 0 or b <= 0):
        raise ValueError(f"{name} must be positive, got {ends!r}")
    return a, b
