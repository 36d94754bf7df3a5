# SPDX-License-Identifier: Apache-2.0
"""Calibration of response curves and of the lamps' light, from Python and from the command line."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from libocc._core import Mosaic
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

import libocc as occ


def wall_of_lamps(**sensor) -> occ.Scene:
    """Adjacent squares of 18 pixels with irradiances in a ratio of up to 100."""
    lamps = [
        occ.Lamp(
            id=i, shape=occ.LampShape.rectangle, size_m=[0.18, 0.18], normal=[0, 0, -1],
            centre_m=[0.2 * (i % 12 - 5.5), 0.2 * (i // 12 - 3.5), 10], power_w=100 ** (37 * i % 96 / 95),
        )
        for i in range(96)
    ]
    camera = occ.Camera.pinhole(width=240, height=160, fx_px=1000, fy_px=1000, cx_px=119.5, cy_px=79.5)
    values = dict(full_well_e=20000, black_level_dn=0, response=occ.Response.srgb, exposure_s=1.0)
    return occ.Scene(camera=camera, lamps=lamps, sensor=occ.Sensor(**{**values, **sensor}))


def exposure_series(scene: occ.Scene, count=5, factor=1.8):
    """Images and exposure times; the lamps of 3 W are saturated in the last image."""
    sensor = scene.sensor
    one = scene.replace(lamps=[scene.lamps[0].replace(power_w=3, centre_m=[0, 0, 10])])
    pixel_e = occ.simulate(one, np.eye(4), noise=False)[1].lamps[0].electrons / 18**2
    white_e = (2**sensor.bit_depth - 1) / sensor.gain_dn_per_e
    times = [white_e / pixel_e * factor ** (j + 1 - count) for j in range(count)]
    images = [
        occ.simulate(scene.replace(sensor=sensor.replace(exposure_s=time)), np.eye(4), seed=j)[0]
        for j, time in enumerate(times)
    ]
    return images, times


@pytest.fixture(scope="module")
def wall() -> occ.Scene:
    return wall_of_lamps()


@pytest.fixture(scope="module")
def series(wall):
    return exposure_series(wall)


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def srgb_inverse(stored):
    return np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)


# Response

def test_the_sensors_response_comes_back(wall, series):
    found = occ.photometry.recover_response(*series)
    assert found.ok and found.message == ""
    (channel,) = found.channels
    seen = (channel.level_dn >= channel.lowest_dn) & (channel.level_dn <= channel.highest_dn)
    truth = np.log(srgb_inverse(channel.level_dn / 255))
    error = channel.log_exposure - (truth - truth[channel.level_dn == 127])
    assert (abs(error[seen]) < 4 * channel.sigma[seen] + 1e-9).all() and abs(error[seen]).max() < 0.1
    assert channel.covariance.shape == (255, 255) and channel.sigma[126] == 0
    assert (np.diff(channel.log_exposure) >= 0).all()
    assert abs(channel.chi2 / channel.dof - 1) < 0.15 and channel.residuals.shape[1] == 7
    table = np.array(channel.table(101))
    assert table[0] == 0 and table[-1] == 1 and (np.diff(table) > 0).all()
    assert abs(table - srgb(np.linspace(0, 1, 101)))[5:].max() < 0.02


def test_the_response_can_be_used_by_the_sensor(wall, series, pose):
    sensor = occ.photometry.recover_response(*series).sensor(wall.sensor)
    assert sensor.response is occ.Response.table and len(sensor.response_table) == 1024
    again, times = exposure_series(wall.replace(sensor=sensor), 1)
    first, _ = exposure_series(wall, 1)
    assert abs(again[0].astype(float) - first[0]).mean() < 3


def test_opencvs_debevec_agrees(series):
    cv2 = pytest.importorskip("cv2")
    images, times = series
    theirs = cv2.createCalibrateDebevec(samples=400, lambda_=10, random=False)
    curve = theirs.process([cv2.merge([image] * 3) for image in images], np.array(times, np.float32))
    ours = occ.photometry.recover_response(images, times).channels[0]
    levels = np.arange(70, 231)
    difference = np.log(curve[levels, 0, 0]) - ours.log_exposure[levels - 1]
    assert abs(difference - difference.mean()).max() < 0.1


def test_colour_has_a_curve_per_channel(series):
    images, times = series
    found = occ.photometry.recover_response([np.dstack([image] * 3) for image in images], times)
    one, two, three = found.channels
    assert np.array_equal(one.log_exposure, three.log_exposure)
    with pytest.raises(ValueError, match="mosaic"):
        found.sensor(occ.Sensor())
    assert len(found.sensor(occ.Sensor(mosaic=Mosaic.rggb)).channels) == 3


def test_undetermined_parts_of_the_series_are_reported(series):
    images, times = series
    found = occ.photometry.recover_response(images[:2], times[:2])
    assert found.status is occ.Status.degenerate and "2 different exposure times" in found.message
    found = occ.photometry.recover_response(images[:2], times[:2], method=occ.photometry.ResponseMethod.basis)
    assert found.ok and len(found.channels[0].coefficients) == 3


@pytest.mark.parametrize(
    "images, times, text",
    [
        (lambda i: i, [1, 2], "exposures_s must be one for each of 5 images, got 2"),
        (lambda i: i, [1, 2, 0, 4, 5], r"exposures_s\[2\] must be positive, got 0"),
        (lambda i: [*i[:4], i[4][:99]], [1, 2, 3, 4, 5], r"images\[4\]'s size must be .* got 240 x 99"),
        (lambda i: [*i[:4], np.dstack([i[4]] * 3)], [1, 2, 3, 4, 5], r"images\[4\]'s channels"),
        (lambda i: [j.astype(np.uint16) for j in i], [1, 2, 3, 4, 5], "bit_depth must be given"),
    ],
)
def test_errors_name_the_invalid_argument(series, images, times, text):
    with pytest.raises(ValueError, match=text):
        occ.photometry.recover_response(images(series[0]), times)


# Light

@pytest.fixture(scope="module")
def beams(scene) -> occ.Scene:
    """Small lamps with a narrower beam than in the scene file."""
    lamps = [lamp.replace(radius_m=0.03, power_w=0.15, half_power_rad=math.radians(45)) for lamp in scene.lamps]
    return scene.replace(lamps=lamps, sensor=scene.sensor.replace(full_well_e=1e5, exposure_s=1.2e-5))


@pytest.fixture(scope="module")
def supposed(beams) -> occ.Scene:
    return beams.replace(lamps=[lamp.replace(power_w=0.1, half_power_rad=math.radians(60)) for lamp in beams.lamps])


@pytest.fixture(scope="module")
def poses():
    places = np.random.default_rng(3).uniform([0.3, 0.3, 0], [3.7, 3.7, 0.7], (14, 3))
    return [occ.look_at(position_m=place, target_m=[2, 2, 3], up=[0.1, 1, 0]) for place in places]


@pytest.fixture(scope="module")
def views(beams, poses):
    return [occ.simulate(beams, pose, seed=i)[0] for i, pose in enumerate(poses)]


def test_lamps_light_comes_back(beams, supposed, views, poses):
    found = occ.photometry.calibrate_light(supposed, views, poses)
    assert found.ok
    for light, truth, known in zip(found.lamps, beams.lamps, found.scene.lamps):
        assert light.status is occ.Status.ok and len(light.fluxes) == 14
        sigma = np.sqrt(np.diag(light.covariance))
        assert abs(math.log(light.power_w / truth.power_w)) < 4 * sigma[0]
        assert abs(light.order - 2) < 4 * sigma[1]
        assert known.power_w == light.power_w and known.power_sigma == pytest.approx(sigma[0])
    blobs = [occ.detect(view, sensor=supposed.sensor) for view in views]
    again = occ.photometry.calibrate_light(supposed, blobs, poses)
    assert [light.power_w for light in again.lamps] == [light.power_w for light in found.lamps]
    named = []
    for found_in, pose in zip(blobs, poses):
        places = [occ.rendering.project_lamp_centre(lamp, pose, beams.camera) for lamp in beams.lamps]
        named.append([
            occ.Match(lamp=lamp, blob=blob)
            for lamp, place in enumerate(places) for blob, seen in enumerate(found_in)
            if np.hypot(*(seen.centroid_px - place)) < 2
        ])
    by_name = occ.photometry.calibrate_light(supposed, blobs, poses, named)
    assert [light.status for light in by_name.lamps] == [occ.Status.ok] * 6


def test_a_common_factor_of_the_powers(beams, supposed, views, poses):
    found = occ.photometry.calibrate_light(supposed, views, poses, powers=occ.photometry.PowerFit.common_factor)
    assert found.ok and found.factor.covariance.shape == (7, 7)
    sigma = math.sqrt(found.factor.covariance[0, 0])
    assert abs(math.log(found.factor.value / 1.5)) < 4 * sigma < 0.02
    assert {lamp.power_w for lamp in found.scene.lamps} == {0.1 * found.factor.value}
    assert occ.photometry.calibrate_light(supposed, views, poses).factor is None
    with pytest.raises(TypeError, match="powers"):
        occ.photometry.calibrate_light(supposed, views, poses, powers="both")


def test_disabled_effects_are_ignored(supposed, views, poses):
    cornered = supposed.replace(lens=occ.Lens(vignetting=[-0.5]))
    off = cornered.replace(effects=occ.Effects(vignetting=occ.rendering.Use.off))
    assert off.as_rendered().lens.vignetting == [] and cornered.as_rendered() == cornered
    powers = [occ.photometry.calibrate_light(s, views, poses).lamps[0].power_w for s in (supposed, off, cornered)]
    assert powers[0] == powers[1] and powers[2] > 1.05 * powers[0]


def test_ambient_light_comes_back(beams, poses):
    ambient = beams.replace(ambient_w_m2=0.3)
    views = [occ.simulate(ambient, pose, seed=i)[0] for i, pose in enumerate(poses[:5])]
    found = occ.photometry.calibrate_ambient(beams, views, poses[:5])
    sigma = math.sqrt(found.variance_w2_m4)
    assert found.ok and abs(found.irradiance_w_m2 - 0.3) < 4 * sigma < 0.02
    assert found.dof == 4 and all(image.left_out == "" for image in found.images)
    with pytest.raises(ValueError, match="one pose for each of 5 images"):
        occ.photometry.calibrate_ambient(beams, views, poses)
    white = occ.photometry.calibrate_ambient(beams, [np.full_like(views[0], 255)], poses[:1])
    assert white.status is occ.Status.degenerate and "100.0 % of the background is saturated" in white.message


def test_one_image_leaves_the_order_open(supposed, views, poses):
    found = occ.photometry.calibrate_light(supposed, views[:1], poses[:1])
    assert found.status is occ.Status.degenerate
    assert found.lamps[0].status in (occ.Status.degenerate, occ.Status.no_lamps)
    assert found.scene == supposed
    with pytest.raises(ValueError, match="one pose for each of 1 images"):
        occ.photometry.calibrate_light(supposed, views[:1], poses)


# Command line

@pytest.fixture
def run(libocc):
    return libocc


def write_all(images) -> list[str]:
    names = [f"{i}.png" for i in range(len(images))]
    for name, image in zip(names, images):
        occ.write_image(name, image)
    return names


def test_the_response_goes_into_a_scene_file(run, wall, series):
    images, times = series
    names = write_all(images)
    code, out, err = run("response", *names, "--exposures", ",".join(map(str, times)), "--plot", "a.png")
    assert code == 0 and err == "" and re.match(r"levels \d+ to \d+ observed, sigma", out)
    assert occ.read_image("a.png").std() > 10
    found = yaml.safe_load(Path("response.yaml").read_text())
    assert set(found) == {"sensor"} and len(found["sensor"]["response_table"]) == 256

    scene = yaml.safe_load(wall.format())
    scene["sensor"].update(found["sensor"])  # as recommended in the written file
    sensor = occ.Scene.parse(yaml.safe_dump(scene)).sensor
    assert sensor.response is occ.Response.table and sensor.exposure_s == wall.sensor.exposure_s
    assert abs(np.array(sensor.response_table) - srgb(np.linspace(0, 1, 256)))[12:].max() < 0.02


def test_a_colour_response_goes_into_a_scene_file(run, wall, series):
    images, times = series
    names = write_all([np.dstack([image] * 3) for image in images])
    code, out, err = run("response", *names, "--exposures", ",".join(map(str, times)), "--plot", "a.png")
    assert code == 0, err
    assert [line.split(":")[0] for line in out.splitlines()] == ["red", "green", "blue"]
    found = yaml.safe_load(Path("response.yaml").read_text())["sensor"]
    scene = yaml.safe_load(wall.format())
    scene["sensor"].update({**found, "mosaic": "rggb"})
    assert len(occ.Scene.parse(yaml.safe_dump(scene)).sensor.channels) == 3


def test_times_by_name(run, series):
    images, times = series
    names = write_all(images)
    Path("t.csv").write_text("image,exposure_s\n" + "".join(f"{n},{t}\n" for n, t in zip(names, times)))
    Path("t.yaml").write_text(yaml.safe_dump(dict(zip(names, times))))
    Path("list.yaml").write_text(yaml.safe_dump(times))
    result = {run("response", *names, "--exposures", file, "--json")[1] for file in ("t.csv", "t.yaml", "list.yaml")}
    assert len(result) == 1 and json.loads(result.pop())["status"] == "ok"
    code, _, err = run("response", *names[::-1], "--exposures", "t.csv")
    assert code == 0, err


def write_jpegs(images, tags) -> list[str]:
    """Images with EXIF data, by number of the tag."""
    names = [f"{i}.jpg" for i in range(len(images))]
    for name, image, of_image in zip(names, images, tags):
        exif = Image.Exif()
        exif.get_ifd(0x8769).update(of_image)
        Image.fromarray(image).save(name, quality=100, exif=exif)
    return names


TIME, F_NUMBER, ISO = 0x829A, 0x829D, 0x8827


def test_times_from_the_images_exif(run, series):
    images, _ = series
    times = [0.02 * 1.8**i for i in range(5)]
    names = write_jpegs(images, [{TIME: IFDRational(round(t * 1e6), 1000000), ISO: 100} for t in times])
    code, out, err = run("response", *names, "--json")
    assert code == 0, err
    result = run("response", *names, "--exposures", ",".join(f"{t:.6f}" for t in times), "--json")
    assert result[1] == out and json.loads(out)["status"] == "ok"


@pytest.mark.parametrize(
    "tags, text",
    [
        ([{TIME: 0.1}, {}], "1.jpg: has no ExposureTime in its EXIF data; give --exposures"),
        ([{TIME: 0.1}, {TIME: IFDRational(0, 1)}], "1.jpg: the ExposureTime in its EXIF data must be positive, got 0"),
        ([{TIME: 0.1}, {TIME: IFDRational(1, 0)}], "1.jpg: the ExposureTime in its EXIF data must be positive"),
        ([{TIME: 0.1, ISO: 100}, {TIME: 0.2, ISO: 200}], "1.jpg: its ISO speed is 200, that of 0.jpg is 100"),
        ([{TIME: 0.1, F_NUMBER: 2.0}, {TIME: 0.2, F_NUMBER: 4.0}], "1.jpg: its f-number is 4.0, that of 0.jpg is 2.0"),
    ],
)
def test_exif_without_usable_times_is_rejected(run, series, tags, text):
    code, out, err = run("response", *write_jpegs(series[0][:2], tags))
    assert code == 2 and out == ""
    assert err.startswith("error: ") and text in err and err.count("\n") == 1


def test_images_without_times(run, series):
    names = write_all(series[0])
    for files, text in ((names, "0.png: has no ExposureTime"), (["nosuch.jpg"], "nosuch.jpg")):
        code, _, err = run("response", *files)
        assert code == 2 and text in err and err.count("\n") == 1
    Path("text.jpg").write_text("no image")
    assert "text.jpg" in run("response", "text.jpg")[2]


def test_a_response_that_is_not_determined(run, series):
    images, times = series
    names = write_all(images[:2])
    code, out, err = run("response", *names, "--exposures", f"{times[0]},{times[1]}")
    assert code == 1 and "degenerate: only 2 different exposure times" in err
    assert not Path("response.yaml").exists()


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("0.png", "1.png", "--exposures", "1,2,3"), "exposures_s must be one for each of 2 images, got 3"),
        (("0.png", "1.png", "--exposures", "1,0"), "exposures_s[1] must be positive, got 0"),
        (("0.png", "1.png", "--exposures", "1,two"), "--exposures must be a number of seconds, got 'two'"),
        (("0.png", "1.png", "--exposures", "none.yaml"), "none.yaml"),
        (("0.png", "1.png", "--exposures", "t.csv"), "t.csv: has 0 times for 1.png"),
        (("0.png", "nosuch.png", "--exposures", "1,2"), "nosuch.png"),
        (("0.png", "t.csv", "--exposures", "1,2"), "t.csv"),
        (("0.png", "small.png", "--exposures", "1,2"), "small.png's size must be"),
        (("0.png", "colour.png", "--exposures", "1,2"), "colour.png's channels must be"),
        (("deep.png", "deep.png", "--exposures", "1,2"), "--bit-depth must be given"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(run, series, arguments, text):
    write_all(series[0])
    occ.write_image("small.png", series[0][0][:50])
    occ.write_image("colour.png", np.dstack([series[0][0]] * 3))
    occ.write_image("deep.png", series[0][0].astype(np.uint16))
    Path("t.csv").write_text("0.png,1\n")
    code, out, err = run("response", *arguments)
    assert code == 2 and out == ""
    assert err.startswith("error: ") and text in err and err.count("\n") == 1


def test_light_writes_the_calibrated_scene(run, beams, supposed, views, poses):
    supposed.save("room.yaml")
    names = write_all(views)
    Path("poses.yaml").write_text(yaml.safe_dump({n: p.tolist() for n, p in zip(names, poses)}))
    code, out, err = run("light", "room.yaml", *names, "--poses", "poses.yaml")
    assert code == 0, err + out
    assert len(out.splitlines()) == 6 and "lamp 0: 0.1" in out
    found = occ.Scene.load("scene_calibrated.yaml")
    for lamp, truth in zip(found.lamps, beams.lamps):
        assert lamp.power_w == pytest.approx(truth.power_w, rel=0.03)
        assert lamp.half_power_rad == pytest.approx(truth.half_power_rad, rel=0.05)
    for name, pose in zip(names, poses):
        Path(name).with_suffix(".json").write_text(json.dumps({"cam_from_world": pose.tolist()}))
    assert run("light", "room.yaml", *names)[1] == out
    code, out, _ = run("light", "room.yaml", names[0], "--json", "--out", "one.yaml")
    assert code == 1 and json.loads(out)["status"] == "degenerate" and not Path("one.yaml").exists()


def test_light_finds_a_common_factor_and_ambient_light(run, beams, supposed, poses):
    ambient = beams.replace(ambient_w_m2=0.3)
    names = write_all([occ.simulate(ambient, pose, seed=i)[0] for i, pose in enumerate(poses)])
    supposed.save("room.yaml")
    Path("poses.yaml").write_text(yaml.safe_dump([p.tolist() for p in poses]))
    options = ("--poses", "poses.yaml", "--powers", "common_factor", "--ambient")
    code, out, err = run("light", "room.yaml", *names, *options)
    assert code == 0, err + out
    first, *_, last = out.splitlines()
    assert re.match(r"all powers: the scene's times 1\.[45]\d* \+- ", first)
    assert re.match(r"ambient light: 0\.[23]\d* W/m2 \+- .* 14 images, chi2", last)
    found = occ.Scene.load("scene_calibrated.yaml")
    assert found.ambient_w_m2 == pytest.approx(0.3, rel=0.05)
    assert [lamp.power_w for lamp in found.lamps] == pytest.approx([0.15] * 6, rel=0.03)
    result = json.loads(run("light", "room.yaml", *names, *options, "--json")[1])
    assert result["factor"]["sigma"] > 0 and result["ambient"]["images"] == 14
    code, _, err = run("light", "room.yaml", *names, "--powers", "both")
    assert code == 2 and "'each', 'common_factor'" in err


def test_undetermined_ambient_light_is_reported(run, supposed, views, poses):
    names = write_all(views)
    supposed.replace(sensor=supposed.sensor.replace(black_level_dn=90)).save("room.yaml")
    Path("poses.yaml").write_text(yaml.safe_dump([p.tolist() for p in poses]))
    code, out, _ = run("light", "room.yaml", *names, "--poses", "poses.yaml", "--ambient")
    assert code == 1 and "ambient light: degenerate: the background is darker than" in out
    colour = supposed.replace(sensor=supposed.sensor.replace(mosaic=Mosaic.rggb))
    colour.save("room.yaml")
    code, _, err = run("light", "room.yaml", *names, "--poses", "poses.yaml", "--ambient")
    assert code == 2 and "sensor.mosaic" in err and err.count("\n") == 1


@pytest.mark.parametrize(
    "written, text",
    [
        (None, "0.json"),
        ("[]", "poses.yaml: has 0 poses for 1 images"),
        ("{1.png: 3}", "poses.yaml: has no pose for 0.png"),
        ("{0.png: 3}", "poses.yaml: 0.png: cam_from_world must be 4x4 numbers"),
        ("7", "poses.yaml: must be a list of poses"),
        ("{0.png: [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}", "cam_from_world"),
    ],
)
def test_poses_that_do_not_fit_are_named(run, supposed, views, written, text):
    supposed.save("room.yaml")
    write_all(views[:1])
    if written is not None:
        Path("poses.yaml").write_text(written)
    more = ["--poses", "poses.yaml"] if written is not None else []
    code, out, err = run("light", "room.yaml", "0.png", *more)
    assert code == 2 and out == ""
    assert err.startswith("error: ") and text in err and err.count("\n") == 1
