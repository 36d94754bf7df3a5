# SPDX-License-Identifier: Apache-2.0
"""YAML files with the number format of libocc's C++ reader, and checks of their keys and values.

PyYAML reads `2e-5` as a string because YAML 1.1 requires a decimal point; libocc reads it as a number.
"""

import difflib
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import yaml


class Loader(yaml.SafeLoader):
    """Reads plain data only and accepts numbers such as `2e-5`."""


Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def parse_yaml(text: str) -> Any:
    """Parses YAML. Raises: ValueError with the line of a syntax error."""
    try:
        return yaml.load(text, Loader)
    except yaml.YAMLError as error:
        raise ValueError(f"is not valid YAML: {error}") from error


def read_yaml(path: str | Path) -> Any:
    """Reads a YAML file. Raises: OSError; ValueError naming the file."""
    try:
        return parse_yaml(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def suggestion(unknown: str, known: Sequence[str]) -> str:
    """Last part of an error message: the most similar known word, or all known words."""
    nearest = difflib.get_close_matches(unknown, known, 1, 0.6)
    return f"did you mean {nearest[0]}?" if nearest else f"allowed: {', '.join(known)}"


def refuse_unknown(keys: Iterable[str], known: Sequence[str], where: str) -> None:
    """Raises ValueError with the first key that is not in `known`."""
    for key in keys:
        if key not in known:
            raise ValueError(f"{where}: unknown key {key!r}; {suggestion(str(key), known)}")


def number(value: Any, name: str) -> float:
    """Value as a float. Raises: ValueError with `name` unless it is a finite number."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    raise ValueError(f"{name} must be a finite number, got {value!r}")
