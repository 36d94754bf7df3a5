# SPDX-License-Identifier: Apache-2.0
"""Network files say everything: rigs, fixed elements, control, priors and datum go to files and back."""

import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import libocc as occ
from libocc.cli import main
from libocc.network.files import network_files, read_network, read_network_and_checks
from libocc.network.poses import pose_covariance
from libocc.network.sections import POSE
from libocc.network.tables import read_table

Target = occ.network.Target
SIGMAS = ("sigma_rx_rad", "sigma_ry_rad", "sigma_rz_rad", "sigma_y_m", "sigma_z_m")
CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=500, fy_px=505, cx_px=320, cy_px=240)


def pose(x: float, y: float, z: float) -> np.ndarray:
    return np.asarray(occ.look_at([x, y, z], [0, 0, 0], [0, 0, 1]))


def covariance(size: int, seed: int) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(size, size))
    return np.asarray(1e-6 * (root @ root.T + np.eye(size)))


def rich_network(rig: bool) -> occ.network.Network:
    """A network with every kind of element."""
    network = occ.network.Network()
    network.add_camera("left", CAMERA, ["f_px", "cx_px"])
    network.add_camera("right camera", CAMERA, [])
    if rig:
        network.add_station("place 1", pose(4, 1, 2))
        network.add_station("place 2", pose(3, -2, 1), True)
        network.add_mount("left", np.eye(4), True)
        network.add_mount("right", pose(0.2, 0, 0.01))
        network.add_image("a.png", 0, station=1, mount=0)
        network.add_image("b.png", 1, station=1, mount=1)
        network.add_image("c.png", 0, station=0)
    else:
        network.add_image("a.png", 0, station=network.add_station("a.png", pose(4, 1, 2)))
        network.add_image("b.png", 1, station=network.add_station("b.png", pose(3, -2, 1), True))
    network.add_point("p 1", [0.1, 0.2, 1 / 3], True)
    network.add_point("p, \"2\"", [0.3, -0.2, 0.1])
    corners = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    network.add_body("tag 7", corners, np.eye(4), scale_free=True)
    network.add_body("board", 0.1 * np.eye(3), pose(0.2, 0.3, 0.1), fixed=True)
    for image in range(len(network.image_names)):
        network.observe(image, [Target.point(0), Target.point(1), Target.corner(0, 2)], np.arange(6).reshape(3, 2), 0.3)
    network.add_distance(Target.point(0), Target.corner(1, 2), 1 / 7, 1e-4)
    network.add_control(Target.point(1), [0.3, -0.2, 0.1], np.diag([1e-6, 4e-6, 9e-6]))
    network.add_control(Target.corner(0, 1), [0.1, 0.1, 0], covariance(3, 1))
    network.add_parameter_prior(0, "f_px", 501.0, 1 / 3)
    network.add_pose_prior(0, pose(4, 1, 2.1), covariance(6, 2))
    return network


def plain(value: object) -> object:
    """Nested tuples and lists with arrays as lists of numbers, rounded where poses went through quaternions."""
    if isinstance(value, np.ndarray):
        return np.round(value, 12).tolist()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


PROPERTIES = [
    "body_corners_m", "body_names", "body_poses", "body_scales", "bodies_fixed", "bodies_scale_free", "camera_names",
    "cameras", "control", "distances", "free_parameters", "image_cameras", "image_mounts", "image_names",
    "image_stations", "mount_names", "mount_poses", "mounts_fixed", "observations", "parameter_priors", "point_names",
    "points_fixed", "points_m", "pose_priors", "station_names", "station_poses", "stations_fixed",
]


