# SPDX-License-Identifier: Apache-2.0
"""JSON Schemas of the YAML files: they accept what libocc accepts, and refuse misspelt keys and wrong types."""

import copy
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import libocc as occ
from libocc.cli.room_file import SHAPES
from libocc.cli.schemas import SCHEMAS
from libocc.guide.experiment import experiment_of
from libocc.yaml_files import read_yaml

jsonschema = pytest.importorskip("jsonschema")

ROOT = Path(__file__).resolve().parents[2]
Run = Callable[..., tuple[int, str, str]]
FOLDERS = {
    "scene": "scenes/*.yaml", "object": "objects/*.yaml", "network": "calibration/*/network.yaml",
    "camera": "calibration/*/camera.yaml", "trajectory": "trajectories/*.yaml", "sweep": "sweeps/*.yaml",
    "experiment": "experiments/*.yaml", "hard-case": "hard_cases/*.yaml",
}  # fmt: skip
SAMPLES = [(kind, str(p.relative_to(ROOT))) for kind, glob in FOLDERS.items() for p in (ROOT / "data").glob(glob)]
FREE = {("sweep", "parameters"), ("hard-case", "parameters"), ("hard-case", "sweep")}  # mappings with free keys
ROUTE = {"schema": "libocc-route/1", "waypoints": [{"x_m": 0, "y_m": 0, "speed_m_s": 1}, {"x_m": 1, "y_m": 0}]}
CAMERA = {"width_px": 64, "height_px": 48, "fx_px": 60}


def valid(kind: str, data: Any) -> bool:
    return bool(jsonschema.Draft7Validator(SCHEMAS[kind]).is_valid(data))


def errors(kind: str, data: Any) -> list[str]:
    return [
        f"{list(e.absolute_path)}: {e.message}" for e in jsonschema.Draft7Validator(SCHEMAS[kind]).iter_errors(data)
    ]


def mappings(data: Any, kind: str) -> Iterator[dict[str, Any]]:
    """All mappings in a file, except those with free keys."""
    if isinstance(data, list):
        for item in data:
            yield from mappings(item, kind)
    elif isinstance(data, dict):
        yield data
        for key, value in data.items():
            if (kind, key) not in FREE:
                yield from mappings(value, kind)


@pytest.mark.parametrize("kind", SCHEMAS)
def test_a_schema_is_valid_and_its_stored_file_is_current(kind: str) -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMAS[kind])
    stored = (ROOT / "data" / "schemas" / f"{kind}.schema.json").read_text()
    assert json.loads(stored) == SCHEMAS[kind], f"run: libocc schema {kind} --out data/schemas/{kind}.schema.json"


def test_every_stored_file_belongs_to_a_schema() -> None:
    assert {p.name for p in (ROOT / "data" / "schemas").iterdir()} == {f"{kind}.schema.json" for kind in SCHEMAS}


@pytest.mark.parametrize("kind, name", SAMPLES)
def test_a_sample_is_valid(kind: str, name: str) -> None:
    assert errors(kind, read_yaml(ROOT / name)) == []


@pytest.mark.parametrize("kind, name", SAMPLES)
def test_each_misspelt_key_of_a_sample_is_an_error(kind: str, name: str) -> None:
    data = read_yaml(ROOT / name)
    tried = 0
    for i, part in enumerate(mappings(data, kind)):
        for key in part:
            if kind == "camera" and part is data:
                continue  # a camera file may have further sections
            changed = copy.deepcopy(data)
            target = list(mappings(changed, kind))[i]
            target[f"{key}x"] = target.pop(key)
            assert not valid(kind, changed), f"{key}x instead of {key}"
            tried += 1
            if tried > 150:
                return  # large maps repeat the same mappings
    assert tried > 0


def test_every_kind_has_a_sample() -> None:
    assert {kind for kind, _ in SAMPLES} | {"route"} == set(SCHEMAS)
    assert errors("route", ROUTE) == []
    assert not valid("route", {**ROUTE, "lap": 2}) and not valid("route", {"schema": "libocc-route/1"})


