# SPDX-License-Identifier: Apache-2.0
"""The scripts for setting up and installing: what is missing is named in one line."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

RESOLVE = "W: Failed to fetch http://deb.debian.org/debian/InRelease  Temporary failure resolving 'deb.debian.org'"
REFUSED = "E: Could not get lock /var/lib/dpkg/lock-frontend. It is held by process 1"
CONNECTION = "WARNING: Retrying after connection broken by 'NewConnectionError(Failed to establish a new connection)'"


@pytest.fixture
def project(root: Path, tmp_path: Path) -> Path:
    """A folder with the scripts and a folder `bin` for programs that replace those of the system."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "tools").mkdir()
    for name in ("set_up", "install"):
        shutil.copy(root / "tools" / name, tmp_path / "tools")
    return tmp_path


def program(path: Path, script: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/bash\n{script}\n")
    path.chmod(0o755)


def run(project: Path, name: str, path: str | None = None) -> "subprocess.CompletedProcess[str]":
    environment = {**os.environ, "PATH": path or f"{project / 'bin'}:{os.environ['PATH']}"}
    return subprocess.run([str(project / "tools" / name)], capture_output=True, text=True, env=environment)


@pytest.mark.parametrize(
    "printed, message", [(RESOLVE, "no connection to the package server"), (REFUSED, "lock-frontend")]
)
def test_set_up_reports_why_apt_failed(project: Path, printed: str, message: str) -> None:
    program(project / "bin" / "dpkg-query", "exit 1")  # nothing is installed
    program(project / "bin" / "sudo", '"$@"')
    program(project / "bin" / "apt-get", f'[[ $1 == update ]] && exit 0\necho "{printed}" >&2\nexit 100')
    ran = run(project, "set_up")
    last = ran.stderr.splitlines()[-1]
    assert ran.returncode == 1 and last.startswith("error: apt-get cannot install build-essential ")
    assert message in ran.stderr
    assert (len(ran.stderr.splitlines()) == 1) == (printed == RESOLVE)


def test_set_up_reports_that_pip_has_no_network_in_one_line(project: Path) -> None:
    program(project / "bin" / "dpkg-query", "echo installed")
    program(project / ".venv" / "bin" / "pip", f'echo "{CONNECTION}" >&2\nexit 1')
    ran = run(project, "set_up")
    assert ran.returncode == 1
    assert ran.stderr.splitlines() == [
        "error: pip cannot install packages into .venv: no connection to the package server; connect to the network, "
        "or set http_proxy and https_proxy"
    ]


def test_set_up_does_nothing_without_network_if_everything_is_installed(project: Path) -> None:
    program(project / "bin" / "dpkg-query", "echo installed")
    program(project / ".venv" / "bin" / "pip", "exit 0")
    assert run(project, "set_up").returncode == 0
    program(project / ".venv" / "bin" / "pip", f'echo "{CONNECTION}" >&2\nexit 1')
    ran = run(project, "set_up")
    assert ran.returncode == 0 and ran.stderr == ""


@pytest.mark.parametrize("missing", ["c++", ".venv/bin/pip"])
def test_install_names_a_missing_program_in_one_line(project: Path, missing: str) -> None:
    for name in ("CMakeLists.txt", "LICENSE", "README.md", "pyproject.toml", "data", "libocc", "python"):
        (project / name).write_text("")
    for name in ("bash", "env", "find", "sort", "xargs", "sha256sum", "cat", "rm", "dirname"):
        found = shutil.which(name)
        assert found is not None
        (project / "bin" / name).symlink_to(found)
    for name in ("bin/c++", ".venv/bin/pip"):
        if not name.endswith(missing):
            program(project / name, "exit 0")
    (project / ".venv").mkdir(exist_ok=True)
    ran = run(project, "install", str(project / "bin"))
    assert ran.returncode == 1
    assert ran.stderr.splitlines() == [
        f"error: {missing} is missing: tools/set_up installs it; on another system than Debian 12 see docs/install.md"
    ]


def test_the_container_uses_scripts_that_exist(root: Path) -> None:
    text = (root / "Dockerfile").read_text()
    named = re.findall(r"\btools/\w+", text)
    assert named and all((root / name).is_file() for name in named)
    final = text.split("\nFROM ")[2]
    assert "--from=build" in final and "tools/" not in final  # no sources in the final image
    ignored = (root / ".dockerignore").read_text().split()
    assert {".venv", "build", ".git"} <= set(ignored)
