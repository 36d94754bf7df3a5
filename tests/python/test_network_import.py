# SPDX-License-Identifier: Apache-2.0
"""Networks of AICON, PhotoModeler and DBAT: simulated and real ones with their reports, and malformed files."""

from pathlib import Path

import numpy as np
import pytest
from network_formats import FIELD, FOCAL, K1, P2, aicon_files, photomodeler_lines, write_aicon, write_dbat

import libocc as occ
from libocc.network.importing import import_network

SHARED = Path(__file__).parents[3] / "shared/data/networks"
Target = occ.network.Target


def test_aicons_network_is_read_without_residuals(tmp_path: Path) -> None:
    found = import_network(write_aicon(tmp_path, aicon_files()))
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.free_parameters == [["f_px", "cx_px", "cy_px", "a1", "a2", "b1", "b2"]]
    assert np.allclose(np.asarray(found.network.observations)[0, 6:8], [0.1, 0.2])
    ((start, end, length, sigma, used),) = found.network.distances
    assert length == pytest.approx(np.linalg.norm(FIELD.points[3] - FIELD.points[8])) and sigma == 1e-5 and used
    assert np.allclose(np.asarray(found.network.points_m), FIELD.points)
    text = "\n".join(found.notes)
    assert "1 points are not active and were left out: 999" in text and "1 image points are not active" in text


WRONG_AICON = [
    ("phc", 2, "1 102 x 1 1 1 0 0 1 1 1", "job.phc:3: field `x`: must be a finite number, got 'x'"),
    ("phc", 2, "1 102 1 1 0 1 0 0 1 1 1", "job.phc:3: field `sx`: must be positive, got '0'"),
    ("phc", 2, "1 102 1 1", "job.phc:3: must have at least 11 fields"),
    ("phc", 2, "1 101 1 1 1 1 0 0 1 1 1", "job.phc:3: point 101 occurs twice in image 1, first in line 2"),
    ("eor", 1, "2 7 1 2 3 0 0 0 0 307 3", "job.eor:2: field `camera`: must be one of 1, got '7'"),
    ("eor", 1, "2 1 1 2 3 0 0 0 5 307 3", "job.eor:2: field `order`: must be 0"),
    ("obc", 1, "100 1 2 3 0 0 0 0 1 1 0", "job.obc:2: point 100 occurs twice"),
    ("ior", 0, "1 -999 28.8 0 0 0 0 0", "job.ior:1: field `ck`: must be negative, got '28.8'"),
    ("ior", 4, "36.0 24.0 7200 0", "job.ior:5: field `rows`: must be at least 1, got '0'"),
    ("ior", 4, "", "job.ior:4: must be followed by all five lines of the camera, got 4"),
    ("scale", 0, '0 "bar" 103 777 1 0.01 1', "job.scale:1: field `to`: must be a point of the .obc file, got '777'"),
    ("scale", 0, "0 103 108 1 0.01 1", "job.scale:1: must be a number, a name in quotation marks"),
]


@pytest.mark.parametrize(("suffix", "line", "text", "complaint"), WRONG_AICON, ids=[w[3][:40] for w in WRONG_AICON])
def test_a_malformed_file_of_aicon_is_named(tmp_path: Path, suffix: str, line: int, text: str, complaint: str) -> None:
    files = aicon_files()
    files[suffix][line] = text
    with pytest.raises(ValueError) as raised:
        import_network(write_aicon(tmp_path, files))
    assert complaint in str(raised.value)


def test_names_in_the_encoding_of_windows_and_short_lines_are_read(tmp_path: Path) -> None:
    files = aicon_files()
    path = write_aicon(tmp_path, {**files, "obc": [" ".join(line.split()[:4]) for line in files["obc"][:-1]]})
    (tmp_path / "job.scale").write_bytes(files["scale"][0].replace("Scale bar", "Maßstab").encode("cp1252"))
    found = import_network(path)
    assert len(found.network.point_names) == 25 and len(found.network.distances) == 1
    (tmp_path / "job.obc").write_bytes("100 1 2 3\n".encode("utf-16"))
    with pytest.raises(ValueError, match=r"job\.obc:1: is encoded as UTF-16"):
        import_network(path)


def test_one_sigma_replaces_those_of_the_files(tmp_path: Path) -> None:
    files = aicon_files()
    files["phc"][0] = files["phc"][0].replace("0.0005 0.001", "0 0")
    path = write_aicon(tmp_path, files)
    with pytest.raises(ValueError, match="field `sx`: must be positive"):
        import_network(path)
    found = import_network(path, sigma_px=0.25)
    assert (np.asarray(found.network.observations)[:, 6:8] == 0.25).all()
    with pytest.raises(ValueError, match="sigma_px must be positive and finite, got -1"):
        import_network(path, sigma_px=-1)