@pytest.mark.parametrize(
    "kind, path, value",
    [
        ("scene", ["camera", "fx_px"], "wide"),
        ("scene", ["lamps", 0, "centre_m"], [1, 2]),
        ("scene", ["lamps", 0, "shape"], "round"),
        ("scene", ["lamps", 0, "id"], 1.5),
        ("scene", ["lamps"], {}),
        ("scene", ["sensor", "response"], "log"),
        ("scene", ["schema"], "libocc-scene/2"),
        ("object", ["points", 0, "position_m"], "origin"),
        ("network", ["cameras"], []),
        ("trajectory", ["waypoints", 0, "time_s"], "noon"),
        ("sweep", ["keep"], ["pictures"]),
        ("experiment", ["runs"], "many"),
    ],
)
def test_a_wrong_type_or_word_is_an_error(kind: str, path: list[Any], value: Any) -> None:
    name = next(name for of, name in SAMPLES if of == kind and "kookmin" not in name)
    data = target = read_yaml(ROOT / name)
    for key in path[:-1]:
        target = target.setdefault(key, {}) if isinstance(target, dict) else target[key]
    target[path[-1]] = value
    assert not valid(kind, data)


@pytest.mark.parametrize(
    "path", ["camera", "lamps", "lamps[0].id", "lamps[0].radius_m", "camera.width_px", "camera.fx_px"]
)
def test_a_missing_key_is_an_error(path: str) -> None:
    data: dict[str, Any] = {
        "schema": "libocc-scene/1", "camera": dict(CAMERA), "lamps": [{"id": 0, "centre_m": [0, 0, 3], "radius_m": 0.1}]
    }  # fmt: skip
    assert valid("scene", data)
    *parents, last = re.findall(r"\w+", path)
    target: Any = data
    for key in parents:
        target = target[int(key) if key.isdigit() else key]
    del target[last]
    assert not valid("scene", data)
    with pytest.raises(ValueError, match=last):
        occ.Scene.parse(json.dumps(data))


def defaults(schema: dict[str, Any]) -> dict[str, Any]:
    return {key: value["default"] for key, value in schema["properties"].items() if "default" in value}


def test_libocc_reads_every_key_of_a_scene_with_its_default() -> None:
    """The schema has no key that the reader does not have."""
    parts = SCHEMAS["scene"]["properties"]
    lamp = {"id": 0, "centre_m": [0, 0, 3], "radius_m": 0.1}
    minimal = {"schema": "libocc-scene/1", "camera": CAMERA, "lamps": [lamp]}
    tag = {"id": 0, "size_m": 0.1, "centre_m": [1, 1, 1]}
    code = {"kind": "ufsook"}
    cases: list[dict[str, Any]] = [{"ambient_w_m2": 0.1}, {"assumed": ["a guess"]}]
    cases += [
        {key: {name: value}} for key in ("sensor", "lens", "room") for name, value in defaults(parts[key]).items()
    ]
    cases += [{"effects": {name: value}} for name, value in defaults(parts["effects"]).items()]
    cases += [{"effects": {name: use}} for name in parts["effects"]["properties"] for use in ("on", "off", "auto")
              if not name.startswith("tolerance")]  # fmt: skip
    cases += [{"tags": [{**tag, name: value}]} for name, value in defaults(parts["tags"]["items"]).items()]
    lamps = parts["lamps"]["items"]
    cases += [{"lamps": [{**lamp, name: value}]} for name, value in defaults(lamps).items()]
    codes = defaults(lamps["properties"]["code"])
    cases += [{"lamps": [{**lamp, "code": {**code, name: value}}]} for name, value in codes.items() if name != "line"]
    assert len(cases) > 90
    for case in cases:
        assert errors("scene", {**minimal, **case}) == [], case
        occ.Scene.parse(json.dumps({**minimal, **case}))


