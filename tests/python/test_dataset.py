# SPDX-License-Identifier: Apache-2.0
"""Data sets: image files, masks and the layouts of BOP and COCO, compared after reading."""

import json
from pathlib import Path

import numpy as np
import pytest
from bop_reader import BopFolder
from matplotlib.path import Path as Outline
from small_room import small_scene

import libocc as occ
from libocc.cli.dataset.bop import Bop, rim_in_lamp_m, world_from_lamp
from libocc.cli.dataset.coco import Coco
from libocc.cli.dataset.frames import duration_s, frames_of
from libocc.cli.dataset.images import FORMATS, check_format, image_bytes, load_image
from libocc.cli.dataset.masks import Silhouette, box_of, fill, from_run_lengths, run_lengths
from libocc.cli.dataset.plain import Plain
from libocc.cli.dataset.write import write_frames, write_set_files
from libocc.cli.result_folder import ResultFolder


def advance(steps: int = 1) -> None:
    """Progress callback that does nothing."""


RNG = np.random.default_rng(1)


@pytest.fixture(scope="module")
def room() -> occ.Scene:
    return small_scene()


@pytest.fixture(scope="module")
def walk() -> occ.Trajectory:
    return occ.Trajectory.parse("""
        schema: libocc-trajectory/1
        waypoints:
          - {time_s: 2, position_m: [0, 0, 0.1]}
          - {time_s: 2.5, position_m: [0.3, 0.1, 0.2], heading_deg: 30, tilt_deg: 6}
    """)


def written(layout: Plain, room, walk, path: Path, image_format="png"):
    folder = ResultFolder(str(path), {"kind": "test"})
    frames = frames_of(room, walk, fps=8, image_format=image_format, noise=False)
    assert not write_frames(folder, layout, frames, 1, advance)
    assert write_set_files(folder, layout, image_format, advance) == len(frames) == 4
    truths = [folder.read_json(f"truth/{frame.index:06d}.json") for frame in frames]
    return frames, truths


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_image_files_hold_every_bit(name, dtype, tmp_path):
    if name == "exr":
        pytest.importorskip("OpenEXR")
    image = RNG.integers(0, np.iinfo(dtype).max, (30, 41), dtype, endpoint=True)
    path = tmp_path / f"image.{name}"
    path.write_bytes(image_bytes(image, name))
    again = load_image(path)
    assert np.array_equal(again, image)
    assert again.dtype == (np.float32 if name == "exr" else dtype)
    assert image_bytes(image, name) == path.read_bytes(), "the same bytes again"


def test_sixteen_bit_pgm_follows_netpbm():
    image = np.array([[1, 258], [65535, 0]], np.uint16)
    header, pixels = image_bytes(image, "pgm").rsplit(b"\n", 1)
    assert header.split() == [b"P5", b"2", b"2", b"65535"]
    assert pixels == bytes([0, 1, 1, 2, 255, 255, 0, 0])


def test_unknown_formats_name_the_nearest():
    with pytest.raises(ValueError, match="unknown image format 'pnq'; did you mean png"):
        check_format("pnq")


def test_fill_has_the_pixels_whose_centres_are_inside():
    for _ in range(20):
        rim = RNG.uniform(-3, 25, (7, 2))
        ys, xs = np.mgrid[-2:22, -4:26]
        inside = fill(rim, -4, -2, 30, 24)
        sides = np.roll(rim, -1, axis=0) - rim
        crossings = np.zeros(xs.shape, int)
        for (x0, y0), (dx, dy) in zip(rim, sides, strict=True):
            over = (ys >= y0) != (ys >= y0 + dy)
            crossings += over & (x0 + (ys - y0) * dx / dy <= xs)
        assert np.array_equal(inside, crossings % 2 == 1)
    turn = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    circle = np.stack([9.3 + 7 * np.cos(turn), 8.1 + 5 * np.sin(turn)], axis=1)
    points = np.stack(np.meshgrid(np.arange(20), np.arange(16)), axis=2).reshape(-1, 2)
    expected = Outline(circle).contains_points(points).reshape(16, 20)
    assert np.array_equal(fill(circle, 0, 0, 20, 16), expected)


