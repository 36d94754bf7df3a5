# SPDX-License-Identifier: Apache-2.0
"""Results of `libocc calibrate camera` compared with the truth."""

import json
from pathlib import Path

import libocc as occ


def errors_in_sigmas(out: Path, truth: occ.Camera) -> dict[str, float]:
    data = json.loads((out / "result.json").read_text())
    true = {parameter.name: parameter.value for parameter in truth.parameters}
    return {p["name"]: (p["value"] - true[p["name"]]) / p["sigma"] for p in data["parameters"]}
