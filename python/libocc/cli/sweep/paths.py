# SPDX-License-Identifier: Apache-2.0
"""Paths of parameters in a scene file: `sensor.exposure_s`, `lamps[2].centre_m[0]`, `lamps[*].power_w` (all lamps)."""

import re
from typing import Any

STEP = re.compile(r"(?:^|\.)([A-Za-z_]\w*)|\[(\d+|\*)\]")


def steps_of(path: str) -> list[str | int]:
    """Splits a path into keys and indices. Raises: ValueError when it is not a path."""
    steps: list[str | int] = []
    at = 0
    while at < len(path):
        match = STEP.match(path, at)
        if match is None:
            raise ValueError(f"{path!r} is not a path such as sensor.exposure_s or lamps[0].power_w")
        name, index = match.groups()
        steps.append(name or (index if index == "*" else int(index)))
        at = match.end()
    if not steps or not isinstance(steps[0], str) or steps[0] == "*":
        raise ValueError(f"{path!r} is not a path such as sensor.exposure_s or lamps[0].power_w")
    return steps


def set_path(data: Any, path: str, value: Any) -> None:
    """Sets a value in nested mappings and lists; missing mappings are created, missing list entries are not.

    Raises: ValueError naming the part of the path that does not exist.
    """
    _set(data, steps_of(path), 0, value)


def _text(steps: list[str | int]) -> str:
    text = ""
    for step in steps:
        is_name = isinstance(step, str) and step != "*"
        text += ("." if text else "") + str(step) if is_name else f"[{step}]"
    return text


def _set(data: Any, steps: list[str | int], at: int, value: Any) -> None:
    step, last = steps[at], at == len(steps) - 1
    here = _text(steps[:at]) or "the file"
    if isinstance(step, int) or step == "*":
        if not isinstance(data, list):
            raise ValueError(f"{_text(steps)}: {here} is not a list in the file")
        if isinstance(step, int) and step >= len(data):
            raise ValueError(f"{_text(steps)}: {here} has {len(data)} entries, [0] to [{len(data) - 1}]")
        chosen: list[Any] = list(range(len(data))) if step == "*" else [step]
    else:
        if not isinstance(data, dict):
            raise ValueError(f"{_text(steps)}: {here} has no keys")
        chosen = [step]
    for key in chosen:
        if last:
            data[key] = value
            continue
        if isinstance(data, dict) and key not in data:
            if not isinstance(steps[at + 1], str) or steps[at + 1] == "*":
                raise ValueError(f"{_text(steps)}: {_text(steps[: at + 1])} is not in the file")
            data[key] = {}
        _set(data[key], steps, at + 1, value)