def test_a_silhouette_extends_beyond_the_image():
    rim = np.array([[-3.5, 2.5], [4.5, 2.5], [4.5, 6.5], [-3.5, 6.5]])
    silhouette = Silhouette(rim, rim.mean(axis=0))
    assert silhouette.pixels.sum() == 8 * 4 and silhouette.box() == [-3, 3, 4, 6]
    mask = silhouette.within(10, 6)
    assert mask.sum() == 5 * 3 and box_of(mask) == [0, 3, 4, 5]
    tiny = Silhouette(np.array([[3.2, 4.2], [3.3, 4.2], [3.3, 4.4]]), np.array([3.25, 4.3]))
    assert np.argwhere(tiny.within(10, 8)).tolist() == [[4, 3]]


@pytest.mark.parametrize("share", [0, 0.3, 1])
def test_run_lengths_are_cocos(share):
    mask = RNG.uniform(size=(13, 17)) < share
    runs = run_lengths(mask)
    assert np.array_equal(from_run_lengths(runs), mask)
    assert runs["size"] == [13, 17] and sum(runs["counts"]) == mask.size
    assert sum(runs["counts"][1::2]) == mask.sum()
    if mask[0, 0]:
        assert runs["counts"][0] == 0
    coco = pytest.importorskip("pycocotools.mask")
    assert np.array_equal(coco.decode(coco.frPyObjects(runs, 13, 17)), mask)


def test_frames_see_the_trajectory(room, walk, tmp_path):
    frames, truths = written(Plain(room), room, walk, tmp_path / "set")
    assert [t["time_s"] for t in truths] == [2, 2.125, 2.25, 2.375]
    for frame, truth in zip(frames, truths, strict=True):
        assert np.allclose(truth["cam_from_world"], walk.cam_from_world(frame.time_s), atol=1e-13)
        image, _ = occ.simulate(
            room, truth["cam_from_world"], noise=False, start_s=truth["time_s"], velocity=truth["velocity"]
        )
        assert np.array_equal(load_image(tmp_path / f"set/images/{frame.index:06d}.png"), image)
    poses = occ.Trajectory.load(tmp_path / "set/trajectory.txt")
    assert np.allclose(poses.poses, [t["cam_from_world"] for t in truths], atol=1e-14)
    assert occ.Scene.load(tmp_path / "set/scene.yaml") == room


def test_each_lamp_has_the_pose_from_which_its_row_sees_it(room, walk, tmp_path):
    _, truths = written(Plain(room), room, walk, tmp_path / "set")
    moved = 0
    for truth in truths:
        for lamp, data in zip(room.lamps, truth["lamps"], strict=True):
            pose = np.array(data["cam_from_world"])
            point = pose[:3, :3] @ np.ravel(lamp.centre_m) + pose[:3, 3]
            assert np.ravel(room.camera.project(point)) == pytest.approx(data["centre_px"], abs=1e-6)
            after_s = data["centre_px"][1] * 5e-5 + 5e-5
            assert np.allclose(pose, walk.cam_from_world(truth["time_s"] + after_s), atol=1e-9)
            moved = max(moved, np.abs(pose - truth["cam_from_world"]).max())
    assert moved > 1e-3


def test_masks_cover_the_light(room, tmp_path):
    still = occ.Trajectory([0], [np.eye(4)])
    (frame,) = frames_of(room, still, fps=1, noise=False)
    folder = ResultFolder(str(tmp_path / "set"), {"kind": "test"})
    write_frames(folder, Plain(room), [frame], 1, advance)
    truth = folder.read_json("truth/000000.json")
    image = load_image(tmp_path / "set/images/000000.png").astype(float)
    shares = {}
    for lamp in truth["lamps"][:3]:
        mask, seen = from_run_lengths(lamp["mask"]), from_run_lengths(lamp["mask_visible"])
        window = image * (np.abs(np.indices(image.shape)[1] - lamp["centre_px"][0]) < 20)
        window = window * (np.abs(np.indices(image.shape)[0] - lamp["centre_px"][1]) < 15)
        lit = window > 0.5 * window.max()
        assert (lit != seen).sum() < 0.2 * seen.sum() and not (seen & ~mask).any()
        shares[lamp["id"]] = 1 - seen.sum() / mask.sum()
        assert shares[lamp["id"]] == pytest.approx(lamp["hidden"], abs=0.08)
    assert shares[4] > 0.2 and shares[9] == shares[0] == 0
    assert from_run_lengths(truth["lamps"][3]["mask"]).sum() == 1
    assert {e["effect"] for e in truth["effects"] if e["applied"]} >= {"occlusion", "psf", "extent"}


