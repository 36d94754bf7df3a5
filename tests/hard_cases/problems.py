# SPDX-License-Identifier: Apache-2.0
"""The catalogue and its problems, made once for all tests that want them."""

from functools import lru_cache

from libocc.cli.hard_cases.cases import catalogue
from libocc.cli.hard_cases.instances import Instance, instances

CASES = {case.name: case for case in catalogue()}


@lru_cache(maxsize=2)
def problems(name: str, count: int | None = None) -> tuple[tuple[str, tuple[Instance, ...]], ...]:
    """Rows of a case, each with its problems."""
    case = CASES[name]
    return tuple((row, tuple(instances(case, p, count or case.count))) for row, p in case.rows())
