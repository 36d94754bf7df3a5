# SPDX-License-Identifier: Apache-2.0
"""tools/mutants: which mutations it makes, and its report. No mutant is compiled here."""

import importlib.util
import signal
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def tool(root: Path) -> ModuleType:
    loader = SourceFileLoader("mutants", str(root / "tools" / "mutants"))
    spec = importlib.util.spec_from_loader("mutants", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutants"] = module
    sys.dont_write_bytecode = True
    loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "line, changed",
    [
        ("  if (a < b && !c) {", {"  if (a >= b && !c) {", "  if (a < b) {"}),
        ("  const double x = 2.5;", {"  const double x = 3.75;", "  const double x = 1.25;"}),
        ("constexpr int n = 4;", {"constexpr int n = 6;", "constexpr int n = 2;"}),
        ("  return 2 * x;", {"  return 3 * x;", "  return 1 * x;"}),
        ("  x += y;", {"  x -= y;"}),
        ("  return -x;", {"  return x;"}),
        ("  return x - f(y);", {"  return x + f(y);", "  return x;"}),
        ("  if (empty()) return {};", {"  ;"}),
        ("  std::vector<double> v(n);", set()),
        ("  // a < b + 1.5", set()),
        ('  throw std::invalid_argument("a < b");', set()),
        ("  x[i + 3] = y;", {"  x[i - 3] = y;"}),
    ],
)
def test_changes_of_a_line(tool: ModuleType, line: str, changed: set[str]) -> None:
    assert {after for _, after in tool.changes(line)} == changed


def test_a_comparison_inside_a_comment_or_text_is_kept(tool: ModuleType) -> None:
    assert list(tool.changes('  call("a < b");  // if a > b')) == []


def test_the_seed_determines_the_mutants(tool: ModuleType, root: Path) -> None:
    def first(seed: int) -> list[str]:
        return [str(mutant) for _, mutant in zip(range(20), tool.draw(root, "refine", seed))]

    assert first(1) == first(1) != first(2)
    assert len(set(first(1))) == 20


def test_every_mutant_changes_its_line(tool: ModuleType, root: Path) -> None:
    for room in tool.PROGRAMS:
        mutants = tool.mutants_of(root, room)
        assert len(mutants) > 100, room
        for mutant in mutants:
            assert mutant.room == room and mutant.before != mutant.after
            assert (root / mutant.path).read_text().splitlines()[mutant.line - 1] == mutant.before


def test_report_counts_and_shows_survivors(tool: ModuleType) -> None:
    text = "int f(int a) {\n  return a - 1;\n}\n"
    kept = tool.Mutant("libocc/pose/a.cpp", 2, "sign inverted", "  return a - 1;", "  return a + 1;")
    same = tool.Mutant("libocc/pose/a.cpp", 2, "term dropped", "  return a - 1;", "  return a;")
    done = [(kept, "survived"), (same, "survived"), (kept, "pose: Pose.IsRight"), (kept, "does not compile")]
    report, left = tool.report(done, {same.key: "f is never called"}, lambda path: text)
    assert left == 1
    assert "pose       1 killed, 1 survived, 1 equivalent" in report
    assert "-  return a - 1;\n+  return a + 1;" in report and "equivalent: f is never called" in report


def test_equivalent_mutants_have_four_lines(tool: ModuleType, root: Path, tmp_path: Path) -> None:
    tool.read_equivalent(root / tool.EQUIVALENT)
    page = tmp_path / "list.txt"
    page.write_text("# a comment\n\nlibocc/a.cpp\n  x < 1\n  x >= 1\nx is never 1\n")
    assert tool.read_equivalent(page) == {("libocc/a.cpp", "x < 1", "x >= 1"): "x is never 1"}
    page.write_text("libocc/a.cpp\nx < 1\n")
    with pytest.raises(ValueError, match="must have 4 lines"):
        tool.read_equivalent(page)


def test_equivalent_mutants_name_lines_that_exist(tool: ModuleType, root: Path) -> None:
    for path, before, after in tool.read_equivalent(root / tool.EQUIVALENT):
        lines = [line.strip() for line in (root / path).read_text().splitlines()]
        assert before in lines, f"{path}: {before!r} has changed: remove it from {tool.EQUIVALENT}"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_that_the_shell_ignores_ends_the_run(tool: ModuleType, number: signal.Signals) -> None:
    before = {each: signal.signal(each, signal.SIG_IGN) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        tool.end_by_signals()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def test_list_prints_and_does_not_build(root: Path) -> None:
    command = [sys.executable, root / "tools" / "mutants", "--list", "--room", "track", "--count", "2"]
    ran = subprocess.run(command, capture_output=True, text=True)
    assert ran.returncode == 0 and len(ran.stdout.splitlines()) == 6, ran.stderr
    assert all(line.startswith("libocc/track/") for line in ran.stdout.splitlines()[::3])
    ran = subprocess.run([*command[:2], "--count", "0"], capture_output=True, text=True)
    assert ran.returncode == 2 and "positive" in ran.stderr