@pytest.mark.parametrize("rig", [False, True])
def test_every_element_goes_to_files_and_back(tmp_path: Path, rig: bool) -> None:
    network = rich_network(rig)
    assert {*PROPERTIES, "outlines"} == {  # outlines have no place in a file, which a comment in it says
        name for name in dir(occ.network.Network)
        if not name.startswith("_") and isinstance(getattr(occ.network.Network, name), property)
    }, "a property is missing in this test"
    datum = occ.network.Datum(kind=occ.network.DatumKind.minimal, targets=[Target.point(1), Target.corner(0, 3)])
    checks = {"p 1": [0.25, 1 / 3, 2.0]}
    for name, content in network_files(network, datum, checks).items():
        (tmp_path / name).write_bytes(content)
    again, again_datum, again_checks = read_network_and_checks(tmp_path / "network.yaml")
    assert again_checks == checks
    for name in PROPERTIES:
        assert plain(getattr(again, name)) == plain(getattr(network, name)), name
    assert again_datum.kind is datum.kind and again_datum.targets == datum.targets
    assert network_files(again, again_datum).keys() == network_files(network, datum).keys()


def test_names_that_a_file_cannot_refer_to_are_refused() -> None:
    network = rich_network(False)
    network.add_point("p 1", [0, 0, 0])
    with pytest.raises(ValueError, match="point 'p 1' occurs twice"):
        network_files(network)
    other = occ.network.Network()
    other.add_camera("a/b", CAMERA)
    with pytest.raises(ValueError, match="camera 'a/b' must have a name that can be the name of a file"):
        network_files(other)


HEAD = "schema: libocc-network/1\ncameras:\n  - {name: camera, file: camera.yaml, free: []}\n"
TABLES = {
    "images.csv": "name,camera,x_m,y_m,z_m,qw,qx,qy,qz\nimage,camera,0,0,-2,1,0,0,0\nother,camera,1,0,-2,1,0,0,0\n",
    "points.csv": "name,x_m,y_m,z_m\na,0,0,0\nb,0.1,0,0\n",
    "observations.csv": "image,target,x_px,y_px\nimage,a,320,240\nimage,b,345,240\nother,a,70,240\n",
}


def written(tmp_path: Path, more: str = "", camera: occ.Camera = CAMERA, **tables: str) -> Path:
    for name, text in {**TABLES, **{f"{key}.csv": value for key, value in tables.items()}}.items():
        (tmp_path / name).write_text(text)
    occ.write_camera(tmp_path / "camera.yaml", camera)
    path = tmp_path / "network.yaml"
    path.write_text(HEAD + "images: images.csv\npoints: points.csv\nobservations: observations.csv\n" + more)
    return path


def test_control_points_have_one_sigma_three_or_a_covariance(tmp_path: Path) -> None:
    network, _ = read_network(written(tmp_path, """control:
  - {target: a, position_m: [0, 0, 0], sigma_m: 0.002}
  - {target: a, position_m: [0, 0, 0], sigma_m: [0.001, 0.002, 0.003]}
  - {target: b, position_m: [0, 0, 0], covariance_m2: [[4e-6, 1e-6, 0], [1e-6, 9e-6, 0], [0, 0, 1e-6]]}
"""))
    matrices = [matrix for _, _, matrix in network.control]
    assert np.allclose(matrices[0], 4e-6 * np.eye(3), rtol=1e-12)
    assert np.allclose(matrices[1], np.diag([1e-6, 4e-6, 9e-6]), rtol=1e-12)
    assert matrices[2][0, 1] == 1e-6 and matrices[2][1, 1] == 9e-6


def test_a_pose_prior_has_sigmas_along_the_worlds_axes(tmp_path: Path) -> None:
    c, s = math.cos(0.4), math.sin(0.4)
    network, _ = read_network(written(tmp_path, f"""pose_priors:
  - {{image: image, position_m: [1, 2, 3], quaternion: [{c!r}, 0, {s!r}, 0], sigma_rad: [0.01, 0.02, 0.03],
      sigma_m: [0.1, 0.2, 0.3]}}
"""))
    ((station, at, matrix),) = network.pose_priors
    assert station == 0 and np.allclose(-at[:3, :3].T @ at[:3, 3], [1, 2, 3])
    assert np.allclose(occ.smoothing.position_covariance(at, matrix), np.diag([0.01, 0.04, 0.09]))
    assert np.allclose(matrix[:3, :3], np.diag([1e-4, 4e-4, 9e-4]))
    assert np.allclose(matrix, pose_covariance(at, np.array([0.01, 0.02, 0.03]), np.array([0.1, 0.2, 0.3])))


