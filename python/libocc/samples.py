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
    """An image with its scene and, beside it, what is true of it."""

    image: Path
    scene: Path
    truth: dict[str, Any]

    @property
    def name(self) -> str:
        return self.image.stem


def scene_names() -> list[str]:
    """Names that find_scene() takes."""
    return sorted(path.stem for path in (FOLDER / "scenes").glob("*.yaml"))


def _find(kind: str, file_or_name: str) -> Path:
    own = {path.stem: path for path in (FOLDER / kind).glob("*.yaml")}
    path = Path(file_or_name)
    # A file wins over a name; a folder of that name, such as what a run has written, does not.
    return own[file_or_name] if file_or_name in own and not path.is_file() else path


def find_scene(file_or_name: str) -> Path:
    """The file itself, or the scene of that name that comes with libocc."""
    return _find("scenes", file_or_name)


def find_trajectory(file_or_name: str) -> Path:
    """The file itself, or the trajectory of that name that comes with libocc."""
    return _find("trajectories", file_or_name)


def find_sweep(file_or_name: str) -> Path:
    """The file itself, or the sweep of that name that comes with libocc."""
    return _find("sweeps", file_or_name)


def find_experiment(file_or_name: str) -> Path:
    """The file itself, or the experiment of that name that comes with libocc."""
    return _find("experiments", file_or_name)


def find_network(file_or_name: str) -> Path:
    """The file itself, or the network of that name that comes with libocc."""
    own = FOLDER / "calibration" / file_or_name / "network.yaml"
    return own if own.is_file() and not Path(file_or_name).is_file() else Path(file_or_name)


def find_image(file_or_name: str) -> Path:
    """The file itself, or the image of that name that comes with libocc."""
    own = FOLDER / "images" / f"{file_or_name}.png"
    return own if own.is_file() and not Path(file_or_name).is_file() else Path(file_or_name)


def load_scene(file_or_name: str) -> Scene:
    """Scene of a file, or of one that comes with libocc by its name."""
    return Scene.load(find_scene(file_or_name))


def load_object(file_or_name: str) -> Object:
    """Object of a file, or of one that comes with libocc by its name."""
    return Object.load(_find("objects", file_or_name))


def samples() -> list[Sample]:
    """The images that come with libocc, by name. Each truth names its scene under "scene"."""
    found = []
    for truth_path in sorted((FOLDER / "images").glob("*.json")):
        truth = json.loads(truth_path.read_text())
        scene = FOLDER / "scenes" / f"{truth['scene']}.yaml"
        found.append(Sample(truth_path.with_suffix(".png"), scene, truth))
    return found
