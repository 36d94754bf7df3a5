#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the types of the compiled module for type checkers: make_stubs.py MODULE.so STUBS.pyi

The build of the Python package runs it after linking. If pybind11-stubgen is missing or fails, it prints one line and
writes nothing, and the package is built without types.
"""

import enum
import importlib
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

NAME = "libocc._core"


def enums(core: ModuleType) -> dict[str, type[enum.Enum]]:
    members = vars(core).items()
    return {name: kind for name, kind in members if isinstance(kind, type) and issubclass(kind, enum.Enum)}


def generated(core: ModuleType, folder: Path) -> str:
    command = [sys.executable, "-m", "pybind11_stubgen", NAME]
    command += ["--numpy-array-use-type-var", "--output-dir", str(folder / "stubs")]
    for name in enums(core):
        command += ["--enum-class-locations", f"{name}:{NAME}"]
    subprocess.run(command, check=True, cwd=folder, stdout=subprocess.DEVNULL)
    return (folder / "stubs" / "libocc" / "_core.pyi").read_text()


def corrected(core: ModuleType, text: str) -> str:
    """Corrects the declarations that mypy --strict rejects, and leaves out the version."""
    for name, members in enums(core).items():
        for member in members:
            declared = f"    {member.name}: typing.ClassVar[{name}]"
            text = text.replace(declared, f"    {member.name} = {member.value}")
    text = text.replace("    @classmethod\n    def __new__(cls, value):\n        ...\n", "")
    text = text.replace("os.PathLike | str | bytes", "os.PathLike[str] | str")
    text = re.sub(r"(__version__: str) = .*", r"\1", text)
    text = re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)
    return "# SPDX-License-Identifier: Apache-2.0\n" + text.lstrip()


def main() -> int:
    module, stubs = (Path(argument).resolve() for argument in sys.argv[1:])
    missing = [name for name in ("pybind11_stubgen", "numpy") if find_spec(name) is None]
    if missing:
        print(f"libocc is built without types for type checkers: {' and '.join(missing)} not installed")
        return 0
    with tempfile.TemporaryDirectory() as name:
        # A package that holds the module alone gives its classes their installed name.
        folder = Path(name)
        (folder / "libocc").mkdir()
        (folder / "libocc" / "__init__.py").write_text(f"__path__.append({str(module.parent)!r})\n")
        sys.path.insert(0, str(folder))
        core = importlib.import_module(NAME)
        try:
            stubs.write_text(corrected(core, generated(core, folder)))
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"libocc is built without types for type checkers: {error}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
