# SPDX-License-Identifier: Apache-2.0
"""Shared by the Python tests: a scene of six lamps, a pose that sees them, its image and truth."""

from pathlib import Path

import numpy as np
import pytest

import libocc as occ

ROOT = Path(__file__).resolve().parents[2]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--slow", action="store_true", help="also run the slow tests")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--slow"):
        return
    for item in items:
        if "slow" in item.keywords:
            item.add_marker(pytest.mark.skip(reason="runs with --slow"))


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def scene() -> occ.Scene:
    return occ.Scene.load(ROOT / "data" / "scenes" / "irregular_six.yaml")


@pytest.fixture(scope="session")
def pose() -> np.ndarray:
    return occ.look_at(position_m=[1.7, 2.1, 0.5], target_m=[1.9, 2.1, 3], up=[0, 1, 0])


@pytest.fixture(scope="session")
def rendered(scene: occ.Scene, pose: np.ndarray) -> tuple[np.ndarray, occ.Truth]:
    return occ.simulate(scene, cam_from_world=pose, seed=1)


@pytest.fixture(scope="session")
def image(rendered: tuple[np.ndarray, occ.Truth]) -> np.ndarray:
    return rendered[0]
