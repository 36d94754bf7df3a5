# SPDX-License-Identifier: Apache-2.0
"""Limits of the YAML reader: a file of any content is read or refused within seconds and little memory."""

import time

import pytest

from libocc.yaml_files import MAX_BYTES, MAX_LEVELS, MAX_VALUES, parse_yaml, read_yaml

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 9)
)
MERGES = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}\n" for i in range(1, 9)
)


@pytest.mark.parametrize(
    "text, reason",
    [
        ("a: " + "[" * 100_000, f"line 1: must be nested {MAX_LEVELS} levels deep at most"),
        ("a: " + "[" * 3000 + "]" * 3000, "levels deep at most"),
        ("a: " + "{a: " * 50_000, "levels deep at most"),
        ("a:\n" + "".join(" " * i + "-\n" for i in range(1, 1000)), f"line {MAX_LEVELS + 1}: must be nested"),
        (BOMB, f"must have {MAX_VALUES} values at most"),
        (MERGES, "values at most"),
        ("a: &a [*a]", "line 1: *a must not be used inside &a"),
        ("a: &a {b: {c: *a}}", "must not be used inside &a"),
        ("&a\nb: *a", "line 2: *a must not be used inside &a"),
        ("a: [" + "1," * MAX_VALUES + "]", "values at most"),
        ("a: '" + "x" * MAX_BYTES + "'", f"must have {MAX_BYTES} bytes at most"),
        ("a: *b", "is not valid YAML"),
        ("a: [1", "is not valid YAML"),
        ("a: !!python/object/apply:os.getcwd []", "is not valid YAML"),
    ],
)
def test_text_beyond_the_limits_is_refused_soon(text, reason, tmp_path):
    path = tmp_path / "room.yaml"
    path.write_text(text)
    begun = time.process_time()
    with pytest.raises(ValueError) as raised:
        read_yaml(path)
    assert time.process_time() - begun < 20
    assert str(path) in str(raised.value) and reason in str(raised.value)


def test_a_huge_file_is_not_read_to_its_end(tmp_path):
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # sparse
    with pytest.raises(ValueError, match="bytes at most"):
        read_yaml(path)


def test_what_is_within_the_limits_is_read():
    nested = "[" * (MAX_LEVELS - 1) + "7" + "]" * (MAX_LEVELS - 1)
    value = parse_yaml(f"a: {nested}")["a"]
    for _ in range(MAX_LEVELS - 1):
        (value,) = value
    assert value == 7
    assert parse_yaml("a: &p [1, 2e-5]\nb: *p\nc: [*p, *p]") == {
        "a": [1, 2e-5], "b": [1, 2e-5], "c": [[1, 2e-5], [1, 2e-5]],
    }
    assert parse_yaml("base: &b {x: 1, y: 2}\nmore: {<<: *b, y: 3}")["more"] == {"x": 1, "y": 3}
    assert len(parse_yaml("a: [" + "1," * (MAX_VALUES - 10) + "]")["a"]) == MAX_VALUES - 10