def test_priors_of_poses_and_fixed_images_are_used(tmp_path: Path) -> None:
    field = occ.network.simulate_test_field(occ.network.TestFieldDesign(
        camera=occ.network.paper_panorama_camera(), free_parameters=["c_px"], stations=3, targets=30, seed=3,
    ))
    files = network_files(field.truth)  # start values in error would contradict a prior of 1e-9
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    images = files["images.csv"].decode().splitlines()
    fixed = [images[0] + ",fixed", images[1] + ",1", images[2] + ",0", images[3] + ","]
    (tmp_path / "images.csv").write_text("\n".join(fixed) + "\n")
    row = images[2].split(",")
    prior = (f"pose_priors:\n  - {{image: {row[0]}, position_m: [{', '.join(row[2:5])}], "
             f"quaternion: [{', '.join(row[5:])}], sigma_rad: 1e-9, sigma_m: 1e-9}}\n")
    (tmp_path / "network.yaml").write_text(files["network.yaml"].decode() + prior)
    network, datum = read_network(tmp_path / "network.yaml")
    adjusted = occ.network.adjust(network, datum=datum)
    assert adjusted.ok and adjusted.defect == 0
    known = occ.network.precision(adjusted.network)
    assert np.all(known.station(0) == 0) and 0 < np.sqrt(known.station(1)[3, 3]) < 1.1e-9
    assert np.allclose(adjusted.network.cam_from_world(0), network.cam_from_world(0), atol=1e-14)


def test_the_same_target_twice_in_an_image_names_both_lines(tmp_path: Path) -> None:
    twice = TABLES["observations.csv"] + "image,a,321,240\n"
    with pytest.raises(ValueError) as raised:
        read_network(written(tmp_path, observations=twice))
    text = str(raised.value)
    assert text == (f"{tmp_path}/observations.csv:5: target 'a' occurs twice in image 'image', first in line 2; "
                    "keep one of the two observations")


def test_a_panorama_may_show_a_target_twice_a_period_apart(tmp_path: Path) -> None:
    camera = occ.Camera.rotating_line(width=640, height=480, c_px=100, angle_per_px_rad=2 * np.pi / 600)
    seen = "image,target,x_px,y_px\nimage,a,10,240\nimage,a,610.2,240\n"
    network, _ = read_network(written(tmp_path, camera=camera, observations=seen))
    assert len(network.observations) == 2
    with pytest.raises(ValueError, match=r"observations.csv:3: target 'a' occurs twice"):
        read_network(written(tmp_path, camera=camera, observations=seen.replace("610.2", "12")))


WRONG = [
    ({"points": "name,x_m,y_m,z_m\na,0,0,0\nb,0,0,0\na,1,1,1\n"}, "", "points.csv:4: point 'a' occurs twice, first at"),
    ({}, "control: [{target: a, position_m: [0, 0, 0]}]\n",
     "key `control[0]`: must have one of sigma_m, covariance_m2, got none"),
    ({}, "control: [{target: a, position_m: [0, 0, 0], sigma_m: [1, 2]}]\n",
     "`control[0].sigma_m`: must be a list of 3"),
    ({}, "control: [{target: a, position_m: [0, 0, 0], sigma_m: [1, 2, 0]}]\n", "must be positive, got [1, 2, 0]"),
    ({}, "control: [{target: a, position_m: [0, 0, 0], covariance_m2: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}]\n",
     "`control[0].covariance_m2`: must be a symmetric positive definite matrix of 3 rows of 3 numbers"),
    ({}, "pose_priors: [{image: image, station: b, position_m: [0, 0, 0]}]\n", "must have one of image, station, got"),
    ({}, "pose_priors: [{image: image, position_m: [0, 0, 0], quaternion: [1, 1, 0, 0], sigma_m: 1, sigma_rad: 1}]\n",
     "`pose_priors[0].quaternion`: must be a unit quaternion"),
    ({}, "pose_priors: [{image: image, position_m: [0, 0, 0], quaternion: [1, 0, 0, 0], sigma_rad: 1}]\n",
     "`pose_priors[0].sigma_m`: must be a finite number, got None"),
    ({"images": TABLES["images.csv"].replace("qz\n", "qz,fixed\n").replace("0,0,0\n", "0,0,0,2\n")}, "",
     "images.csv:2: column `fixed`: must be 0 or 1, got '2'"),
]