def bop_files(path: Path):
    scene = path / "test/000000"
    return [json.loads((scene / f"scene_{name}.json").read_text()) for name in ("camera", "gt", "gt_info")]


def test_bop_layout_projects_its_models_to_its_masks(room, walk, tmp_path):
    _, truths = written(Bop(room), room, walk, tmp_path / "set")
    cameras, gts, infos = bop_files(tmp_path / "set")
    assert list(cameras) == list(gts) == list(infos) == ["0", "1", "2", "3"]
    for key in cameras:
        k = np.reshape(cameras[key]["cam_K"], (3, 3))
        assert np.allclose(k, room.camera.matrix)
        pose = np.array(truths[int(key)]["cam_from_world"])
        assert np.allclose(np.array(cameras[key]["cam_t_w2c"]) / 1000, pose[:3, 3])
        assert np.allclose(np.reshape(cameras[key]["cam_R_w2c"], (3, 3)), pose[:3, :3])
        assert len(gts[key]) == len(infos[key])
        for i, (gt, info) in enumerate(zip(gts[key], infos[key], strict=True)):
            model = tmp_path / f"set/models/obj_{gt['obj_id']:06d}.ply"
            model_mm = np.loadtxt(model, skiprows=13, max_rows=4)
            seen = np.reshape(gt["cam_R_m2c"], (3, 3)) @ np.atleast_2d(model_mm)[:, :3].T
            px = k @ (seen + np.reshape(gt["cam_t_m2c"], (3, 1)))
            px = (px[:2] / px[2]).T
            x, y, w, h = info["bbox_obj"]
            assert (px >= (x - 1.5, y - 1.5)).all() and (px <= (x + w + 1.5, y + h + 1.5)).all()
            mask, visible = (
                load_image(tmp_path / f"set/test/000000/{m}/{int(key):06d}_{i:06d}.png") > 0
                for m in ("mask", "mask_visib")
            )
            assert info["px_count_visib"] == visible.sum() and info["px_count_all"] >= mask.sum()
            assert info["visib_fract"] == visible.sum() / info["px_count_all"]
            x0, y0, x1, y1 = box_of(visible)
            assert info["bbox_visib"] == [x0, y0, x1 - x0, y1 - y0]
    assert (tmp_path / "set/test/000000/gray/000003.png").exists()
    wanted = {"bbox_obj", "bbox_visib", "px_count_all", "px_count_valid", "px_count_visib", "visib_fract"}
    assert set(infos["0"][0]) == wanted
    assert set(gts["0"][0]) == {"cam_R_m2c", "cam_t_m2c", "obj_id", "lamp_id"}


