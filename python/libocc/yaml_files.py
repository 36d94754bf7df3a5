# SPDX-License-Identifier: Apache-2.0
"""YAML as libocc's C++ side reads it, where `2e-5` is a number; PyYAML takes it for a text."""

import re
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