@pytest.mark.parametrize(("tables", "more", "complaint"), WRONG, ids=[wrong[2][:40] for wrong in WRONG])
def test_wrong_values_are_named(tmp_path: Path, tables: dict[str, str], more: str, complaint: str) -> None:
    with pytest.raises(ValueError) as raised:
        read_network(written(tmp_path, more, **tables))
    assert complaint in str(raised.value)


def test_f_px_is_a_free_parameter_of_a_file(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text().replace("free: []", "free: [f_px, cx_px]"))
    network, _ = read_network(path)
    assert network.free_parameters == [["f_px", "cx_px"]]
    path.write_text(path.read_text().replace("free: [f_px, cx_px]", "free: [f_px, fy_px]"))
    with pytest.raises(ValueError, match="f_px, which moves both focal lengths"):
        read_network(path)


def without_starts(tmp_path: Path) -> tuple[occ.network.Network, Path]:
    """A network whose file has positions of five points, and nothing else to start from."""
    field = occ.network.simulate_test_field(occ.network.TestFieldDesign(
        camera=occ.network.paper_panorama_camera(), free_parameters=["c_px"], stations=4, targets=40, seed=3,
    ))
    files = network_files(field.network)
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    images = files["images.csv"].decode().splitlines()
    (tmp_path / "images.csv").write_text("\n".join(",".join(line.split(",")[:2]) for line in images) + "\n")
    points = files["points.csv"].decode().splitlines()
    bare = [line.split(",")[0] + ",,,," for line in points[6:]]
    (tmp_path / "points.csv").write_text("\n".join([*points[:6], *bare]) + "\n")
    return field.network, tmp_path / "network.yaml"


def test_images_and_points_start_from_a_few_known_points(tmp_path: Path) -> None:
    expected, path = without_starts(tmp_path)
    network, datum = read_network(path)
    assert np.array_equal(network.observations, expected.observations)
    started = occ.network.adjust(network, datum=occ.network.Datum(kind=occ.network.DatumKind.minimal))
    assert started.ok and started.sigma0 < 1.2
    reference = occ.network.adjust(expected)
    assert started.cost == pytest.approx(reference.cost, rel=1e-6)


def only_names(path: Path) -> None:
    """Removes all columns but the names from a table of points."""
    names = [line.split(",")[0] for line in path.read_text().splitlines()[1:]]
    path.write_text("name\n" + "".join(f"{name}\n" for name in names))


