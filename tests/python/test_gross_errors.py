# SPDX-License-Identifier: Apache-2.0
"""Everything that an adjustment rejects has a name in the text, the JSON and the report."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import libocc as occ
from libocc.cli import main
from libocc.network.files import read_network
from libocc.network.tables import read_table

PANORAMA = Path(__file__).parents[2] / "data/calibration/panorama"


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The panoramas with four bars and seven control points, from the adjusted network."""
    shutil.copytree(PANORAMA, tmp_path / "network")
    path = tmp_path / "network" / "network.yaml"
    network, datum = read_network(path)
    adjusted = occ.network.adjust(network, datum=datum).network
    places = dict(zip(adjusted.point_names, np.asarray(adjusted.points_m)))
    data = yaml.safe_load(path.read_text())
    names = list(places)
    for a, b in (("target 20", "target 70"), ("target 33", "target 101"), ("target 5", "target 60")):
        length_m = float(np.linalg.norm(places[a] - places[b]))
        data["distances"].append({"from": a, "to": b, "length_m": length_m, "sigma_m": 5e-3})
    data["control"] = [
        {"target": name, "position_m": places[name].tolist(), "sigma_m": 5e-3} for name in names[8:120:16]
    ]
    data.pop("check_points")
    path.write_text(yaml.safe_dump(data))
    return path.parent


def change(folder: Path, section: str, index: int, **values: object) -> None:
    path = folder / "network.yaml"
    data = yaml.safe_load(path.read_text())
    data[section][index].update(values)
    path.write_text(yaml.safe_dump(data))


def test_nothing_else_is_rejected(folder: Path) -> None:
    status, text, _ = run("calibrate", "network", folder / "network.yaml", "--out", folder / "out")
    assert status == 0
    assert "6 of " in text and "image points" in text and "rejected" in text
    data = json.loads((folder / "out" / "result.json").read_text())
    assert data["rejected_distances"] == [] and data["rejected_control"] == []
    assert 0 < data["rejected_share"] < 0.02


def test_a_wrong_bar_is_named(folder: Path) -> None:
    length_m = yaml.safe_load((folder / "network.yaml").read_text())["distances"][2]["length_m"]
    change(folder, "distances", 2, length_m=1.01 * length_m)
    status, text, _ = run("calibrate", "network", folder / "network.yaml", "--out", folder / "out", "--ladder")
    assert status == 0
    assert "warning: distance 2 (target 33 to target 101" in text
    assert "1 of 4 distances" in text
    data = json.loads((folder / "out" / "result.json").read_text())
    assert [one["name"].split(" (")[0] for one in data["rejected_distances"]] == ["distance 2"]
    assert data["rejected_distances"][0]["residual_m"] == pytest.approx(0.01 * length_m, abs=0.01)
    assert "distance 2 (target 33" in (folder / "out" / "report.html").read_text()


def test_a_wrong_control_point_is_named(folder: Path) -> None:
    at = yaml.safe_load((folder / "network.yaml").read_text())["control"][3]
    change(folder, "control", 3, position_m=[at["position_m"][0], at["position_m"][1] + 0.05, at["position_m"][2]])
    status, text, _ = run("calibrate", "network", folder / "network.yaml", "--out", folder / "out")
    assert status == 0
    assert f"control point 3 ({at['target']}) is rejected: its y differs" in text
    data = json.loads((folder / "out" / "result.json").read_text())
    assert data["rejected_control"][0]["coordinate"] == "y"
    assert data["rejected_control"][0]["residual_m"] == pytest.approx(0.05, abs=0.02)
    named = {one["target"] for one in data["rejected"]}
    assert at["target"] not in named, "its image points are right"


def test_an_image_with_two_targets_is_left_out_by_name(folder: Path) -> None:
    observations = folder / "observations.csv"
    rows = observations.read_text().splitlines()
    kept = [row for row in rows if not row.startswith("S3,")] + [row for row in rows if row.startswith("S3,")][:2]
    observations.write_text("\n".join(kept) + "\n")
    assert len(list(read_table(observations, ("image", "target", "x_px", "y_px"), ("sigma_x_px", "sigma_y_px")))) < 500
    status, text, _ = run("calibrate", "network", folder / "network.yaml", "--out", folder / "out")
    assert status == 0, text
    assert "warning: station S3 is left out" in text
    data = json.loads((folder / "out" / "result.json").read_text())
    assert data["left_out"][0] == {
        "kind": "station", "name": "station S3",
        "reason": "keeps only 2 targets that others observe too; three are needed",
    }
    assert "Left out" in (folder / "out" / "report.html").read_text()


def test_bars_that_contradict_each_other_are_ambiguous(folder: Path) -> None:
    path = folder / "network.yaml"
    data = yaml.safe_load(path.read_text())
    data.pop("control")
    data["distances"] = data["distances"][:2]
    data["distances"][1]["length_m"] *= 1.05
    path.write_text(yaml.safe_dump(data))
    status, _, error = run("calibrate", "network", path, "--out", folder / "out")
    assert status == 1
    assert "ambiguous: distance" in error and "contradict each other" in error
    assert json.loads((folder / "out" / "result.json").read_text())["status"] == "ambiguous"
