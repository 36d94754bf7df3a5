# SPDX-License-Identifier: Apache-2.0
"""YAML as libocc's C++ side reads it, where `2e-5` is a number; PyYAML takes it for a text."""

import difflib
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import yaml


class Loader(yaml.SafeLoader):
    """Plain data only."""


Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def parse_yaml(text: str) -> Any:
    """Raises: ValueError with the line when it is no YAML."""
    try:
        return yaml.load(text, Loader)
    except yaml.YAMLError as error:
        raise ValueError(f"is no YAML: {error}") from error


def read_yaml(path: str | Path) -> Any:
    """Raises: OSError; ValueError naming the file."""
    try:
        return parse_yaml(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def suggestion(unknown: str, known: Sequence[str]) -> str:
    """The end of a sentence: the nearest known word, or all of them."""
    nearest = difflib.get_close_matches(unknown, known, 1, 0.6)
    return f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(known)}"


def refuse_unknown(keys: Iterable[str], known: Sequence[str], where: str) -> None:
    """Raises: ValueError naming the first key that is not known."""
    for key in keys:
        if key not in known:
            raise ValueError(f"{where}: unknown key {key!r}; {suggestion(str(key), known)}")


def number(value: Any, name: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    raise ValueError(f"{name} must be a finite number, got {value!r}")