def test_a_network_starts_from_its_images_alone(tmp_path: Path) -> None:
    expected, path = without_starts(tmp_path)
    only_names(tmp_path / "points.csv")
    reference = occ.network.adjust(expected)
    network, _ = read_network(path)
    started = occ.network.adjust(network)
    assert started.ok and started.cost == pytest.approx(reference.cost, rel=1e-6)
    names = expected.point_names

    def length(adjusted: occ.network.Network) -> float:
        return float(np.linalg.norm(np.subtract(*(adjusted.position_m(Target.point(k)) for k in (1, 20)))))

    # A distance gives the scale, three known points (here of another frame) the whole datum.
    with open(path, "a") as file:
        file.write(f"distances:\n  - {{from: {names[1]}, to: {names[20]}, length_m: 7.5, sigma_m: 0.001}}\n")
    network, _ = read_network(path)
    assert length(network) == pytest.approx(7.5, rel=1e-9)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    at = {k: turn @ np.asarray(reference.network.points_m)[k] + [1, 2, 3] for k in (1, 8, 20)}
    with open(path, "a") as file:
        file.write("control:\n" + "".join(
            f"  - {{target: {names[k]}, position_m: {p.tolist()}, sigma_m: 0.001}}\n" for k, p in at.items()))
    network, _ = read_network(path)
    for k, position in at.items():
        assert np.linalg.norm(network.position_m(Target.point(k)) - position) < 0.1
    assert all(np.linalg.norm(turn @ p + [1, 2, 3] - q) < 0.3 for p, q in zip(
        np.asarray(reference.network.points_m), np.asarray(network.points_m)))


def test_an_element_without_a_start_is_named(tmp_path: Path) -> None:
    _, path = without_starts(tmp_path)
    points = (tmp_path / "points.csv").read_text().splitlines()
    bare = [p.split(",")[0] + ",,,," for p in points[3:]]
    (tmp_path / "points.csv").write_text("\n".join([*points[:3], *bare]) + "\n")
    with pytest.raises(ValueError, match=r"images.csv:\d+: image 'S0' has no pose and shows 2 targets with known"):
        read_network(path)
    (tmp_path / "points.csv").write_text("\n".join([*points, "lost,,,,"]) + "\n")
    with pytest.raises(ValueError, match=r"points.csv:\d+: point 'lost' has no position and is not visible"):
        read_network(path)
    (tmp_path / "points.csv").write_text("\n".join([*points, "lost,,,,1"]) + "\n")
    with pytest.raises(ValueError, match="column `fixed`: must be 0 or empty without a position"):
        read_network(path)


def test_the_joint_covariance_is_exported(tmp_path: Path) -> None:
    field = occ.network.simulate_test_field(occ.network.TestFieldDesign(
        camera=occ.network.paper_panorama_camera(), free_parameters=["c_px"], stations=4, targets=30, seed=3, tags=2,
    ))
    for name, content in network_files(field.network).items():
        (tmp_path / name).write_bytes(content)
    out = tmp_path / "out"
    ran = CliRunner().invoke(main, ["calibrate", "network", str(tmp_path / "network.yaml"), "--out", str(out)])
    assert ran.exit_code == 0, ran.output
    data = np.load(out / "covariance.npz")
    assert len(data["names"]) == 30 + 8 and str(data["names"][-1]).endswith(".3")
    assert data["covariance_m2"].shape == (114, 114) and data["positions_m"].shape == (38, 3)
    assert np.linalg.eigvalsh(data["covariance_m2"]).min() > -1e-12 * np.trace(data["covariance_m2"])
    sigmas = {row.text("name"): row.number("sigma_x_m")
              for row in read_table(out / "points.csv", ("name", "sigma_x_m"), (
                  "x_m", "y_m", "z_m", "sigma_y_m", "sigma_z_m", "cov_xy_m2", "cov_xz_m2", "cov_yz_m2"))}
    for k in (0, 12, 29):
        assert np.sqrt(data["covariance_m2"][3 * k, 3 * k]) == pytest.approx(sigmas[str(data["names"][k])], rel=1e-9)
    # The middle of a tag is its origin: the sigmas of the body follow from the corners.
    body = next(read_table(out / "bodies.csv", ("name", "sigma_x_m", "sigma_scale"), (*POSE, "scale", *SIGMAS)))
    corners = data["covariance_m2"][90:102, 90:102]
    mean = np.tile(np.eye(3), (1, 4)) / 4
    assert body.number("sigma_x_m") == pytest.approx(np.sqrt((mean @ corners @ mean.T)[0, 0]), rel=1e-6)
    assert body.number("sigma_scale") == 0 and data["body_covariances"].shape == (2, 6, 6)