def test_an_independent_reader_understands_the_bop_folder(room, walk, tmp_path):
    _, truths = written(Bop(room), room, walk, tmp_path / "set")
    folder = BopFolder(tmp_path / "set")
    assert sorted(folder.cameras) == sorted(folder.truths) == sorted(folder.infos) == [0, 1, 2, 3]
    assert folder.models_info.keys() == {1, 2, 3, 4}
    size = (folder.camera["height"], folder.camera["width"])
    for im_id, objects in folder.truths.items():
        assert folder.image(im_id).shape == size and folder.cameras[im_id]["depth_scale"] == 1
        rotation, translation = folder.world_to_camera(im_id)
        assert np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) > 0
        for gt_id, truth in enumerate(objects):
            lamp = room.lamps[truth["obj_id"] - 1]
            centre_mm = rotation @ (1000 * np.reshape(lamp.centre_m, (3, 1))) + translation
            assert np.allclose(centre_mm.ravel(), truth["cam_t_m2c"], atol=20), "of its row's time, so nearly"
            visible, whole = (folder.mask(im_id, gt_id, kind) for kind in ("mask_visib", "mask"))
            assert whole.shape == size and not (visible & ~whole).any()
            info = folder.infos[im_id][gt_id]
            assert info["px_count_visib"] == visible.sum()
            if folder.model(truth["obj_id"]).faces.size and info["px_count_all"] == whole.sum():
                outline = Outline(folder.model_px(im_id, gt_id))
                ys, xs = np.indices(size)
                inside = outline.contains_points(np.stack([xs.ravel(), ys.ravel()], axis=1)).reshape(size)
                assert (inside != whole).sum() <= 0.15 * whole.sum()
    asked = {(t["scene_id"], t["im_id"], t["obj_id"], t["inst_count"]) for t in folder.targets}
    seen = {
        (0, im_id, truth["obj_id"], 1)
        for im_id, objects in folder.truths.items()
        for truth, info in zip(objects, folder.infos[im_id], strict=True) if info["visib_fract"] >= 0.1
    }
    assert asked == seen and len(folder.targets) == len(seen) > 4


def test_bop_models_have_their_sizes_and_symmetries(room, walk, tmp_path):
    written(Bop(room), room, walk, tmp_path / "set")
    folder = BopFolder(tmp_path / "set")
    for obj_id, info in folder.models_info.items():
        model = folder.model(obj_id)
        low, high = model.vertices_mm.min(axis=0), model.vertices_mm.max(axis=0)
        assert np.allclose(low, [info["min_x"], info["min_y"], info["min_z"]], atol=1e-5)
        assert np.allclose(high - low, [info["size_x"], info["size_y"], info["size_z"]], atol=1e-5)
        assert np.allclose(low, -high, atol=1e-5), "the origin is the middle of the box"
        apart = np.linalg.norm(model.vertices_mm[:, None] - model.vertices_mm[None], axis=2)
        assert apart.max() == pytest.approx(info["diameter"], abs=1e-5)
        assert (model.normals == [0, 0, 1]).all()
        assert np.array_equal(folder.model(obj_id, "models_eval").vertices_mm, model.vertices_mm)
        for turn in info.get("symmetries_discrete", []):
            turned = model.vertices_mm @ np.reshape(turn, (4, 4))[:3, :3].T
            nearest = np.linalg.norm(turned[:, None] - model.vertices_mm[None], axis=2).min(axis=1)
            assert nearest.max() < 1e-4
    counts = [len(folder.models_info[i].get("symmetries_discrete", [])) for i in (1, 2, 3, 4)]
    assert counts == [0, 1, 3, 0]
    assert folder.models_info[1]["symmetries_continuous"] == [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]


def test_bop_models_are_in_millimetres(room, walk, tmp_path):
    written(Bop(room), room, walk, tmp_path / "set")
    models = json.loads((tmp_path / "set/models/models_info.json").read_text())
    assert models["1"]["diameter"] == pytest.approx(300) and models["2"]["size_x"] == pytest.approx(400)
    assert models["2"]["size_y"] == pytest.approx(200) and models["4"]["diameter"] == 0
    assert [models[key]["lamp_id"] for key in "1234"] == [4, 9, 0, 7]
    camera = json.loads((tmp_path / "set/camera.json").read_text())
    assert (camera["width"], camera["fx"], camera["cx"]) == (160, 100, 79.5)
    for lamp in room.lamps:
        pose = world_from_lamp(lamp)
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
        rim = rim_in_lamp_m(lamp) @ pose[:3, :2].T + pose[:3, 3]
        px = [np.ravel(room.camera.project(p)) for p in rim]
        expected = occ.rendering.project_rim(lamp, np.eye(4), room.camera, 400)
        if lamp.shape is not occ.LampShape.point:
            apart = np.linalg.norm(np.array(px)[:, None] - expected[None], axis=2).min(axis=1)
            assert apart.max() < 0.4


