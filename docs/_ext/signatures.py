# SPDX-License-Identifier: Apache-2.0
"""Shortens the types that pybind11 writes into signatures: `typing.SupportsFloat | ...` is shown as `float`."""

import re

RULES = (
    (r"typing\.SupportsFloat(?: \| typing\.SupportsIndex)?", "float"),
    (r"typing\.SupportsInt(?: \| typing\.SupportsIndex)?", "int"),
    (r"typing\.Annotated\[numpy\.typing\.(?:NDArray|ArrayLike)(?:\[[^\[\]]*\])?(?:, [^\[\]]*?)?"
     r'(?:, "(\[[^"]*\])")?(?:, "flags[^"]*")*\]', r"array\1"),
    (r"numpy\.typing\.NDArray\[numpy\.(\w+)\]", r"array of \1"),
    (r"numpy\.typing\.NDArray\[numpy\.uint8 \| numpy\.uint16\]", "array of uint8 or uint16"),
    (r"numpy\.typing\.(?:NDArray|ArrayLike)(?:\[[^\]]*\])?", "array"),
    (r"collections\.abc\.", ""),
    (r"libocc\._core\.|libocc\.\w+\.(?=[A-Z])|typing\.", ""),
    (r"os\.PathLike \| str \| bytes", "path"),
    (r"~", ""),
)  # fmt: skip


def shorten(signature: str | None) -> str | None:
    """Signature with the short names of its types."""
    if signature is None:
        return None
    for pattern, short in RULES:
        signature = re.sub(pattern, short, signature)
    return re.sub(r"array(?: of \w+)?\[", lambda found: found[0].replace("[", "["), signature)
