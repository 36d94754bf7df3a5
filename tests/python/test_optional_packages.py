# SPDX-License-Identifier: Apache-2.0
"""tools/test installs the optional packages that tests use."""

import re
from pathlib import Path

# Packages whose module has another name.
MODULES = {
    "opencv-python-headless": "cv2", "rerun-sdk": "rerun", "dask[distributed]": "distributed",
}
# Installed by tools/set_up, or part of Python.
ELSEWHERE = {"jsonschema", "mypy", "pybind11_stubgen"}


def installed(root: Path) -> list[str]:
    script = (root / "tools" / "test").read_text()
    lists = re.findall(r"optional\+?=\((.*?)\)", script, re.DOTALL)
    return [package for each in lists for package in re.findall(r'"([^"]+)"', each)]


def test_each_module_that_a_test_needs_is_installed(root: Path) -> None:
    names = [package.split(">=")[0] for package in installed(root)]
    modules = {MODULES.get(name, name) for name in names} | ELSEWHERE
    needed = set()
    for path in (root / "tests").rglob("*.py"):
        needed |= {name.split(".")[0] for name in re.findall(r'importorskip\("([\w.]+)"\)', path.read_text())}
    assert needed and needed <= modules


def test_each_package_is_one_of_an_extra(root: Path) -> None:
    project = (root / "pyproject.toml").read_text()
    assert [package for package in installed(root) if f'"{package}"' not in project] == []
