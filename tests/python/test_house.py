# SPDX-License-Identifier: Apache-2.0
"""Checks of the source tree: style, licences, file sizes, version."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import libocc as occ


@pytest.fixture(scope="module")
def sources(root: Path) -> list[Path]:
    folders = ("libocc", "python", "tests", "tools", "examples")
    kinds = {".cpp", ".hpp", ".py", ".txt", ".in", ".map", ""}
    found = [p for f in folders for p in (root / f).rglob("*") if p.is_file() and p.suffix in kinds]
    return [p for p in found if "__pycache__" not in p.parts]


def test_no_file_is_longer_than_500_lines(sources, root):
    lengths = {str(p.relative_to(root)): len(p.read_text().splitlines()) for p in sources}
    assert {name: n for name, n in lengths.items() if n > 500} == {}


def test_every_source_has_its_licence(sources):
    assert [p for p in sources if "SPDX-License-Identifier: Apache-2.0" not in p.read_text()[:200]] == []


def test_clang_format_has_nothing_to_change(sources, root):
    if shutil.which("clang-format") is None:
        pytest.skip("clang-format is not installed")
    files = [p for p in sources if p.suffix in (".cpp", ".hpp")]
    command = ["clang-format", "--dry-run", "--Werror", *files]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=root)
    assert ran.returncode == 0, ran.stderr[:3000]


def test_ruff_has_nothing_to_change(sources, root):
    """Line length, unused names and order of imports; settings in pyproject.toml."""
    beside_python = Path(sys.executable).with_name("ruff")
    ruff = str(beside_python) if beside_python.exists() else shutil.which("ruff")
    if ruff is None:
        pytest.skip("ruff is not installed")
    scripts = [p for p in sources if p.suffix == "" and p.read_text().startswith("#!/usr/bin/env python3")]
    files = [p for p in sources if p.suffix == ".py"] + scripts
    ran = subprocess.run([ruff, "check", "--no-cache", *files], capture_output=True, text=True, cwd=root)
    assert ran.returncode == 0, ran.stdout[:3000]


def test_the_version_is_written_once(root):
    written = re.search(r"project\(libocc VERSION ([0-9.]+)", (root / "CMakeLists.txt").read_text())
    assert written is not None and occ.__version__ == written.group(1)
    assert written.group(1) not in (root / "pyproject.toml").read_text()
