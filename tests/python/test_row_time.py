# SPDX-License-Identifier: Apache-2.0
"""Row time from stripes of a known frequency: accuracy, honest sigmas, and pictures without usable stripes."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from exif_pictures import HEIC_HEAD

import libocc as occ
from libocc.cli.row_time import NoStripes, Stripes, combined, stripes_of, stripes_of_surface

Run = Callable[..., tuple[int, str, str]]


def wall(
    seed: int = 0,
    rows: int = 3000,
    columns: int = 200,
    row_s: float = 1.1e-5,
    hz: float = 100,
    ripple: float = 0.1,
    texture: float = 0.0,
    exposure_s: float = 0.002,
    noise_dn: float = 3.0,
    level: float = 110,
) -> np.ndarray:
    """Picture of a wall under flickering light, as sRGB-like grey levels; the light falls off towards the corners."""
    random = np.random.default_rng(seed)
    phase = random.uniform(0, 2 * np.pi) + 2 * np.pi * hz * row_s * np.arange(rows)
    depth = ripple * np.sinc(hz * exposure_s)
    light = 1 + depth * np.cos(phase) + 0.2 * ripple * np.sinc(2 * hz * exposure_s) * np.cos(2 * phase + 1)
    y, x = np.mgrid[0:rows, 0:columns]
    shade = 1 - 0.3 * ((x / columns - 0.5) ** 2 + (y / rows - 0.4) ** 2)
    pattern = np.kron(random.normal(size=(-(-rows // 50), -(-columns // 50))), np.ones((50, 50)))[:rows, :columns]
    dn = level * (light[:, None] * shade) ** 0.5 * np.exp(texture * pattern) + random.normal(0, noise_dn, y.shape)
    return np.asarray(np.clip(np.round(dn), 0, 255), np.uint8)


def off_in_sigmas(stripes: Stripes, row_s: float, hz: float) -> float:
    value, sigma = stripes.row_time_s(hz)
    return (value - row_s) / sigma


@pytest.mark.parametrize(
    "options, max_sigma",
    [
        ({}, 2e-3),
        ({"ripple": 0.01}, 5e-3),
        ({"row_s": 2.3e-5, "hz": 120}, 5e-4),
        ({"texture": 0.01, "columns": 400}, 2e-2),
    ],
)
def test_errors_agree_with_their_sigmas(options: dict[str, float], max_sigma: float) -> None:
    row_s, hz = options.get("row_s", 1.1e-5), options.get("hz", 100)
    found = [stripes_of_surface(wall(seed, **options), hz, "rows") for seed in range(12)]  # type: ignore[arg-type]
    off = np.array([off_in_sigmas(stripes, row_s, hz) for stripes in found])
    assert 0.3 < np.sqrt((off**2).mean()) < 1.9 and np.abs(off).max() < 4.5
    assert max(stripes.sigma_px / stripes.period_px for stripes in found) < max_sigma


def test_the_direction_of_the_shutter_is_found() -> None:
    picture = wall()
    for pixels, readout in ((picture, "rows"), (np.ascontiguousarray(picture.T), "columns")):
        stripes = stripes_of(pixels, 100, "unknown")
        assert stripes.readout == readout and abs(off_in_sigmas(stripes, 1.1e-5, 100)) < 4.5
        assert stripes.periods == pytest.approx(3.3, rel=0.01) and 0.03 < stripes.contrast < 0.06
        with pytest.raises(NoStripes):
            stripes_of(pixels, 100, "columns" if readout == "rows" else "rows")


def test_colours_and_16_bits_are_read() -> None:
    picture = wall()
    for pixels in (np.dstack([picture] * 3), picture.astype(np.uint16) * 257):
        assert abs(off_in_sigmas(stripes_of(pixels, 100, "rows"), 1.1e-5, 100)) < 4.5


def test_columns_with_a_lamp_are_omitted() -> None:
    picture = wall()
    picture[900:1300, 30:90] = 255
    assert abs(off_in_sigmas(stripes_of(picture, 100, "rows"), 1.1e-5, 100)) < 4.5


@pytest.mark.parametrize(
    "pixels, hz, text",
    [
        (wall(ripple=0.0), 100, "no stripes are visible across the rows: their brightness has no more than noise"),
        (wall(ripple=0.0, texture=0.3), 100, "no stripes are visible"),
        (wall(exposure_s=0.01), 100, "no more than noise and a trend"),
        (wall(texture=0.2), 100, "the surface must be even, exposed for less than half a period"),
        (wall(rows=1100), 100, "fewer than 2 periods are in|at least 2 periods in the picture"),
        (wall(rows=60), 1, "60 rows are too few for 2 periods of 1 Hz"),
        (wall(level=400), 100, "columns? has pixels that are saturated"),
        (np.zeros((400, 300), np.uint8), 100, "has pixels that are too dark"),
        (np.full((400, 300), 100, np.uint8), 100, "no more than noise and a trend"),
        (np.full((400, 5), 100, np.uint8), 100, "has pixels that are too dark"),
    ],
)
def test_pictures_without_stripes_are_an_error_with_its_reason(pixels: np.ndarray, hz: float, text: str) -> None:
    with pytest.raises(NoStripes, match=text):
        stripes_of(pixels, hz, "rows")


@pytest.mark.parametrize("rows", [700, 1000, 1100, 1200, 1400, 1600])
def test_too_few_periods_give_no_wrong_row_time(rows: int) -> None:
    """0.8 to 1.8 periods; an answer must be right."""
    for seed in range(12):
        try:
            stripes = stripes_of_surface(wall(seed, rows=rows), 100, "rows")
        except NoStripes:
            continue
        assert abs(off_in_sigmas(stripes, 1.1e-5, 100)) < 5, seed


def test_a_gradient_or_an_edge_is_no_stripe() -> None:
    random = np.random.default_rng(3)
    y = np.linspace(0, 1, 2000)[:, None]
    steps = np.where(y < 0.37, 150.0, 60.0), np.where(np.abs(y - 0.5) < 0.1, 150.0, 60.0)
    for profile in (120 - 80 * y, 200 * np.exp(-2 * y), *steps):
        pixels = np.clip(profile + random.normal(0, 2, (2000, 300)), 0, 255).round().astype(np.uint8)
        with pytest.raises(NoStripes):
            stripes_of(pixels, 100, "rows")


def lamp_scene() -> occ.Scene:
    scene = occ.Scene.load(Path(__file__).parents[2] / "data/scenes/coded_four.yaml")
    return scene.replace(lamps=scene.lamps[:1])


def test_a_blinking_lamp_gives_the_row_time() -> None:
    off = []
    for seed in range(10):
        pose = occ.look_at(position_m=[1, 1, 2.0 + 0.03 * seed], target_m=[1, 1, 3], up=[0, 1, 0])
        pixels, _ = occ.simulate(lamp_scene(), pose, seed=seed)
        stripes = stripes_of(pixels, 2000, "unknown")
        assert stripes.place == "lamp" and stripes.readout == "rows"
        off.append(off_in_sigmas(stripes, 2e-5, 2000))
    assert np.sqrt(np.mean(np.square(off))) < 2 and np.abs(off).max() < 4.5


def test_a_wrong_frequency_is_noticed_if_no_camera_has_the_row_time() -> None:
    pose = occ.look_at(position_m=[1, 1, 2.2], target_m=[1, 1, 3], up=[0, 1, 0])
    pixels, _ = occ.simulate(lamp_scene(), pose, seed=1)
    with pytest.raises(NoStripes, match="which no camera has"):
        stripes_of(pixels, 100, "rows")


def test_images_are_combined() -> None:
    def stripes(period_px: float, sigma_px: float, readout: str = "rows") -> Stripes:
        return Stripes(period_px, sigma_px, 4, 0.1, readout, "picture")

    both = combined([stripes(1000, 2), stripes(1002, 2)], 100, 0)
    assert both["consistent"] and both["row_time_s"] == pytest.approx(0.01 / 1001, rel=1e-5)
    assert both["sigma_s"] == pytest.approx(both["row_time_s"] * 1.414e-3, rel=0.01)
    assert combined([stripes(1000, 2)], 100, 1)["sigma_s"] == pytest.approx(1e-5 * np.hypot(2e-3, 1e-2))
    assert not combined([stripes(1000, 2), stripes(1200, 2)], 100, 0)["consistent"]
    assert not combined([stripes(1000, 2), stripes(1000, 2, "columns")], 100, 0)["consistent"]


def test_the_command_prints_the_key_of_the_scene(libocc: Run) -> None:
    for i in range(2):
        occ.write_image(f"{i}.png", wall(i))
    occ.write_image("flat.png", wall(ripple=0))
    code, out, err = libocc("row-time", "0.png", "1.png", "flat.png", "--frequency-hz", 100, "--json")
    data = json.loads(out)
    assert code == 0 and data["ok"] and len(data["images"]) == 2
    assert abs(data["row_time_s"] - 1.1e-5) < 4.5 * data["sigma_s"] and data["sigma_s"] < 2e-8
    assert data["problems"][0].startswith("flat.png: ") and "flat.png" in err
    code, out, _ = libocc("row-time", "0.png", "1.png", "--frequency-hz", 100)
    key, _, comment = out.splitlines()[-1].partition("  # ")
    assert code == 0 and float(key.removeprefix("row_time_s: ")) == pytest.approx(1.1e-5, rel=0.005)
    assert comment.endswith("; 3000 rows in 33.0 ms")
    sensor = "".join(line for line in out.splitlines() if line.startswith("row_time_s"))
    text = occ.Scene.load(Path(__file__).parents[2] / "data/scenes/irregular_six.yaml").format()
    assert "  row_time_s: 0\n" in text
    Path("scene.yaml").write_text(text.replace("  row_time_s: 0\n", f"  {sensor}\n"))
    assert occ.Scene.load("scene.yaml").sensor.row_time_s == pytest.approx(1.1e-5, rel=0.01)


def test_exit_codes_and_errors(libocc: Run) -> None:
    occ.write_image("flat.png", wall(ripple=0))
    occ.write_image("slow.png", wall(row_s=2e-5))
    occ.write_image("fast.png", wall())
    code, out, err = libocc("row-time", "flat.png", "--frequency-hz", 100)
    assert code == 1 and out == "" and "flat.png: across the picture: no stripes are visible" in err
    code, _, err = libocc("row-time", "slow.png", "fast.png", "--frequency-hz", 100)
    assert code == 1 and "contradict each other" in err
    assert not json.loads(libocc("row-time", "slow.png", "fast.png", "--frequency-hz", 100, "--json")[1])["ok"]
    assert libocc("row-time", "coded_four_1", "--frequency-hz", 2000)[0] == 1
    assert "cover all lamps but one" in libocc("row-time", "coded_four_1", "--frequency-hz", 2000)[2]
    Path("phone.heic").write_bytes(HEIC_HEAD)
    for arguments in (["absent.png"], ["phone.heic"]):
        code, _, err = libocc("row-time", *arguments, "--frequency-hz", 100)
        assert code == 2 and arguments[0] in err
    wrong: list[list[object]] = [["--frequency-hz", 0], ["--frequency-hz", "nan"], []]
    wrong += [["--frequency-hz", 100, "--readout", "up"], ["--frequency-hz", 100, "--frequency-sigma-hz", 100]]
    for options in wrong:
        assert libocc("row-time", "fast.png", *options)[0] == 2
