# SPDX-License-Identifier: Apache-2.0
"""Writes the pages of the references: one for each Python module, each command and each folder of C++ headers."""

import importlib
from pathlib import Path
from types import ModuleType

from cpp_api import CppApi
from plain_text import to_rst, with_equations

TITLES = {
    "survey": "maps of lamps from pictures alone",
    "calibrate": "start values and calibration from pictures", "camera": "camera models",
    "codes": "ids as light and back", "core": "images, status, random numbers", "decode": "ids from image sequences",
    "detect": "blobs, rims, spots, stripes", "formation": "the image of one lamp", "geometry": "rotations, poses",
    "guide": "vehicles, routes, planning, closed loop", "identify": "assignment of blobs to lamps, objects",
    "ladder": "accuracy against time", "landmarks": "AprilTags and calibration boards", "locate": "pose from one image",
    "network": "bundle adjustment", "photometry": "response curves, lamp power, ambient light",
    "pose": "pose solvers", "radiometry": "light and sensor", "refine": "maximum-likelihood pose and bounds",
    "scene": "lamps, sensor, room, files", "simulate": "images with ground truth", "smooth": "smoothing",
    "track": "filters and tracker",
}  # fmt: skip


def write(path: Path, lines: list[str]) -> None:
    """Writes a page unless it has this text already, so that Sphinx reads changed pages only."""
    text = "\n".join(lines).rstrip() + "\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def remove_others(folder: Path, kept: list[Path]) -> None:
    """Removes the pages of modules, commands and headers that no longer exist."""
    for page in folder.glob("*.rst"):
        if page not in kept:
            page.unlink()


def header_comment(path: Path) -> list[str]:
    """Comment at the top of a header, without the licence line."""
    lines = []
    for line in path.read_text().splitlines()[1:]:
        if not line.startswith("//"):
            break
        lines.append(line[3:])
    return lines


def cpp_pages(root: Path, folder: Path) -> None:
    """One page for each folder of the library."""
    api = CppApi(root / "build" / "docs" / "doxygen" / "xml")
    pages = []
    for room in sorted(path for path in (root / "libocc").iterdir() if path.is_dir()):
        headers = [p for p in sorted(room.rglob("*.hpp")) if "internal" not in p.parts]
        if not headers:
            continue
        title = f"{room.name}: {TITLES[room.name]}" if room.name in TITLES else room.name
        lines = [title, "=" * len(title), ""]
        for header in headers:
            name = str(header.relative_to(root))
            lines += [name, "-" * len(name), "", *to_rst(list(with_equations(header_comment(header)))), ""]
            lines += [*api.of_header(name), ""]
        pages.append(folder / f"{room.name}.rst")
        write(pages[-1], lines)
    remove_others(folder, pages)


def python_object(module: ModuleType, name: str) -> list[str]:
    """Section of a class, function or value of a module."""
    value = getattr(module, name)
    kind = "class" if isinstance(value, type) else "function" if callable(value) else "data"
    lines = [name, "-" * len(name), "", f".. auto{kind}:: {module.__name__}.{name}"]
    return [*lines, *(["   :members:", "   :undoc-members:"] if kind == "class" else []), ""]


def python_pages(folder: Path) -> None:
    """One page for each public module."""
    import libocc

    pages = []
    for name in ("", *sorted(libocc._SUBMODULES)):
        module = importlib.import_module("libocc" + (f".{name}" if name else ""))
        title = module.__name__
        lines = [title, "=" * len(title), "", f".. automodule:: {title}", ""]
        for public in sorted(module.__all__, key=str.lower):
            lines += python_object(module, public) if not public.startswith("_") else []
        pages.append(folder / f"{title}.rst")
        write(pages[-1], lines)
    remove_others(folder, pages)


def command_pages(folder: Path) -> None:
    """One page for each command."""
    from libocc.cli import COMMANDS

    pages = []
    for name in COMMANDS:
        title = f"libocc {name}"
        module = f"libocc.cli.commands.{name.replace('-', '_')}"
        lines = [f".. click:: {module}:command", f"   :prog: {title}", "   :nested: full"]
        pages.append(folder / f"{name}.rst")
        write(pages[-1], lines)
    remove_others(folder, pages)


def write_all(docs: Path) -> None:
    """Writes all generated pages below docs/generated."""
    generated = docs / "generated"
    cpp_pages(docs.parent, generated / "cpp")
    python_pages(generated / "python")
    command_pages(generated / "commands")
