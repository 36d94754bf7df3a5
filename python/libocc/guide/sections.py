# SPDX-License-Identifier: Apache-2.0
"""Sections of a file as option structs: the keys are the names of the options, with angles in degrees."""

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, TypeVar

from ..yaml_files import number as number, suggestion

Options = TypeVar("Options")

IN_DEGREES = {"_deg": "_rad", "_deg_s": "_rad_s", "_deg_s2": "_rad_s2"}


def fields_of(kind: type) -> list[str]:
    """Names of the properties of a compiled struct."""
    return [name for name in dir(kind) if isinstance(getattr(kind, name), property)]


def key_of(field: str) -> str:
    """Key of a field in a file: angles are in degrees."""
    for degrees, radians in IN_DEGREES.items():
        if field.endswith(radians):
            return field.removesuffix(radians) + degrees
    return field


def radians(value: Any) -> Any:
    if isinstance(value, list):
        return [radians(one) for one in value]
    return math.radians(value)


def mapping(value: Any, where: str) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ValueError(f"{where} must be a mapping, got {value!r}")
    return value


def chosen(value: Any, kind: type[Enum], where: str) -> Any:
    names = [one.name for one in kind]
    if value not in names:
        raise ValueError(f"{where}: unknown {value!r}; {suggestion(str(value), names)}")
    return kind[value]


def values_by_name(section: Any, fields: Sequence[str], where: str) -> dict[str, Any]:
    """Values of a section by field name. Raises: ValueError naming the key."""
    known = {key_of(field): field for field in fields}
    values = {}
    for key, value in mapping(section, where).items():
        if key not in known:
            raise ValueError(f"{where}: unknown key {key!r}; {suggestion(str(key), list(known))}")
        try:
            values[known[key]] = value if known[key] == key else radians(value)
        except TypeError as error:
            raise ValueError(f"{where}.{key} must be a number in degrees, got {value!r}") from error
    return values


def values_of(section: Any, kind: type, where: str, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Keyword arguments of `kind`. given: values that exist already and are not allowed in the section."""
    fields = [field for field in fields_of(kind) if field not in (given or {})]
    return {**(given or {}), **values_by_name(section, fields, where)}


def made(kind: type[Options], values: dict[str, Any], where: str) -> Options:
    """Constructs `kind`; its errors name the section."""
    try:
        return kind(**values)
    except (TypeError, ValueError) as error:
        # The message of pybind11 lists all arguments of the constructor; it is replaced by the invalid value.
        text = str(error).split("incompatible constructor arguments")
        if len(text) == 1:
            raise ValueError(f"{where}.{error}") from error
        raise ValueError(f"{where}: {unsuitable(kind, values)}") from error


def unsuitable(kind: type[Any], values: dict[str, Any]) -> str:
    """Message with the value that has the wrong type."""
    for field, value in values.items():
        try:
            kind(**{field: value})
        except TypeError:
            return f"{key_of(field)}: unsuitable value {value!r}"
        except ValueError:
            continue
    return f"unsuitable values {values!r}"
