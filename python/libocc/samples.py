# SPDX-License-Identifier: Apache-2.0
"""The scenes and images that come with libocc."""

import itertools
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ._core import Object, Scene
from .yaml_files import suggestion

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


class Kind(NamedTuple):
    """A kind of files that come with libocc, and the paths of these files relative to FOLDER."""

    name: str
    pattern: str

    def paths(self) -> dict[str, Path]:
        """Path of each sample of this kind by name, sorted."""
        found = sorted(FOLDER.glob(self.pattern))
        return {path.parent.name if self.name == "network" else path.stem: path for path in found}


KINDS = (
    Kind("scene", "scenes/*.yaml"),
    Kind("image", "images/*.png"),
    Kind("object", "objects/*.yaml"),
    Kind("trajectory", "trajectories/*.yaml"),
    Kind("sweep", "sweeps/*.yaml"),
    Kind("experiment", "experiments/*.yaml"),
    Kind("network", "calibration/*/network.yaml"),
)


def kind_named(name: str) -> Kind:
    """The kind with that name."""
    return next(kind for kind in KINDS if kind.name == name)


def scene_names() -> list[str]:
    """Names of the scenes that come with libocc."""
    return list(kind_named("scene").paths())


def article(name: str) -> str:
    """The name with its indefinite article."""
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def _find(kind_name: str, file_or_name: str) -> Path:
    """Path of a file or sample. Raises: FileNotFoundError with the most similar name, unless it looks like a path."""
    own = kind_named(kind_name).paths()
    path = Path(file_or_name)
    # A file takes precedence over a sample; a folder of that name, such as the result of a run, does not.
    if file_or_name in own and not path.is_file():
        return own[file_or_name]
    if path.exists() or path.suffix or path.name != file_or_name:
        return path
    text = f"{file_or_name}: is neither a file nor {article(kind_name)} that comes with libocc"
    for other in KINDS:
        if file_or_name in other.paths():
            raise FileNotFoundError(f"{text}, but {article(other.name)}; allowed: {', '.join(own)}")
    raise FileNotFoundError(f"{text}; {suggestion(file_or_name, list(own))} (`libocc samples` lists all)")


def find_scene(file_or_name: str) -> Path:
    """Path of a file, or of the scene with that name that comes with libocc."""
    return _find("scene", file_or_name)


def find_trajectory(file_or_name: str) -> Path:
    """Path of a file, or of the trajectory with that name that comes with libocc."""
    return _find("trajectory", file_or_name)


def find_sweep(file_or_name: str) -> Path:
    """Path of a file, or of the sweep with that name that comes with libocc."""
    return _find("sweep", file_or_name)


def find_experiment(file_or_name: str) -> Path:
    """Path of a file, or of the experiment with that name that comes with libocc."""
    return _find("experiment", file_or_name)


def find_network(file_or_name: str) -> Path:
    """Path of a file, or of the network with that name that comes with libocc."""
    return _find("network", file_or_name)


def find_image(file_or_name: str) -> Path:
    """Path of a file, or of the image with that name that comes with libocc."""
    return _find("image", file_or_name)


def load_scene(file_or_name: str) -> Scene:
    """Loads a scene from a file, or the scene with that name that comes with libocc."""
    return Scene.load(find_scene(file_or_name))


def load_object(file_or_name: str) -> Object:
    """Loads an object from a file, or the object with that name that comes with libocc."""
    return Object.load(_find("object", file_or_name))


def samples() -> list[Sample]:
    """Images that come with libocc, sorted by name. The key "scene" of a truth is the name of its scene."""
    found = []
    for truth_path in sorted((FOLDER / "images").glob("*.json")):
        truth = json.loads(truth_path.read_text())
        scene = FOLDER / "scenes" / f"{truth['scene']}.yaml"
        found.append(Sample(truth_path.with_suffix(".png"), scene, truth))
    return found


def description(kind: Kind, path: Path) -> str:
    """One sentence on a sample: the first one of its file, or the content of an image."""
    if kind.name == "image":
        return _image_description(path)
    lines = itertools.takewhile(lambda line: line.startswith("#"), path.read_text(encoding="utf-8").splitlines())
    text = " ".join(line.lstrip("# ") for line in lines if "SPDX" not in line)
    found = re.match(r".*?(?<![A-Z])\.(?= |$)", text)  # not the period of an initial
    return found[0] if found else text


def _image_description(path: Path) -> str:
    from PIL import Image

    with Image.open(path) as image:
        width, height = image.size
    truth_path = path.with_suffix(".json")
    scene = path.stem.rpartition("_")[0]
    text = f"Image of the scene {scene}, {width} x {height} px"
    if not truth_path.exists():
        return f"{text}."
    lamps = [lamp["id"] for lamp in json.loads(truth_path.read_text())["lamps"] if lamp["in_view"]]
    return f"{text}; lamps {' '.join(map(str, lamps))} in view."