def test_a_folder_of_one_aicon_network_is_read(tmp_path: Path) -> None:
    path = write_aicon(tmp_path, aicon_files())
    found, same = import_network(tmp_path), import_network(path)
    assert found.network.point_names == same.network.point_names and found.notes == same.notes
    (tmp_path / "other.phc").write_text("")
    with pytest.raises(ValueError, match="is in none of the formats"):
        import_network(tmp_path)


def test_the_one_network_of_a_folder_is_adjusted(libocc, tmp_path: Path) -> None:
    folder = tmp_path / "job"
    folder.mkdir()
    script = write_dbat(folder)
    assert occ.network.importing.source_of(folder) == (script, "dbat")
    code, text, errors = libocc("calibrate", "network", folder, "--sigma-px", 0.2, "--out", "one")
    assert code == 0, errors
    assert occ.network.import_network(folder, sigma_px=0.2).network.observations[0][6] == 0.2
    (folder / "again.xml").write_bytes(script.read_bytes())
    code, text, errors = libocc("calibrate", "network", folder, "--out", "two")
    assert code == 2 and "has several networks: again.xml (dbat), " in errors and "give one of them" in errors
    (tmp_path / "empty").mkdir()
    code, text, errors = libocc("calibrate", "network", tmp_path / "empty", "--out", "none")
    assert code == 2 and "is a folder without a network of aicon, colmap, kalibr" in errors
    code, text, errors = libocc("calibrate", "network", "panorama", "--sigma-px", 0.2, "--out", "own")
    assert code == 2 and "--sigma-px: is used with networks of other programs only" in errors


def test_a_missing_file_of_aicon_is_named(tmp_path: Path) -> None:
    path = write_aicon(tmp_path, aicon_files())
    (tmp_path / "job.obc").unlink()
    with pytest.raises(FileNotFoundError, match=r"job\.obc"):
        import_network(path)


def test_photomodelers_network_is_read_without_residuals(tmp_path: Path) -> None:
    path = tmp_path / "export.txt"
    path.write_text("\n".join(photomodeler_lines()))
    found = import_network(path)
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.image_names[3] == "im3.jpg"
    ((target, at, matrix),) = found.network.control
    assert target == Target.point(0) and np.allclose(matrix, np.diag([1e-6, 4e-6, 9e-6]))
    assert found.datum.kind is occ.network.DatumKind.control
    known = tmp_path / "control.txt"
    known.write_text("# id, label, x, y, z\n2, a, 1, 2, 3\n5, b, 4, 5, 6, 0.5\n77, c, 0, 0, 0\n")
    controlled = import_network(path, control=known)
    assert [k for k, fixed in enumerate(controlled.network.points_fixed) if fixed] == [1]
    assert np.allclose(controlled.network.points_m[1], [1, 2, 3])
    assert len(controlled.network.control) == 2 and any("77" in note for note in controlled.notes)


def test_smart_points_of_photomodeler_are_left_out_and_named(tmp_path: Path) -> None:
    lines = photomodeler_lines()
    last = max(k for k, line in enumerate(lines) if line.startswith("25 "))
    lines.insert(last + 1, "3 9 9 9 0.1 0.1 0.1")
    mark = max(k for k, line in enumerate(lines) if line.startswith("5 25 "))
    lines.insert(mark + 1, "0 3 100 100 0 0")
    (tmp_path / "export.txt").write_text("\n".join(lines))
    found = import_network(tmp_path / "export.txt")
    assert len(found.network.point_names) == 25 and len(found.network.observations) == 150
    text = "\n".join(found.notes)
    assert "1 points with a number that occurs before (smart points) were left out: 3" in text
    assert "1 image points without a standard deviation were left out" in text


@pytest.mark.parametrize(("line", "text", "complaint"), [
    (1, "0.0005 20", ":2: has no image size"),
    (6, "0 1 2 3 4 5", ":7: must have 7 fields (picture, x, y, z, kappa, phi, omega), got 6"),
    (9, "0 7.46 a 2.6 7.2 5.4 0 0 0 0 0", ":10: field `xp`: must be a finite number, got 'a'"),
    (60, "1 2 3", "must have 7 fields (point, x, y, z, sx, sy, sz), got 3"),
])
def test_a_malformed_file_of_photomodeler_is_named(tmp_path: Path, line: int, text: str, complaint: str) -> None:
    lines = photomodeler_lines()
    lines[line] = text
    (tmp_path / "export.txt").write_text("\n".join(lines))
    with pytest.raises(ValueError) as raised:
        import_network(tmp_path / "export.txt")
    assert complaint in str(raised.value)


