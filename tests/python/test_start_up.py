# SPDX-License-Identifier: Apache-2.0
"""`import libocc` loads the compiled module and NumPy, and no library that only some commands need."""

import re
import subprocess
import sys

import pytest

MAX_MEMORY_MB = 60  # measured: 45 MB, of which NumPy and Python take 30 MB


def after_import(statement: str) -> str:
    code = f"import libocc, sys; {statement}"
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout


def test_import_loads_no_library_of_single_commands() -> None:
    loaded = set(after_import("print(*sys.modules)").split())
    unwanted = {"matplotlib", "PIL", "yaml", "rich", "click", "cv2", "asyncio", "multiprocessing", "libocc.cli"}
    assert "numpy" in loaded
    assert loaded.isdisjoint(unwanted), sorted(loaded & unwanted)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_import_takes_little_memory() -> None:
    status = after_import("print(open('/proc/self/status').read())")
    peak = re.search(r"VmHWM:\s+(\d+) kB", status)
    assert peak and 10 < int(peak[1]) / 1024 < MAX_MEMORY_MB
