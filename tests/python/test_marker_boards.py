# SPDX-License-Identifier: Apache-2.0
"""Boards with tags, AprilGrid and ChArUco: calibration from parts of boards, and the layout of OpenCV."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_support import errors_in_sigmas
from numpy.typing import NDArray

import libocc as occ

Run = Callable[..., tuple[int, str, str]]
CAMERA = occ.Camera.pinhole(
    width=800, height=600, fx_px=640, fy_px=642, cx_px=405, cy_px=296, distortion=[-0.2, 0.07, 1e-3, -5e-4, 0]
)
GRID = occ.targets.AprilGrid(columns=7, rows=6, tag_size_m=0.035, spacing=0.3)
CHARUCO = occ.targets.CharucoBoard(columns=10, rows=8, square_m=0.035, marker_m=0.026)


def pictures_of(board: Any, count: int = 8) -> list[NDArray[np.uint8]]:
    """Pictures that show a part of the board, tilted and turned."""
    middle = board.points_m.mean(axis=0)
    side = 1.0 if isinstance(board, occ.targets.AprilGrid) else -1.0  # of the viewer along z
    found = []
    for i in range(count):
        azimuth, tilt = 0.9 * i, math.radians(8 + 9 * (i % 4))
        away = [math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), side * math.cos(tilt)]
        target = middle + [0.08 * math.cos(2.1 * i), 0.08 * math.sin(2.1 * i), 0]
        pose = occ.look_at(target + 0.3 * np.array(away), target, up=[[0, 1, 0], [1, 0, 0]][i % 2])
        boards: Any
        if side > 0:
            boards = {"april_grids": [occ.targets.AprilGridTarget(board=board)]}
        else:
            boards = {"charucos": [occ.targets.CharucoTarget(board=board)]}
        renderer = occ.targets.TargetRenderer(CAMERA, pose, noise_dn=3, seed=i, **boards)
        found.append(renderer.window(0, 0, 800, 600))
    return found


@pytest.mark.parametrize("kind", ["aprilgrid", "file", "charuco"])
def test_pictures_of_parts_calibrate_the_camera(libocc: Run, kind: str) -> None:
    board = CHARUCO if kind == "charuco" else GRID
    pictures = pictures_of(board)
    for i, pixels in enumerate(pictures):
        occ.write_image(f"{i}.png", pixels)
    occ.write_image("none.png", np.full((600, 800), 90, np.uint8))
    narrow = np.full((600, 800), 90, np.uint8)
    narrow[:, 300:345] = pictures[0][:, 300:345]  # too few points
    narrow[:220] = narrow[390:] = 90
    occ.write_image("narrow.png", narrow)
    Path("april.yaml").write_text("target_type: aprilgrid\ntagCols: 7\ntagRows: 6\ntagSize: 0.035\ntagSpacing: 0.3\n")
    options: dict[str, tuple[Any, ...]] = {
        "aprilgrid": ("--aprilgrid", "7x6", "--tag-size", 0.035, "--spacing", 0.3),
        "file": ("--aprilgrid", "april.yaml"),
        "charuco": ("--charuco", "10x8", "--square", 0.035, "--marker", 0.026, "--family", "DICT_APRILTAG_36h11"),
    }
    names = [f"{i}.png" for i in range(len(pictures))]
    code, text, err = libocc("calibrate", "camera", *names, "none.png", "narrow.png", *options[kind], "--out", "out")
    assert code == 0, err
    name = "ChArUco board" if kind == "charuco" else "AprilGrid"
    warnings = json.loads(Path("out/result.json").read_text())["warnings"]
    assert f"none.png: no {name} was detected; the image is not used: no tag was detected" in warnings
    assert any(warning.startswith("narrow.png") for warning in warnings), warnings
    assert all(warning in Path("out/report.html").read_text() for warning in warnings if "&" not in warning)
    off = errors_in_sigmas(Path("out"), CAMERA)
    assert len(off) == 9 and max(map(abs, off.values())) < 4


def test_views_of_parts_have_indices() -> None:
    (picture,) = pictures_of(CHARUCO, 1)
    found = occ.targets.find_charuco(picture, CHARUCO)
    assert found.ok and 6 < len(found.indices) < len(CHARUCO.points_m) and found.tags > 5
    assert len(found.px) == len(found.indices) == len(found.covariance_px2) and found.foreign_ids == []
    seen = ("part", 0, found.px, found.covariance_px2, found.indices)
    start = occ.network.board_network([("camera", CAMERA, [])], CHARUCO.points_m, [seen, ("again", *seen[1:])])
    assert start.ok and len(start.network.observations) == 2 * len(found.indices)
    with pytest.raises(ValueError, match="image part: indices"):
        occ.network.board_network([("camera", CAMERA, [])], CHARUCO.points_m, [(*seen[:4], [0] * len(found.indices))])


@pytest.mark.parametrize("options, text", [
    (["--aprilgrid", "7x6"], "--aprilgrid needs --tag-size and --spacing"),
    (["--aprilgrid", "7", "--tag-size", 0.03, "--spacing", 0.3], "must be COLUMNSxROWS of tags"),
    (["--aprilgrid", "30x30", "--tag-size", 0.03, "--spacing", 0.3], "at most 587 tags"),
    (["--aprilgrid", "no.yaml"], "no.yaml"),
    (["--aprilgrid", "board.yaml"], "board.yaml: key `target_type`: must be aprilgrid, got 'checkerboard'"),
    (["--aprilgrid", "grid.yaml", "--tag-size", 0.03], "--tag-size: the file grid.yaml has the sizes of the grid"),
    (["--aprilgrid", "grid.yaml"], "grid.yaml: key `tagSize`: must be positive, got -1"),
    (["--charuco", "5x7", "--square", 0.03], "--charuco needs --square and --marker"),
    (["--charuco", "5x7", "--square", 0.03, "--marker", 0.04], "--marker: must be smaller than the square of 0.03 m"),
    (["--charuco", "2x7", "--square", 0.03, "--marker", 0.02], "must be COLUMNSxROWS of squares, at least 3x3"),
    (["--charuco", "5x7", "--square", 0.03, "--marker", 0.02, "--family", "DICT_5X5_50"], "DICT_APRILTAG_36h11"),
    (["--charuco", "5x7", "--square", 0.03, "--marker", 0.02, "--chessboard", "9x6"], "give either"),
    (["--chessboard", "9x6", "--square", 0.03, "--marker", 0.02], "--marker is for --charuco only"),
    (["--chessboard", "9x6", "--square", 0.03, "--legacy"], "--legacy is for --charuco only"),
    (["--tag-size", 0.03, "--border-cells", 1], "--border-cells is for --aprilgrid only"),
])  # fmt: skip
def test_wrong_options_are_named(libocc: Run, options: list[Any], text: str) -> None:
    Path("board.yaml").write_text("target_type: checkerboard\ntargetCols: 6\ntargetRows: 7\n")
    Path("grid.yaml").write_text("target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: -1\ntagSpacing: 0.3\n")
    occ.write_image("a.png", np.full((60, 80), 90, np.uint8))
    for command in (("targets", "--out", "x.pdf"), ("calibrate", "camera", "a.png", "--out", "x.pdf")):
        code, _, err = libocc(*command, *options)
        assert code == 2 and text in err, err
        assert not Path("x.pdf").exists()


def test_tags_of_another_board_are_named(libocc: Run) -> None:
    names = [f"{i}.png" for i in range(6)]
    for name, pixels in zip(names, pictures_of(GRID, 6)):
        occ.write_image(name, pixels)
    grid = ("--aprilgrid", "7x4", "--tag-size", 0.035, "--spacing", 0.3)
    code, out, err = libocc("calibrate", "camera", *names, *grid, "--json", "--out", "out")
    assert code == 0, err
    warnings = json.loads(out)["warnings"]
    named = [warning for warning in warnings if "tags that are not on the board are ignored: " in warning]
    assert len(named) > 2 and any("28, 29" in warning for warning in named), warnings


def test_a_wrong_spacing_is_stated(libocc: Run) -> None:
    names = [f"{i}.png" for i in range(4)]
    for name, pixels in zip(names, pictures_of(GRID, 4)):
        occ.write_image(name, pixels)
    for spacing, text in ((0.2, "are 0.3 of their side, not 0.2: check the spacing"), (0.285, "points scatter by")):
        grid = ("--aprilgrid", "7x6", "--tag-size", 0.035, "--spacing", spacing)
        _, out, err = libocc("calibrate", "camera", *names, *grid, "--out", f"out{spacing}")
        assert text in out + err


def test_another_board_has_a_reason(libocc: Run) -> None:
    occ.write_image("a.png", pictures_of(GRID, 1)[0])
    grid = ("--aprilgrid", "6x7", "--tag-size", 0.035, "--spacing", 0.3)
    code, _, err = libocc("calibrate", "camera", "a.png", *grid, "--out", "out")
    assert code == 2
    assert "no AprilGrid of 6x7 tags of tag36h11" in err and "arranged in another way" in err
    charuco = ("--charuco", "10x8", "--square", 0.035, "--marker", 0.026)
    code, _, err = libocc("calibrate", "camera", "a.png", *charuco, "--out", "out")
    assert code == 2 and "no ChArUco board of 10x8 squares" in err and "no tag was detected" in err


def test_tags_with_another_border_are_printed_and_found(libocc: Run) -> None:
    narrow = GRID.replace(border_cells=1)
    for i, pixels in enumerate(pictures_of(narrow, 6)):
        occ.write_image(f"{i}.png", pixels)
    names = [f"{i}.png" for i in range(6)]
    grid = ("--aprilgrid", "7x6", "--tag-size", 0.035, "--spacing", 0.3)
    code, _, err = libocc("calibrate", "camera", *names, *grid, "--border-cells", 1, "--out", "out")
    assert code == 0, err
    assert max(map(abs, errors_in_sigmas(Path("out"), CAMERA).values())) < 4
    code, out, _ = libocc("targets", "--aprilgrid", "3x3", *grid[2:], "--border-cells", 1, "--out", "grid.svg")
    assert code == 0 and "gaps of 10.5 mm, borders of 1 cell; 1 page" in out
    assert "--aprilgrid 3x3 --border-cells 1 --spacing 0.3" in Path("grid.svg").read_text().replace("- -", "--")


# The first tag of the family in the papers on AprilTags, row by row from the upper left, 1 is white.
def test_tag_0_is_the_published_one() -> None:
    bits = np.array([int(bit) for bit in f"{0xD5D628584:036b}"]).reshape(6, 6)
    for border in (1, 2):
        pattern = occ.targets.tag_pattern("tag36h11", 0, border_cells=border)
        ring = border + 1
        np.testing.assert_array_equal(~pattern.black[ring:-ring, ring:-ring], bits == 1)
        assert pattern.square_cells == 6 + 2 * border and pattern.black[1:-1, 1:ring].all()
    with pytest.raises(ValueError, match="border_cells"):
        occ.targets.tag_pattern("tagStandard41h12", 0, border_cells=2)


DICTIONARIES = {"DICT_APRILTAG_36h11": "tag36h11", "DICT_APRILTAG_36h10": "tag36h10",
                "DICT_APRILTAG_25h9": "tag25h9", "DICT_APRILTAG_16h5": "tag16h5"}  # fmt: skip


@pytest.mark.parametrize("name", DICTIONARIES)
@pytest.mark.parametrize("columns, rows, legacy", [(7, 5, False), (5, 6, False), (5, 6, True), (6, 4, True)])
def test_boards_of_opencv_have_its_ids(name: str, columns: int, rows: int, legacy: bool) -> None:
    cv2 = pytest.importorskip("cv2")
    if not hasattr(cv2.aruco.CharucoBoard, "setLegacyPattern"):
        pytest.skip("this version of OpenCV has no setLegacyPattern()")
    theirs = cv2.aruco.CharucoBoard(
        (columns, rows), 0.04, 0.03, cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    )
    theirs.setLegacyPattern(legacy)
    side, border = 96, 40
    flat = cv2.copyMakeBorder(
        theirs.generateImage((columns * side, rows * side)), *[border] * 4, cv2.BORDER_CONSTANT, value=255
    )
    board = occ.targets.CharucoBoard(
        columns=columns, rows=rows, square_m=0.04, marker_m=0.03, family=DICTIONARIES[name], legacy=legacy
    )
    np.testing.assert_allclose(board.points_m, theirs.getChessboardCorners(), atol=1e-6)
    for id, corners in zip(theirs.getIds().ravel(), theirs.getObjPoints()):
        # OpenCV's corners start at the upper left of the board and are clockwise; its tags are upside down.
        np.testing.assert_allclose(board.tags()[id][[1, 0, 3, 2]], np.array(corners)[:, :2], atol=1e-6)
    corners_px = board.points_m[:, :2] / 0.04 * side + border - 0.5
    h = np.array([[0.75, 0.12, 20], [-0.05, 0.8, 60], [1e-4, 2e-4, 1]])
    seen = cv2.GaussianBlur(cv2.warpPerspective(flat, h, (640, 560), borderValue=255), (0, 0), 0.8)
    projected = np.column_stack([corners_px, np.ones(len(corners_px))]) @ h.T
    expected = projected[:, :2] / projected[:, 2:]
    inside = np.flatnonzero(((expected > 12) & (expected < [628, 548])).all(axis=1))
    found = occ.targets.find_charuco(seen, board)
    assert found.ok, found.message
    assert set(inside) == set(found.indices) & set(inside) and len(inside) > len(expected) / 2
    # warpPerspective interpolates at 1/32 px without averaging.
    assert np.abs(found.px - expected[found.indices]).max() < 0.15
    corners, ids, _, _ = cv2.aruco.CharucoDetector(theirs).detectBoard(seen)
    if corners is not None and len(corners) > 4:
        places = {index: px for index, px in zip(found.indices, found.px)}
        off = [np.reshape(px, 2) - places[int(id)] for px, id in zip(corners, np.ravel(ids)) if int(id) in places]
        assert len(off) > 4 and np.abs(off).max() < 1