def test_coco_layout(room, walk, tmp_path):
    _, truths = written(Coco(room), room, walk, tmp_path / "set")
    path = tmp_path / "set/annotations/instances.json"
    data = json.loads(path.read_text())
    names = {category["id"]: category["name"] for category in data["categories"]}
    assert names == {1: "door", 2: "lamp 9", 3: "lamp 0", 4: "lamp 7"}
    assert [i["file_name"] for i in data["images"]] == [f"{i:06d}.png" for i in range(4)]
    assert all((tmp_path / "set/images" / i["file_name"]).exists() for i in data["images"])
    assert [a["id"] for a in data["annotations"]] == list(range(1, 1 + len(data["annotations"])))
    for a in data["annotations"]:
        lamp = truths[a["image_id"]]["lamps"][a["category_id"] - 1]
        mask = from_run_lengths(lamp["mask_visible"])
        x, y, w, h = a["bbox"]
        assert box_of(mask) == [x, y, x + w - 1, y + h - 1] and a["area"] == mask.sum()
        if isinstance(a["segmentation"], dict):
            assert np.array_equal(from_run_lengths(a["segmentation"]), mask)
        elif lamp["id"] != 7:
            outline = np.reshape(a["segmentation"][0], (-1, 2)) - 0.5
            assert np.array_equal(fill(outline, 0, 0, 160, 120), mask)
    assert any(isinstance(a["segmentation"], dict) for a in data["annotations"])


def test_pycocotools_reads_the_annotations(room, walk, tmp_path):
    coco = pytest.importorskip("pycocotools.coco")
    _, truths = written(Coco(room), room, walk, tmp_path / "set")
    read = coco.COCO(str(tmp_path / "set/annotations/instances.json"))
    for a in read.loadAnns(read.getAnnIds()):
        lamp = truths[a["image_id"]]["lamps"][a["category_id"] - 1]
        wrong = read.annToMask(a) != from_run_lengths(lamp["mask_visible"])
        assert wrong.sum() <= 0.12 * max(a["area"], 60), "its polygons are filled on a grid of a fifth of a pixel"


def test_coco_polygons_end_at_the_border():
    from libocc.cli.dataset.coco import clipped

    square = [[-10, -10], [4, -10], [4, 4], [-10, 4]]
    outline = np.reshape(clipped(square, 20, 10), (-1, 2))
    assert outline.min() == 0 and outline.max() == 4.5 and len(outline) == 4
    assert clipped([[-10, -10], [-5, -10], [-5, -5]], 20, 10) == []


def test_a_frame_must_end_before_its_trajectory(room):
    assert duration_s(room) == pytest.approx(119 * 5e-5 + 1e-4)
    short = occ.Trajectory([0, 0.005], [np.eye(4)] * 2)
    with pytest.raises(ValueError, match="must last at least one frame, 0.00605 s"):
        frames_of(room, short, fps=30)
    just = occ.Trajectory([0, 0.10605], [np.eye(4)] * 2)
    assert len(frames_of(room, just, fps=10)) == 2


@pytest.mark.parametrize("bits, dtype", [(8, np.uint8), (12, np.uint16)])
def test_colour_images_are_the_raw_mosaic(room, bits, dtype):
    red = occ.rendering.Channel(efficiency=0.1)
    channels = [red, occ.rendering.Channel(), red]
    sensor = room.sensor.replace(mosaic=occ.rendering.Mosaic.rggb, channels=channels, bit_depth=bits)
    scene = room.replace(sensor=sensor.replace(gain_dn_per_e=0.006 * 2 ** (bits - 8)))
    image, truth = occ.Renderer(scene).render(np.eye(4), noise=False)
    assert image.shape == (120, 160) and image.dtype == dtype
    box = np.ravel(truth.lamps[1].image_centre_px).astype(int) // 2 * 2
    red_dn, green_dn = image[box[1], box[0]], image[box[1], box[0] + 1]
    assert green_dn > 4 * red_dn
