# SPDX-License-Identifier: Apache-2.0
"""Objects of points: values and files, poses, recognition, detectable points, value of points."""

import json
import math
import pickle

import numpy as np
import pytest

import libocc as occ

CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=800, fy_px=800, cx_px=319.5, cy_px=239.5)
BOX = np.array([[x, y, z] for x in (0, 3) for y in (0, 2) for z in (0, 1)], float)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])
VIEW = ("simulate", "parking", "--position", 9, 2, 1.4, "--look-at", 2, 0.9, 0.7, "--seed", 1, "--out", "night.png")


@pytest.fixture
def car(root):
    return occ.objects.Object.load(root / "data" / "objects" / "car.yaml")


@pytest.fixture
def beacon(root):
    return occ.objects.Object.load(root / "data" / "objects" / "beacon.yaml")


def seen(thing, pose, rng, sigma_px=0.2):
    """Blobs of the points visible to a camera, as from detect(), and their indices."""
    image = np.full((480, 640), 10.0)
    points = []
    y, x = np.mgrid[:480, :640]
    eye = -pose[:3, :3].T @ pose[:3, 3]
    for i, p in enumerate(thing.points):
        ray = eye - p.position_m
        if ray @ p.normal < math.cos(p.cone_rad) * np.linalg.norm(ray):
            continue
        px = CAMERA.project(pose[:3, :3] @ p.position_m + pose[:3, 3]) + sigma_px * rng.normal(size=2)
        image += 150 * np.exp(-((x - px[0]) ** 2 + (y - px[1]) ** 2) / 2)
        points.append(i)
    return occ.detect(image.clip(0, 255).round().astype(np.uint8)), points


def test_objects_are_values_and_files(car, tmp_path):
    point = occ.objects.ObjectPoint(id=3, position_m=[1, 2, 3], cone_rad=math.pi, label="top")
    assert repr(point) == repr(pickle.loads(pickle.dumps(point))) and "label='top'" in repr(point)
    made = occ.objects.Object(name="one", points=[point])
    made.save(tmp_path / "one.yaml")
    assert occ.objects.Object.load(tmp_path / "one.yaml").format() == made.format()
    assert pickle.loads(pickle.dumps(car)).format() == car.format() == occ.objects.Object.parse(car.format()).format()
    assert made.replace(name="two").name == "two" and "18 points" in repr(car)
    with pytest.raises(ValueError, match="id must be unique, got 3"):
        occ.objects.Object(name="one", points=[point, point])
    with pytest.raises(ValueError, match=r"cone_deg.*\(0, 180\], got 200"):
        occ.objects.Object.parse(made.format().replace("cone_deg: 180", "cone_deg: 200"))
    with pytest.raises(FileNotFoundError, match="none.yaml"):
        occ.objects.Object.load(tmp_path / "none.yaml")


def test_identify_object_finds_its_pose(beacon):
    pose = occ.look_at([1.6, 0.5, 0.6], [0.05, 0, 0.3])
    blobs, points = seen(beacon, pose, np.random.default_rng(1))
    found = occ.objects.identify_object(blobs, beacon, CAMERA, gate_model_sigma_px=0.2)
    assert found.ok and len(points) >= 6
    best = found.hypotheses[0]
    assert sorted(m.lamp for m in best.matches) == points
    np.testing.assert_allclose(best.cam_from_world, pose, atol=0.03)


def test_recognise_distinguishes_objects(beacon, car):
    blobs, _ = seen(beacon, occ.look_at([1.2, -0.9, 0.7], [0.05, 0, 0.3]), np.random.default_rng(2))
    found = occ.objects.recognise(blobs, [car, beacon], CAMERA, gate_model_sigma_px=0.2)
    assert found.ok and [o.match.object for o in found.found] == [1]
    match = found.found[0].match
    assert match.log10_false_alarms < -3 and match.plausible == 1 and not found.found[0].rivals
    assert found.log10_false_alarms[1] == match.log10_false_alarms < found.log10_false_alarms[0]
    both = [beacon, beacon.replace(name="duplicate")]
    duplicates = occ.objects.recognise(blobs, both, CAMERA, gate_model_sigma_px=0.2)
    assert duplicates.status is occ.Status.ambiguous and len(duplicates.found[0].rivals) == 1
    assert occ.objects.recognise(blobs[:3], [car], CAMERA).status is occ.Status.too_few_lamps
    with pytest.raises(ValueError, match="max_false_alarms"):
        occ.objects.recognise(blobs, [car], CAMERA, max_false_alarms=0)


