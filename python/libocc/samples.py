# SPDX-License-Identifier: Apache-2.0
"""The scenes and images that come with libocc."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ._core import Object, Scene

FOLDER = Path(__file__).parent / "data"


@dataclass(frozen=True)
class Sample:
    """A sample image, the path of its scene and its ground truth (see `libocc simulate`)."""

    image: Path
    scene: Path
    truth: dict[str, Any]

    @property
    def name(self) -> str:
        return self.image.stem


def scene_names() -> list[str]:
    """Names of the scenes that come with libocc."""
    return sorted(path.stem for path in (FOLDER / "scenes").glob("*.yaml"))


def _find(kind: str, file_or_name: str) -> Path:
    own = {path.stem: path for path in (FOLDER / kind).glob("*.yaml")}
    path = Path(file_or_name)
    # A file takes precedence over a sample; a folder of that name, such as the result of a run, does not.
    return own[file_or_name] if file_or_name in own and not path.is_file() else path


def find_scene(file_or_name: str) -> Path:
    """Path of a file, or of the scene with that name that comes with libocc."""
    return _find("scenes", file_or_name)


def find_trajectory(file_or_name: str) -> Path:
    """Path of a file, or of the trajectory with that name that comes with libocc."""
    return _find("trajectories", file_or_name)


def find_sweep(file_or_name: str) -> Path:
    """Path of a file, or of the sweep with that name that comes with libocc."""
    return _find("sweeps", file_or_name)


def find_experiment(file_or_name: str) -> Path:
    """Path of a file, or of the experiment with that name that comes with libocc."""
    return _find("experiments", file_or_name)


def find_network(file_or_name: str) -> Path:
    """Path of a file, or of the network with that name that comes with libocc."""
    own = FOLDER / "calibration" / file_or_name / "network.yaml"
    return own if own.is_file() and not Path(file_or_name).is_file() else Path(file_or_name)


def find_image(file_or_name: str) -> Path:
    """Path of a file, or of the image with that name that comes with libocc."""
    own = FOLDER / "images" / f"{file_or_name}.png"
    return own if own.is_file() and not Path(file_or_name).is_file() else Path(file_or_name)


def load_scene(file_or_name: str) -> Scene:
    """Loads a scene from a file, or the scene with that name that comes with libocc."""
    return Scene.load(find_scene(file_or_name))


def load_object(file_or_name: str) -> Object:
    """Loads an object from a file, or the object with that name that comes with libocc."""
    return Object.load(_find("objects", file_or_name))


def samples() -> list[Sample]:
    """Images that come with libocc, sorted by name. The key "scene" of a truth is the name of its scene."""
    found = []
    for truth_path in sorted((FOLDER / "images").glob("*.json")):
        truth = json.loads(truth_path.read_text())
        scene = FOLDER / "scenes" / f"{truth['scene']}.yaml"
        found.append(Sample(truth_path.with_suffix(".png"), scene, truth))
    return found