def test_libocc_reads_every_key_of_an_experiment_with_its_default() -> None:
    minimal = {
        "schema": "libocc-experiment/1",
        "scene": "kookmin_four_lamps",
        "route": {"waypoints": ROUTE["waypoints"]},
    }
    parts = SCHEMAS["experiment"]["properties"]
    cases: list[dict[str, Any]] = [{name: value} for name, value in defaults(SCHEMAS["experiment"]).items()]
    for key in ("vehicle", "docking", "tracker", "faults", "start"):
        cases += [{key: {name: value}} for name, value in defaults(parts[key]).items()]
    cases += [{"tracker": {"floor": defaults(parts["tracker"]["properties"]["floor"])}}]
    cases += [{"vehicle": {"noise": defaults(parts["vehicle"]["properties"]["noise"])}}]
    cases += [{"controller": {"pace": defaults(parts["controller"]["else"]["properties"]["pace"])}}]
    cases += [{"controller": {**defaults(parts["controller"]["then"]), "kind": "stanley"}}]
    assert len(cases) > 35
    for case in cases:
        assert errors("experiment", {**minimal, **case}) == [], case
        experiment_of({**minimal, **case}, ROOT)


def test_the_schema_of_a_scene_has_every_key_of_the_documentation() -> None:
    """The tables of data/scenes/README.md agree with the lists of fields in the sources (key_tables_test.cpp)."""
    text = (ROOT / "data" / "scenes" / "README.md").read_text().split("## Lamp tables")[0]
    documented = set()
    for row in re.findall(r"^\| ([^|]*`[^|]*) \|", text, re.MULTILINE):
        documented |= set(re.findall(r"`(\w+)`", row)) if ".yaml" not in row else set()
    assert documented == keys_of(SCHEMAS["scene"]) - {"file", "red", "green", "blue"}


def keys_of(schema: Any) -> set[str]:
    if isinstance(schema, list):
        return set().union(*map(keys_of, schema))
    if not isinstance(schema, dict):
        return set()
    own = set(schema["properties"]) if isinstance(schema.get("properties"), dict) else set()
    return own.union(*(keys_of(part) for part in schema.values()))


@pytest.mark.parametrize("shape", SHAPES)
def test_a_new_scene_is_valid_with_all_its_keys(libocc: Run, shape: str) -> None:
    assert libocc("new-scene", "--out", "room.yaml", "--shape", shape)[0] == 0
    text = Path("room.yaml").read_text()
    assert errors("scene", read_yaml("room.yaml")) == []
    Path("all.yaml").write_text(re.sub(r"^( *)#(?=[\w-])", r"\1", text, flags=re.MULTILINE))
    assert errors("scene", read_yaml("all.yaml")) == []
    assert "# # yaml-language-server: $schema=scene.schema.json" in text


def test_what_libocc_writes_is_valid(tmp_path: Path) -> None:
    scene = occ.Scene.load(ROOT / "data" / "scenes" / "ufsook_hall.yaml")
    (tmp_path / "scene.yaml").write_text(scene.format())
    assert errors("scene", read_yaml(tmp_path / "scene.yaml")) == []
    occ.write_camera(str(tmp_path / "camera.yaml"), scene.camera)
    assert errors("camera", read_yaml(tmp_path / "camera.yaml")) == []


def test_the_command_lists_prints_and_writes(libocc: Run) -> None:
    code, out, _ = libocc("schema")
    assert code == 0 and [line.split()[0] for line in out.splitlines()] == list(SCHEMAS)
    code, out, _ = libocc("schema", "scene")
    assert code == 0 and json.loads(out) == SCHEMAS["scene"]
    code, out, _ = libocc("schema", "network", "--out", "n.json")
    assert code == 0 and out == "n.json: JSON Schema of network files\n"
    assert json.loads(Path("n.json").read_text()) == SCHEMAS["network"]


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("scen",), "did you mean scene?"),
        (("--out", "a.json"), "needs the kind"),
        (("scene", "--out", "no/a.json"), "no/a.json"),
    ],
)
def test_bad_arguments_of_the_command_are_one_line(libocc: Run, arguments: tuple[str, ...], message: str) -> None:
    code, _, err = libocc("schema", *arguments)
    assert code == 2 and message in err and err.count("\n") == 1
