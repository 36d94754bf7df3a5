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

MAX_BYTES = 4 << 20  # as in the C++ reader
MAX_LEVELS = 16  # as in the C++ reader; an experiment has 6 levels
MAX_VALUES = 100_000  # PyYAML reads them in about 2 s; a scene of 5000 lamps


class Loader(yaml.SafeLoader):
    """Reads plain data only, within limits, and accepts numbers such as `2e-5`."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._levels = self._values = 0
        self._values_of: dict[Any, int] = {}  # by anchor, of the nodes that are complete

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Next node of the tree. Each use of an alias counts as all values that it stands for."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.CollectionStartEvent) and self._levels >= MAX_LEVELS:
            raise _refusal(event, f"must be nested {MAX_LEVELS} levels deep at most")
        before = self._values
        if isinstance(event, yaml.AliasEvent):
            if event.anchor in self.anchors and event.anchor not in self._values_of:
                raise _refusal(event, f"*{event.anchor} must not be used inside &{event.anchor}")
            self._values += self._values_of.get(event.anchor, 0)
        else:
            self._values += 1
        if self._values > MAX_VALUES:
            raise _refusal(event, f"must have {MAX_VALUES} values at most")
        self._levels += 1
        node = super().compose_node(parent, index)
        self._levels -= 1
        if not isinstance(event, yaml.AliasEvent) and event.anchor is not None:
            self._values_of[event.anchor] = self._values - before
        return node


def _refusal(event: Any, reason: str) -> ValueError:
    return ValueError(f"line {event.start_mark.line + 1}: {reason}")


Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def parse_yaml(text: str, loader: type[Loader] = Loader) -> Any:
    """Parses YAML. Raises: ValueError with the line of a syntax error, or of a value beyond the limits."""
    if len(text) > MAX_BYTES:
        raise ValueError(f"must have {MAX_BYTES} bytes at most")
    try:
        return yaml.load(text, loader)
    except yaml.YAMLError as error:
        raise ValueError(f"is not valid YAML: {error}") from error


def yaml_text(path: str | Path) -> str:
    """Content of a YAML file; a file that is too large is read only until parse_yaml() can refuse it."""
    with open(path, "rb") as file:
        return file.read(MAX_BYTES + 1).decode("utf-8")


def read_yaml(path: str | Path) -> Any:
    """Reads a YAML file. Raises: OSError; ValueError naming the file."""
    try:
        return parse_yaml(yaml_text(path))
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
