# SPDX-License-Identifier: Apache-2.0
"""Methods that a build of the library without OpenCV or OpenGV lacks."""

from collections.abc import Iterable, Mapping

from . import Failure


def require_in_build(option: str, wanted: Iterable[str], missing: Mapping[str, str]) -> None:
    """Raises Failure that names the CMake option if a wanted method is missing."""
    for name in wanted:
        if name in missing:
            raise Failure(f"{option}: {name!r} is not in this build of libocc; build it with -D{missing[name]}=ON")


def missing_note(missing: Mapping[str, str]) -> str:
    """One line for each CMake option that was off, with the methods that are missing; empty if none is."""
    lines = []
    for option in dict.fromkeys(missing.values()):
        names = ", ".join(name for name in missing if missing[name] == option)
        lines.append(f"not in this build, not used: {names} ({option}=OFF)\n")
    return "".join(lines)
