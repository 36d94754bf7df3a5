# SPDX-License-Identifier: Apache-2.0
"""Parts of JSON Schemas: from the properties of compiled structs, and common types."""

import re
from collections.abc import Collection, Mapping
from enum import Enum
from typing import Any

import numpy as np

from ...guide.sections import fields_of, key_of

Schema = dict[str, Any]

DRAFT = "http://json-schema.org/draft-07/schema#"  # the newest draft that yaml-language-server supports completely
NUMBER: Schema = {"type": "number"}
WHOLE: Schema = {"type": "integer"}
FLAG: Schema = {"type": "boolean"}
TEXT: Schema = {"type": ["string", "number"]}  # libocc reads an unquoted 12 as text, too
NUMBERS: Schema = {"type": "array", "items": NUMBER}


def vector(size: int) -> Schema:
    return {"type": "array", "items": NUMBER, "minItems": size, "maxItems": size}


def matrix(size: int) -> Schema:
    """A list of rows, or of all numbers row by row."""
    rows = {"type": "array", "items": vector(size), "minItems": size, "maxItems": size}
    return {"anyOf": [rows, vector(size * size)]}


def words(*names: str) -> Schema:
    return {"enum": list(names)}


def listed(items: Schema, min_items: int = 0) -> Schema:
    return {"type": "array", "items": items, **({"minItems": min_items} if min_items else {})}


def described(schema: Schema, text: str) -> Schema:
    return {**schema, "description": text}


def mapping(properties: Mapping[str, Schema], required: Collection[str] = (), *, may_be_empty: bool = False) -> Schema:
    """A mapping with known keys. may_be_empty: the key may stand without a value."""
    found: Schema = {
        "type": ["object", "null"] if may_be_empty else "object",
        "properties": dict(properties),
        "additionalProperties": False,
    }
    return {**found, "required": list(required)} if required else found


def document(title: str, schema: str, properties: Mapping[str, Schema], required: Collection[str]) -> Schema:
    """A file with the key `schema`."""
    head = {"schema": {"const": schema, "description": "format of this file"}}
    return {"$schema": DRAFT, "title": title, **mapping({**head, **properties}, ["schema", *required])}


def of_struct(
    sample: Any, *, skip: Collection[str] = (), replace: Mapping[str, Schema] | None = None, defaults: bool = True
) -> dict[str, Schema]:
    """Properties of the fields of a compiled struct by their keys in files.

    sample: an instance, whose values have the types and are the defaults. replace: types of fields by name.
    """
    kind = type(sample)
    found = {}
    for field in fields_of(kind):
        if field in skip:
            continue
        value = getattr(sample, field)
        schema = (replace or {}).get(field) or type_of(value, f"{kind.__name__}.{field}")
        text = help_of(kind, field)
        found[key_of(field)] = {**schema, **({"description": text} if text else {})}
        default = plain(value)
        if defaults and default is not None and key_of(field) == field:
            found[key_of(field)]["default"] = default
    return found


def type_of(value: Any, name: str) -> Schema:
    if isinstance(value, bool):
        return FLAG
    if isinstance(value, int):
        return WHOLE
    if isinstance(value, float) or value is None:  # an optional field of the structs is a number
        return NUMBER
    if isinstance(value, str):
        return TEXT
    if isinstance(value, Enum):
        return words(*type(value).__members__)
    if isinstance(value, np.ndarray) and value.ndim == 1:
        return vector(len(value))
    if isinstance(value, list):
        return NUMBERS
    raise TypeError(f"{name} has no type in a schema: {value!r}")


def plain(value: Any) -> Any:
    """Default as plain data; None if it cannot be written as such."""
    if isinstance(value, (bool, int, str)):
        return value or (value if not isinstance(value, str) else None)
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.name if isinstance(value, Enum) else None


def help_of(kind: type, field: str) -> str:
    """Text of a property; its unit is that of the key, and ranges in radians are omitted."""
    text = re.sub(r"^\(\d+,\) ", "", getattr(kind, field).__doc__ or "")
    if key_of(field) != field:
        text = (
            re.sub(r", in [(\[][^,]*, [^)\]]*[)\]](?= \[rad)", "", text)
            .replace("[rad", "[deg")
            .replace("; pi:", "; 180:")
        )
    return text
