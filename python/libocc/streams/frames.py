# SPDX-License-Identifier: Apache-2.0
"""What every source of frames gives: one frame after another, also those that cannot be used."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8 | np.uint16]


@dataclass(frozen=True)
class StreamFrame:
    """An image with its time; without an image, `problem` says why."""

    index: int
    time_s: float | None
    image: Pixels | None
    name: str = ""  # such as the file's
    problem: str = ""
    truth: Any = None  # plain data, where it is known: see libocc sequence


class Source(Protocol):
    """Frames in the order in which they come; one at a time is held.

    Iterating raises OSError or ValueError naming the source when it ends before its time.
    """

    name: str
    live: bool  # frames that nobody takes in time are gone
    total: int | None  # frames, where that is known

    def __iter__(self) -> Iterator[StreamFrame]: ...

    def close(self) -> None: ...
