# SPDX-License-Identifier: Apache-2.0
"""Samples that come with libocc: their list, and names that are misspelled or of another kind."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

import libocc as occ
from libocc import samples

Run = Callable[..., tuple[int, str, str]]

NETWORK, LAMPS = ["calibrate", "network"], ["calibrate", "lamps", "a.png", "--map"]
# Each command that reads a sample, with the end of its command line.
MISSPELLED = [
    (["locate", "irregular_six_1"], "irregular_sx", [], "irregular_six"),
    (["locate"], "irregular_six1", ["irregular_six"], "irregular_six_1"),
    (["detect"], "irregular_six1", [], "irregular_six_1"),
    (["detect", "irregular_six_1", "--scene"], "irregular_sx", [], "irregular_six"),
    (["identify"], "irregular_six1", ["--map", "irregular_six"], "irregular_six_1"),
    (["identify", "irregular_six_1", "--map"], "iregular_six", [], "irregular_six"),
    (["simulate"], "square_for", ["--position", 1, 1, 1], "square_four"),
    (["explain"], "square_for", ["--position", 1, 1, 1], "square_four"),
    (["map"], "kookmin_four_lamp", ["--height", 1], "kookmin_four_lamps"),
    (["tags"], "wall_of_tag_1", [], "wall_of_tags_1"),
    (["tags", "wall_of_tags_1", "--map"], "wall_of_tag", [], "wall_of_tags"),
    (["sequence"], "ufsook_for", ["walk", "--out", "o"], "ufsook_four"),
    (["sequence", "irregular_six"], "wlk", ["--out", "o"], "walk"),
    (["sweep"], "exposur", ["--out", "o"], "exposure"),
    (["guide"], "short_driv", ["--out", "o"], "short_drive"),
    (["position"], "ufsook_hal", ["--source", "."], "ufsook_hall"),
    (["recognise", "irregular_six_1"], "beacn", ["--camera", "parking"], "beacon"),
    (["points"], "beacn", ["--camera", "parking"], "beacon"),
    (["ladder"], "irregular_sx", [], "irregular_six"),
    (NETWORK, "panoram", ["--out", "o"], "panorama"),
    (["measure"], "panoram", ["corners.csv", "--out", "o"], "panorama"),
    (LAMPS, "irregular_sx", ["--out", "o"], "irregular_six"),
]


@pytest.mark.parametrize("before, name, after, nearest", MISSPELLED, ids=lambda value: str(value))
def test_a_misspelled_name_names_the_nearest(
    libocc: Run, before: list[str], name: str, after: list[str], nearest: str
) -> None:
    code, _, err = libocc(*before, name, *after)
    assert code == 2, err
    assert f"error: {name}: is neither a file nor a" in err and f"did you mean {nearest}?" in err


def test_a_name_of_another_kind_is_an_error_with_its_kind(libocc: Run) -> None:
    code, _, err = libocc("locate", "irregular_six_1", "walk")
    assert (
        code == 2
        and "walk: is neither a file nor a scene that comes with libocc, but a trajectory; allowed: coded_four" in err
    )
    code, _, err = libocc("locate", "irregular_six", "irregular_six")
    assert code == 2 and "nor an image that comes with libocc, but a scene" in err


def test_a_name_without_a_similar_one_lists_all(libocc: Run) -> None:
    code, _, err = libocc("simulate", "zzz", "--position", 1, 1, 1)
    assert code == 2 and "allowed: coded_four, irregular_six" in err and "`libocc samples`" in err


@pytest.mark.parametrize("path", ["zzz.yaml", "scenes/irregular_sx"])
def test_a_path_is_an_error_of_the_file(libocc: Run, path: str) -> None:
    code, _, err = libocc("simulate", path, "--position", 1, 1, 1)
    assert code == 2 and f"{path}: cannot be read" in err


def test_a_file_without_extension_takes_precedence(libocc: Run) -> None:
    Path("square_for").write_text(occ.Scene.load(samples.find_scene("irregular_six")).format())
    code, out, _ = libocc("simulate", "square_for", "--position", 1.7, 2.1, 0.5)
    assert code == 0 and "0 1 2 3 4 5" in out
    Path("irregular_six").mkdir()
    assert samples.find_scene("irregular_six").is_file()


def test_images_are_found_by_their_names(libocc: Run) -> None:
    code, out, _ = libocc("locate", "irregular_six_1", "irregular_six", "--json")
    assert code == 0 and json.loads(out)["ok"]
    assert libocc("detect", "irregular_six_1")[0] == 0
    assert libocc("identify", "irregular_six_1", "--map", "irregular_six")[0] == 0


def test_every_sample_is_listed_with_one_sentence(libocc: Run, root: Path) -> None:
    code, out, _ = libocc("samples")
    assert code == 0
    listed = [line.split(maxsplit=1) for line in out.splitlines() if line.startswith("  ")]
    for folder in ("scenes", "objects", "trajectories", "sweeps", "experiments"):
        for path in (root / "data" / folder).glob("*.yaml"):
            assert path.stem in [name for name, _ in listed]
    for path in (root / "data" / "images").glob("*.png"):
        assert path.stem in [name for name, _ in listed]
    assert "panorama" in [name for name, _ in listed]
    for name, text in listed:
        assert 15 < len(text) <= 130 and text.endswith("."), (name, text)
    code, out, _ = libocc("samples", "--json")
    data = json.loads(out)
    assert len(data) == len(listed) and all(Path(each["path"]).is_file() for each in data)
    assert {each["kind"] for each in data} == {kind.name for kind in samples.KINDS}


def test_an_installation_without_samples_is_an_error(
    libocc: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(samples, "FOLDER", tmp_path)
    code, _, err = libocc("samples")
    assert code == 2 and "without its samples" in err
