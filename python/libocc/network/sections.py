# SPDX-License-Identifier: Apache-2.0
"""Parts of a network file: schema and keys, sections of its YAML file, and names of elements."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SCHEMA = "libocc-network/1"
KEYS = (
    "schema", "cameras", "stations", "mounts", "images", "points", "shapes", "bodies", "observations", "distances",
    "control", "priors", "pose_priors", "datum", "check_points",
)
POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
SIGMA_PX = 0.5  # default of the tables


class Section:
    """A mapping in the file; its errors name file, key and value."""

    def __init__(self, path: Path, name: str, data: Any, known: tuple[str, ...]):
        self.path, self.name, self.data = path, name, data
        if not isinstance(data, dict):
            raise ValueError(f"{path}: key `{name}`: must be a mapping, got {data!r}")
        for key in data:
            if key not in known:
                raise ValueError(f"{path}: key `{self.full(key)}`: is unknown; allowed: {', '.join(known)}")

    def full(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def fail(self, key: str, rule: str) -> ValueError:
        return ValueError(f"{self.path}: key `{self.full(key)}`: must be {rule}, got {self.data.get(key)!r}")

    def has(self, key: str) -> bool:
        return self.data.get(key) is not None

    def one_of(self, *keys: str) -> str:
        """The key of these that is given. Raises: ValueError unless it is exactly one."""
        given = [key for key in keys if self.has(key)]
        if len(given) != 1:
            raise ValueError(
                f"{self.path}: key `{self.name}`: must have one of {', '.join(keys)}, got {', '.join(given) or 'none'}"
            )
        return given[0]

    def text(self, key: str) -> str:
        value = self.data.get(key)
        if not isinstance(value, (str, int)) or value == "":
            raise self.fail(key, "a text")
        return str(value)

    def number(self, key: str) -> float:
        value = self.data.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise self.fail(key, "a finite number")
        return float(value)

    def positive(self, key: str) -> float:
        value = self.number(key)
        if not value > 0:
            raise self.fail(key, "positive")
        return value

    def vector(self, key: str, size: int) -> NDArray[np.float64]:
        try:
            vector = np.asarray(self.data.get(key), dtype=float)
        except (TypeError, ValueError):
            raise self.fail(key, f"a list of {size} numbers") from None
        if vector.shape != (size,) or not np.isfinite(vector).all():
            raise self.fail(key, f"a list of {size} numbers")
        return vector

    def sigmas(self, key: str) -> NDArray[np.float64]:
        """Three standard deviations, given as one number for all axes or as a list of three."""
        value = self.data.get(key)
        sigmas = self.vector(key, 3) if isinstance(value, list) else np.full(3, self.number(key))
        if not (sigmas > 0).all():
            raise self.fail(key, "positive")
        return sigmas

    def covariance(self, key: str, size: int) -> NDArray[np.float64]:
        """Covariance matrix, a list of rows or of all numbers row by row."""
        rule = f"a symmetric positive definite matrix of {size} rows of {size} numbers"
        try:
            matrix = np.asarray(self.data.get(key), dtype=float)
        except (TypeError, ValueError):
            raise self.fail(key, rule) from None
        if matrix.shape == (size * size,):
            matrix = matrix.reshape(size, size)
        if matrix.shape != (size, size) or not np.isfinite(matrix).all() or not (np.diag(matrix) > 0).all():
            raise self.fail(key, rule)
        scale = np.sqrt(np.diag(matrix))
        correlations = matrix / np.outer(scale, scale)
        symmetric = np.allclose(correlations, correlations.T, rtol=0, atol=1e-9)
        if not symmetric or not np.linalg.eigvalsh((correlations + correlations.T) / 2)[0] > 0:
            raise self.fail(key, rule)
        return np.asarray((matrix + matrix.T) / 2, dtype=float)

    def texts(self, key: str) -> list[str]:
        value = self.data.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, (str, int)) for item in value):
            raise self.fail(key, "a list of names")
        return [str(item) for item in value]

    def sections(self, key: str, known: tuple[str, ...]) -> list["Section"]:
        value = self.data.get(key) or []
        if not isinstance(value, list):
            raise self.fail(key, "a list")
        return [Section(self.path, f"{self.full(key)}[{i}]", item, known) for i, item in enumerate(value)]


class Names:
    """Indices by name; raises ValueError for a duplicate or unknown name."""

    def __init__(self, kind: str):
        self.kind = kind
        self.indices: dict[str, int] = {}
        self.places: dict[str, str] = {}

    def add(self, name: str, index: int, where: str) -> None:
        if name in self.indices:
            raise ValueError(f"{where}: {self.kind} {name!r} occurs twice, first at {self.places[name]}")
        self.indices[name] = index
        self.places[name] = where

    def find(self, name: str, where: str) -> int:
        if name not in self.indices:
            known = ", ".join(list(self.indices)[:8]) or "none"
            raise ValueError(f"{where}: no {self.kind} is named {name!r}; existing names: {known}")
        return self.indices[name]
