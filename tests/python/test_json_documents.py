# SPDX-License-Identifier: Apache-2.0
"""Every key that a command prints with --json, or that a truth file has, is described in docs/formats."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from libocc.cli import COMMANDS, main

SIMULATE = "simulate irregular_six --out {} --position {}"
PREPARED = (
    SIMULATE.format("a.png", "1.7 2.1 0.5"),
    SIMULATE.format("b.png", "2.3 1.8 0.4 --heading-deg 90"),
    SIMULATE.format("c.png", "1.9 2.4 0.9 --heading-deg 200"),
    SIMULATE.format("d.png", "0.4 0.4 0.2 --look-at 2 2 3"),
    *(SIMULATE.format(f"e{t}.png", f"1.7 2.1 0.5 --exposure-s {t}e-6") for t in (4, 8, 20)),
    "simulate square_four --position 1.9 2.05 0.15 --out square.png",
    "simulate coded_four --position 1 1 2.2 --out lamp.png",
    "simulate parking --position 9 2 1.4 --look-at 2 0.9 0.7 --seed 1 --out night.png",
    "sequence ufsook_four standing --out standing",
    "sequence irregular_six walk --out walk --fps 10 --frames 2",
)
CALLS = {
    "simulate": SIMULATE.format("x.png", "1.7 2.1 0.5"),
    "detect": "detect a.png",
    "identify": "identify square.png --map square_four",
    "locate": "locate a.png irregular_six --target-mm 0.5",
    "recognise": "recognise night.png car beacon --camera parking",
    "tags": "tags wall_of_tags_1 --map wall_of_tags",
    "decode": "decode standing --still",
    "explain": "explain irregular_six --repetitions 0",
    "map": "map kookmin_four_lamps --height 1.2 --step 0.5 --out maps",
    "samples": "samples",
    "points": "points beacon --camera parking",
    "response": "response e4.png e8.png e20.png --exposures 4e-6,8e-6,2e-5 --black-level-dn 2",
    "light": "light irregular_six a.png b.png c.png d.png --ambient",
    "hard-cases": "hard-cases --solver p3p --case no_triangle",
    "ladder": "ladder --frames 2 --rung rims",
    "trust": "trust --family one_dark --family coplanar_four --count 4",
    "calibrate": "calibrate network panorama --out calibrated",
    "import-network": "import-network kalibr/camchain.yaml --out imported",
    "survey": "survey a.png b.png c.png --camera irregular_six --radius 0.085 --out surveyed",
    "measure": "measure panorama corners.csv --out measured --distance corner_0 corner_1",
    "row-time": "row-time lamp.png --frequency-hz 2000",
    "guide": "guide short_drive --out drive --no-animation --runs 1",
    "demo": "demo",
    "position": "position irregular_six --source walk",
}
SHARED = ("Pose", "Blob", "`libocc locate`")  # sections that others refer to


def run(command: str) -> str:
    arguments = [argument.replace("corner_", "corner ") for argument in command.split()]
    ran = CliRunner().invoke(main, arguments, prog_name="libocc")
    if ran.exception is not None and not isinstance(ran.exception, SystemExit):
        raise ran.exception
    assert ran.exit_code in (0, 1), ran.output
    return ran.stdout


def keys(data: Any) -> Iterator[str]:
    """All keys at any depth; numbers as keys are ids."""
    for value in data if isinstance(data, list) else data.values() if isinstance(data, dict) else ():
        yield from keys(value)
    if isinstance(data, dict):
        yield from (key for key in data if not key.isdigit())


def described(section: str) -> set[str]:
    """Names in backquotes; of a path such as `cameras[].name` each part."""
    named = re.findall(r"`([^`]+)`", section)
    return {part for name in named for part in re.split(r"\[\]|\.|, ", name) if part}


def sections(page: Path) -> dict[str, str]:
    parts = re.split(r"^## (.*)$", page.read_text(), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2]))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    made = tmp_path_factory.mktemp("json")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(made)
        for command in PREPARED:
            run(command)
        yield made


def test_every_command_with_json_has_a_call() -> None:
    import importlib

    with_json = set()
    for name in COMMANDS:
        command = importlib.import_module(f"libocc.cli.commands.{name.replace('-', '_')}").command
        if name == "calibrate" or any("--json" in parameter.opts for parameter in command.params):
            with_json.add(name)
    assert with_json == set(CALLS)


@pytest.mark.parametrize("name", CALLS)
def test_printed_keys_are_described(name: str, root: Path, folder: Path) -> None:
    of = sections(root / "docs" / "formats" / "json.md")
    known = described(of[f"`libocc {name}`"]).union(*(described(of[shared]) for shared in SHARED))
    out = run(CALLS[name] + " --json")
    data = [json.loads(line) for line in out.splitlines()] if name == "position" else json.loads(out)
    found = set(keys(data))
    assert len(found) >= 4 and found - known == set()


def test_keys_of_the_truth_are_described(root: Path, folder: Path) -> None:
    found = set(keys(json.loads((folder / "walk" / "truth" / "000000.json").read_text())))
    page = (root / "docs" / "formats" / "truth.md").read_text()
    assert "rim_px" in found and found - described(page) == set()