def test_a_script_of_dbat_starts_from_its_control_points(tmp_path: Path) -> None:
    found = import_network(write_dbat(tmp_path))
    assert len(found.network.image_names) == 6 and len(found.network.observations) == 150
    assert [k for k, fixed in enumerate(found.network.points_fixed) if fixed] == [0, 1]
    assert len(found.network.control) == 4 and found.datum.kind is occ.network.DatumKind.control
    adjusted = occ.network.adjust(found.network, datum=found.datum, robust=False, snooping=False)
    assert adjusted.ok and adjusted.sigma0 < 1e-6
    camera = adjusted.network.cameras[0]
    assert camera.fy_px / (1800 / 5.4) == pytest.approx(FOCAL, rel=1e-6)
    assert camera.distortion[0] == pytest.approx(K1, rel=1e-4) and camera.distortion[4] == pytest.approx(-P2, rel=1e-2)
    assert np.allclose(np.asarray(adjusted.network.points_m), FIELD.points, atol=1e-6)


@pytest.mark.parametrize(("file", "old", "new", "complaint"), [
    ("job.xml", "</input>", "<input>", "job.xml:12: is not valid XML"),
    ("job.xml", "<focal>7.5", "<focal>x", "job.xml: element `focal`: must be 1 numbers, got 'x'"),
    ("job.xml", "<model>3", "<model>1", "job.xml: element `model`: must be 2 or 3 (backward), got 1"),
    ("job.xml", "<nK>2", "<nK>4", "job.xml: elements `nK` and `nP`: must be 0 to 3, and 0 or 2, got 4 and 2"),
    ("job.xml", "im,id,x,y,sxy", "im,id,x,sxy,q", "field 'q' is unknown; allowed: im, id, x, y"),
    ("job.xml", "im,id,x,y,sxy", "im,id,x,sx,sy", "has no field 'y'"),
    ("job.xml", "marks.txt", "absent.txt", "absent.txt"),
    ("job.xml", "auto,5.4", "auto", "job.xml: element `sensor`: must have a positive height, got ['auto']"),
    ("measured/marks.txt", "0, 2, ", "0, 2, a", "marks.txt:2: field `x`: must be a finite number, got 'a"),
    ("measured/marks.txt", "0, 2, ", "0, 1, ", "marks.txt:2: point 1 occurs twice in image 0, first in line 1"),
    ("measured/marks.txt", ", 0.1\n", "\n", "marks.txt:1: must have 5 fields (im, id, x, y, sxy), got 4"),
    ("measured/control.txt", ", 0.001\n", ", -1\n", "control.txt:4: field `sxyz`: must be zero or positive"),
    ("measured/control.txt", "3, P3", "2, P3", "control.txt:4: control point 2 occurs twice"),
])
def test_a_malformed_script_of_dbat_is_named(tmp_path: Path, file: str, old: str, new: str, complaint: str) -> None:
    script = write_dbat(tmp_path)
    text = (tmp_path / file).read_text()
    assert old in text
    (tmp_path / file).write_text(text.replace(old, new, 1))
    with pytest.raises((ValueError, FileNotFoundError)) as raised:
        import_network(script)
    assert complaint in str(raised.value)


# Values and standard deviations of AICON's report of its example.
AICON_REPORT = {
    "f_px": (28.78507, 2.513178e-4), "cx_px": (1.734892e-2, 3.441658e-4), "cy_px": (5.668731e-2, 3.262600e-4),
    "a1": (-1.096069e-4, 2.978787e-8), "a2": (1.495660e-7, 7.655524e-11), "b1": (5.798428e-6, 1.190972e-7),
    "b2": (-8.644540e-6, 1.043919e-7),
}


@pytest.mark.skipif(not (SHARED / "aicon").exists(), reason="needs the networks of other programs")
def test_aicons_example_gives_the_values_of_its_report() -> None:
    px_per_mm = np.array([8688 / 35.968, 5792 / 23.979])
    found = import_network(SHARED / "aicon/example.phc", sigma_px=0.0005 * px_per_mm[0])  # S0 a priori 0.0005 mm
    adjusted = occ.network.adjust(found.network)
    assert adjusted.ok and adjusted.rejected == []  # as in the report
    assert (adjusted.observations, adjusted.unknowns, adjusted.defect) == (19945, 1147, 6)
    assert adjusted.redundancy == 18804
    assert adjusted.sigma0 * 0.0005 == pytest.approx(0.000405, abs=1e-6)
    assert adjusted.sigma0 * 0.0005 * px_per_mm[0] == pytest.approx(0.098, abs=5e-4)
    known = occ.network.precision(adjusted.network).scaled(adjusted.sigma0**2)
    camera = adjusted.network.cameras[0]
    centre = np.array([(8688 - 1) / 2, (5792 - 1) / 2])
    values = {name: occ.network.free_parameter_value(camera, name).value for name in AICON_REPORT}
    values["f_px"] /= px_per_mm[0]
    values["cx_px"] = (values["cx_px"] - centre[0]) / px_per_mm[0]
    values["cy_px"] = (centre[1] - values["cy_px"]) / px_per_mm[1]
    values["b2"] = -values["b2"]
    units = dict.fromkeys(AICON_REPORT, 1.0) | {"f_px": px_per_mm[0], "cx_px": px_per_mm[0], "cy_px": px_per_mm[1]}
    for k, name in enumerate(adjusted.network.free_parameters[0]):
        value, sigma = AICON_REPORT[name]
        assert values[name] == pytest.approx(value, abs=0.25 * sigma), name
        assert np.sqrt(known.parameters(0)[k, k]) / units[name] == pytest.approx(sigma, rel=1e-3), name


