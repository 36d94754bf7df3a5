# SPDX-License-Identifier: Apache-2.0
"""Interface of the sources of frames."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8 | np.uint16]


@dataclass(frozen=True)
class StreamFrame:
    """An image with its time; `problem` is the reason when there is no image."""

    index: int
    time_s: float | None
    image: Pixels | None
    name: str = ""  # for instance that of the file
    problem: str = ""
    truth: Any = None  # plain data of a truth file of libocc sequence, if there is one


class Source(Protocol):
    """Yields frames in the order of arrival; one frame at a time is held in memory.

    Iterating raises OSError or ValueError naming the source when it ends prematurely.
    """

    name: str
    live: bool  # frames that are not read in time are lost
    total: int | None  # number of frames, if known

    def __iter__(self) -> Iterator[StreamFrame]: ...

    def close(self) -> None: ...
