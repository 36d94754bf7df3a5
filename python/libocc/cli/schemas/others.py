# SPDX-License-Identifier: Apache-2.0
"""Schemas of networks, trajectories, sweeps and hard cases."""

from ..._core import DatumKind
from ...network import sections as networks
from ..dataset.images import FORMATS
from ..hard_cases import cases
from ..poses import KEYS as POSE_KEYS
from ..sweep import plan, ranges
from .structs import NUMBER, TEXT, WHOLE, Schema, described, document, listed, mapping, matrix, vector, words

VALUE: Schema = {"type": ["number", "string", "boolean", "array"]}  # of a parameter


def pose() -> dict[str, Schema]:
    angles = {
        "heading_deg": described(NUMBER, "azimuth of the image's right side, for a camera that looks up [deg]"),
        "tilt_deg": described(NUMBER, "angle between the optical axis and the vertical [deg]"),
        "tilt_towards_deg": described(NUMBER, "azimuth of the tilt [deg]"),
    }
    place = {
        "position_m": described(vector(3), "position of the camera in the world [m]"),
        "look_at_m": described(vector(3), "target point, in place of the angles [m]"),
        "up": described(vector(3), "with look_at_m: up direction of the image"),
    }
    found = {**place, **angles}
    assert set(found) == set(POSE_KEYS)
    return found


def trajectory() -> Schema:
    time = {"time_s": described(NUMBER, "later than the previous one [s]")}
    points = listed(mapping({**time, **pose()}, ["time_s", "position_m"]), 1)
    return document("libocc trajectory", "libocc-trajectory/1", {"waypoints": points}, ["waypoints"])


def sweep() -> Schema:
    ends = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}
    kinds = [
        mapping({kind: ends, "count": WHOLE, **({} if kind in ranges.STEPS else {"seed": WHOLE})}, [kind, "count"])
        for kind in (*ranges.STEPS, *ranges.DRAWS)
    ]
    values = listed(VALUE, 1)
    parameter = {"anyOf": [values, mapping({"values": values}, ["values"]), *kinds]}
    properties = {
        "scene": described(TEXT, "a file, relative to this file or the current folder, or an installed scene"),
        "pose": mapping(pose(), ["position_m"]),
        "parameters": {
            "type": "object",
            "description": "values by the path of a key, such as sensor.exposure_s or lamps[*].power_w",
            "additionalProperties": parameter,
            "minProperties": 1,
        },
        "combine": {**words("grid", "zip"), "default": "grid"},
        "images": described({**WHOLE, "default": 1}, "number of images at each point"),
        "seed": described({**WHOLE, "default": 0}, "seed of the noise and of random values"),
        "keep": listed(words(*plan.KEEPS), 1),
        "format": {**words(*FORMATS), "default": "png"},
    }
    assert set(properties) == set(plan.KEYS) - {"schema"}
    return document("libocc sweep", plan.SCHEMA, properties, ["scene", "pose", "parameters"])


def network() -> Schema:
    tables = ("images", "stations", "mounts", "points", "bodies", "shapes", "observations", "check_points")
    names = listed(TEXT)
    sigmas: Schema = {"anyOf": [NUMBER, vector(3)]}  # one for all axes, or three
    properties: dict[str, Schema] = {
        "cameras": listed(mapping({"name": TEXT, "file": TEXT, "free": names}, ["name", "file"]), 1),
        **{key: described(TEXT, "table: a CSV file in the same folder") for key in tables},
        "distances": listed(
            mapping(
                {"from": TEXT, "to": TEXT, "length_m": NUMBER, "sigma_m": NUMBER}, ["from", "to", "length_m", "sigma_m"]
            )
        ),
        "control": listed({
            **mapping(
                {"target": TEXT, "position_m": vector(3), "sigma_m": sigmas, "covariance_m2": matrix(3)},
                ["target", "position_m"],
            ),
            "oneOf": [{"required": ["sigma_m"]}, {"required": ["covariance_m2"]}],
        }),
        "priors": listed(
            mapping(
                {"camera": TEXT, "parameter": TEXT, "value": NUMBER, "sigma": NUMBER},
                ["camera", "parameter", "value", "sigma"],
            )
        ),
        "pose_priors": listed({
            **mapping(
                {
                    "image": TEXT, "station": TEXT, "position_m": vector(3), "quaternion": vector(4),
                    "sigma_rad": sigmas, "sigma_m": sigmas, "covariance": matrix(6),
                },
                ["position_m", "quaternion"],
            ),
            "allOf": [
                {"oneOf": [{"required": ["image"]}, {"required": ["station"]}]},
                {"oneOf": [{"required": ["sigma_rad", "sigma_m"]}, {"required": ["covariance"]}]},
            ],
        }),
        "datum": mapping({"kind": words(*DatumKind.__members__), "targets": names}, ["kind"]),
    }
    assert set(properties) == set(networks.KEYS) - {"schema"}
    return document("libocc network", networks.SCHEMA, properties, ["cameras", "images", "observations"])


def hard_case() -> Schema:
    types: dict[object, Schema] = {str: {"type": "string"}, int: WHOLE, dict: {"type": "object"}}
    properties = {key: types.get(kind, NUMBER) for key, kind in cases.KINDS.items()}
    properties["verdict"] = words(*cases.VERDICTS)
    properties["generator"] = words(*cases.GENERATORS)
    properties["truth"] = words("view", "mate", "none")
    needed = [key for key in cases.REQUIRED if key != "schema"]
    return document("libocc hard case", cases.SCHEMA, properties, needed)