@pytest.mark.skipif(not (SHARED / "aicon").exists(), reason="needs the networks of other programs")
def test_aicons_example_starts_from_its_images_alone(tmp_path: Path) -> None:
    reference = import_network(SHARED / "aicon/example.phc").network
    files = {name: content.decode().splitlines() for name, content in occ.network.network_files(reference).items()}
    files["images.csv"] = [",".join(line.split(",")[:2]) for line in files["images.csv"]]
    files["points.csv"] = [line.split(",")[0] for line in files["points.csv"]]
    for name, lines in files.items():
        (tmp_path / name).write_text("\n".join(lines) + "\n")
    plain = {"robust": False, "snooping": False}
    network, _ = occ.network.read_network(tmp_path / "network.yaml")  # 115 images, 150 points
    started, expected = occ.network.adjust(network, **plain), occ.network.adjust(reference, **plain)
    assert started.ok and started.redundancy == expected.redundancy
    assert started.cost == pytest.approx(expected.cost, rel=1e-6)


@pytest.mark.skipif(not (SHARED / "dbat").exists(), reason="needs the networks of other programs")
def test_dbats_example_gives_the_values_of_its_reports() -> None:
    dbat = SHARED / "dbat"
    plain = {"robust": False, "snooping": False}
    export = import_network(dbat / "camcal-pmexport.txt", control=dbat / "camcal-fixed.txt")
    found = occ.network.adjust(export.network, datum=export.datum, **plain)
    assert found.ok and (found.observations, found.unknowns, found.redundancy) == (4148, 423, 3725)
    camera = found.network.cameras[0]
    px_per_mm = 1704 / 5.43764
    known = occ.network.precision(found.network, export.datum).scaled(found.sigma0**2)
    assert camera.fy_px / px_per_mm == pytest.approx(7.45700, abs=0.5 * 0.00105)
    assert np.sqrt(known.parameters(0)[1, 1]) / px_per_mm == pytest.approx(0.00105, abs=5e-6)

    # DBAT minimises residuals of corrected coordinates: its sigma0 is that of our residuals on the ideal image.
    def ideal(pixel: np.ndarray) -> np.ndarray:
        bearing = np.asarray(camera.unproject(pixel))
        return np.array([camera.fx_px, camera.fy_px]) * bearing[:2] / bearing[2]

    total = 0.0
    steps = 1e-3 * np.eye(2)
    for row, residual in zip(np.asarray(found.network.observations), occ.network.image_residuals_px(found.network)):
        jacobian = np.stack([(ideal(row[4:6] + d) - ideal(row[4:6] - d)) / 2e-3 for d in steps], axis=1)
        total += float(np.sum((jacobian @ residual / 0.1) ** 2))
    assert np.sqrt(total / found.redundancy) == pytest.approx(1.6148, abs=2e-3)

    free = import_network(dbat / "camcal-pmexport.txt")
    assert occ.network.adjust(free.network, **plain).defect == 7


@pytest.mark.skipif(not (SHARED / "dbat").exists(), reason="needs the networks of other programs")
def test_a_script_of_dbat_gives_the_solution_of_its_export() -> None:
    dbat = SHARED / "dbat"
    script = import_network(dbat / "camcaldemo.xml")
    assert len(script.network.image_names) == 21 and sum(script.network.points_fixed) == 4
    plain = {"robust": False, "snooping": False}
    found = occ.network.adjust(script.network, datum=script.datum, **plain)
    export = import_network(dbat / "camcal-pmexport.txt", control=dbat / "camcal-fixed.txt")
    expected = occ.network.adjust(export.network, datum=export.datum, **plain)
    assert found.ok and expected.ok
    assert found.redundancy == expected.redundancy and found.sigma0 == pytest.approx(expected.sigma0, rel=1e-6)
