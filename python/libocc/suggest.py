# SPDX-License-Identifier: Apache-2.0
"""Which known word an unknown one was meant to be."""

import difflib
from collections.abc import Iterable, Sequence


def suggestion(unknown: str, known: Sequence[str]) -> str:
    """The end of a sentence: the nearest known word, or all of them."""
    nearest = difflib.get_close_matches(unknown, known, 1, 0.6)
    return f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(known)}"


def refuse_unknown(keys: Iterable[str], known: Sequence[str], where: str) -> None:
    """Raises: ValueError naming the first key that is not known."""
    for key in keys:
        if key not in known:
            raise ValueError(f"{where}: unknown key {key!r}; {suggestion(str(key), known)}")