def test_detectable_points_of_a_box():
    points = occ.objects.detectable_points(BOX, FACES)
    assert len(points) == 8 and all(p.edges == 3 and abs(p.edges_m - 6) < 1e-9 for p in points)
    middle = BOX.mean(axis=0)
    for found in points:
        assert (found.point.position_m - middle) @ found.point.normal > 0
        assert 2.1 < found.point.cone_rad < 2.6
    with pytest.raises(ValueError, match=r"faces\[0\]"):
        occ.objects.detectable_points(BOX, FACES + 8)
    with pytest.raises(ValueError, match="sharp_rad"):
        occ.objects.detectable_points(BOX, FACES, sharp_rad=-1)


@pytest.mark.parametrize("kind", ["obj", "ply", "stl"])
def test_meshes_are_read(kind, tmp_path, libocc):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"box.{kind}"
    trimesh.Trimesh(BOX, FACES, process=False).export(path)
    points = occ.objects.detectable_points(*occ.objects.read_mesh(path))
    found = sorted(tuple(p.point.position_m.round(6) + 0.0) for p in points)
    assert found == sorted(map(tuple, BOX))
    libocc(*VIEW)
    options = ("--camera", "parking", "--distance", 12, "--out", "box.yaml", "--plot", "box.png")
    code, out, _ = libocc("points", path, *options)
    assert code == 0 and len(out.splitlines()) == 10
    assert len(occ.objects.Object.load("box.yaml").points) == 8
    assert (tmp_path / "box.png").read_bytes()[:4] == b"\x89PNG"


def test_invalid_meshes_are_rejected(tmp_path, libocc):
    with pytest.raises(OSError, match="nosuch.stl"):
        occ.objects.read_mesh(tmp_path / "nosuch.stl")
    pytest.importorskip("trimesh")
    (tmp_path / "text.stl").write_text("not a mesh")
    code, _, err = libocc("points", "text.stl", "--camera", "parking")
    assert code == 2 and "text.stl" in err and len(err.splitlines()) == 1


def test_worth_of_points(beacon):
    value = occ.objects.localisation_value(beacon, CAMERA, occ.objects.views_around(beacon, [2.0], 60), 0.3)
    assert len(value.points) == len(beacon.points) and 0.9 < value.determined <= 1
    arm = value.points[6]
    assert arm.seen == pytest.approx(1) and arm.growth == max(p.growth for p in value.points)
    near = occ.objects.localisation_value(beacon, CAMERA, occ.objects.views_around(beacon, [1.0], 60), 0.3)
    assert near.sigma_m < value.sigma_m
    with pytest.raises(ValueError, match="sigma_px"):
        occ.objects.localisation_value(beacon, CAMERA, [np.eye(4)], 0)


def test_command_recognises_car_and_beacon(libocc, tmp_path):
    assert libocc(*VIEW)[0] == 0
    arguments = ("recognise", "night.png", "car", "beacon", "--camera", "parking", "--sigma-px", 0.1)
    code, out, err = libocc(*arguments, "--json", "--overlay", "seen.png")
    found = json.loads(out)
    assert code == 0, out + err
    assert {o["object"] for o in found["found"]} == {"car", "beacon"}
    truth = json.loads((tmp_path / "night.json").read_text())
    at = {o["object"]: np.array(o["poses"][0]["cam_from_object"]) for o in found["found"]}
    np.testing.assert_allclose(at["car"], truth["cam_from_world"], atol=0.05)
    assert (tmp_path / "seen.png").read_bytes()[:4] == b"\x89PNG"
    code, out, _ = libocc("recognise", "night.png", "car", "--camera", "parking", "--sigma-px", 0.1, "--json")
    assert code == 0 and [o["object"] for o in json.loads(out)["found"]] == ["car"]


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("recognise", "nosuch.png", "car", "--camera", "parking"), "nosuch.png"),
        (("recognise", "small.png", "car", "--camera", "parking"), "small.png: .*40"),
        (("recognise", "small.png", "bad.yaml", "--camera", "parking"), r"bad\.yaml.*points\[0\]\.position_m"),
        (("recognise", "small.png", "car", "--camera", "nosuch"), "nosuch"),
        (("points", "nosuch", "--camera", "parking"), "nosuch"),
        (("points", "nosuch.obj", "--camera", "parking"), "nosuch.obj"),
        (("points", "car", "--camera", "parking", "--distance", -1), "distances_m"),
        (("points", "car", "--camera", "parking", "--plot", "nowhere/p.png"), "nowhere/p.png"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(libocc, tmp_path, arguments, text):
    (tmp_path / "bad.yaml").write_text("schema: libocc-object/1\nname: bad\npoints:\n  - {id: 0}\n")
    occ.write_image(str(tmp_path / "small.png"), np.zeros((30, 40), np.uint8))
    code, _, err = libocc(*arguments)
    assert code == 2 and len(err.splitlines()) == 1
    import re

    assert re.search(text, err), err
