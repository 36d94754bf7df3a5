# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the Python tests: a scene with six lamps, a pose that sees them, its image and truth."""

from pathlib import Path

import numpy as np
import pytest

import libocc as occ

ROOT = Path(__file__).resolve().parents[2]


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
