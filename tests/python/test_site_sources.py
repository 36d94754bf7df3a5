# SPDX-License-Identifier: Apache-2.0
"""The modules that generate the reference pages of the documentation site (docs/_ext)."""

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

Loader = Callable[[str], ModuleType]

XML = """<doxygen><compounddef kind="namespace"><compoundname>occ</compoundname><sectiondef>
<memberdef kind="function" prot="public" static="no" explicit="no" virt="non-virtual">
<type>LIBOCC_API <ref>double</ref></type><name>angle</name><argsstring>(const Pose &amp;a, int n=3)</argsstring>
<briefdescription><para>Angle of <computeroutput>a</computeroutput> *times* n.</para></briefdescription>
<location file="libocc/room/pose.hpp" line="20"/></memberdef>
<memberdef kind="enum" prot="public" strong="yes"><name>Kind</name>
<enumvalue><name>wide</name><briefdescription><para>a wide one</para></briefdescription></enumvalue>
<location file="libocc/room/pose.hpp" line="5"/></memberdef></sectiondef></compounddef>
<compounddef kind="struct"><compoundname>occ::Pose</compoundname><sectiondef>
<memberdef kind="variable" prot="public" static="no"><type>double</type><name>x_m</name><initializer>= 0</initializer>
<briefdescription/><location file="libocc/room/pose.hpp" line="12"/></memberdef>
<memberdef kind="variable" prot="public" static="no"><type>double</type><name>y_m</name><initializer>= 0</initializer>
<briefdescription><para>on the floor</para></briefdescription>
<location file="libocc/room/pose.hpp" line="12"/></memberdef>
<memberdef kind="variable" prot="private" static="no"><type>int</type><name>secret_</name>
<location file="libocc/room/pose.hpp" line="13"/></memberdef></sectiondef>
<location file="libocc/room/pose.hpp" line="10"/></compounddef></doxygen>"""


@pytest.fixture
def load(root: Path, monkeypatch: pytest.MonkeyPatch) -> Loader:
    """Imports a module of docs/_ext."""
    monkeypatch.syspath_prepend(root / "docs" / "_ext")

    def load_module(name: str) -> ModuleType:
        sys.modules.pop(name, None)
        return importlib.import_module(name)

    return load_module


def test_plain_text_keeps_code_lists_examples_and_blocks(load: Loader) -> None:
    text = """Fits `x_m` to a*b and names_.

image: (n, 2) array. Returns: a pose.
scene: Scene.

Options:
  seed: of the noise
    and more

- first
- second
  goes on

\b
  as it is *here*

>>> 1 + 1
2"""
    lines = load("plain_text").to_rst(text.splitlines())
    assert "Fits ``x_m`` to a\\*b and names\\_." in lines
    assert "image: (n, 2) array. Returns: a pose." in lines and "scene: Scene." in lines
    at = lines.index("- ``seed``: of the noise")
    assert lines[at - 2 : at + 2] == ["Options:", "", "- ``seed``: of the noise", "  and more"]
    assert "- second" in lines and "  goes on" in lines
    assert lines[lines.index("::") + 2].strip() == "as it is *here*"
    assert lines[lines.index(">>> 1 + 1") + 1] == "2"


def test_equations_of_a_header_are_blocks(load: Loader) -> None:
    text = load("plain_text")
    lines = text.to_rst(list(text.with_equations(["The law", "    a = b * c", "holds."])))
    assert lines[:2] == ["The law", ""] and any(line.strip() == "a = b * c" for line in lines)
    assert lines[lines.index("holds.") - 1] == ""


def test_signatures_have_short_types(load: Loader) -> None:
    shorten = load("signatures").shorten
    assert shorten("(x: typing.SupportsFloat | typing.SupportsIndex = 1.0)") == "(x: float = 1.0)"
    assert shorten("(s: libocc._core.Scene, p: os.PathLike | str | bytes)") == "(s: Scene, p: path)"
    long = '(p: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"])'
    assert shorten(long) == "(p: array[m, 3])"
    assert shorten(None) is None


def test_declarations_of_a_header_keep_their_order(load: Loader, tmp_path: Path) -> None:
    (tmp_path / "all.xml").write_text(XML)
    lines = list(load("cpp_api").CppApi(tmp_path).of_header("libocc/room/pose.hpp"))
    directives = [line.strip() for line in lines if line.strip().startswith(".. cpp:") and "namespace" not in line]
    assert directives == [
        ".. cpp:enum-class:: Kind", ".. cpp:enumerator:: wide", ".. cpp:struct:: Pose", ".. cpp:var:: double x_m = 0",
        ".. cpp:var:: double y_m = 0", ".. cpp:function:: double angle(const Pose &a, int n=3)",
    ]  # fmt: skip
    assert lines.count("      on the floor") == 2, "declarators of one line share their comment"
    assert any("Angle of ``a`` \\*times\\* n." in line for line in lines)
    assert list(load("cpp_api").CppApi(tmp_path).of_header("libocc/room/other.hpp")) == []


def test_pages_of_former_objects_are_removed(load: Loader, tmp_path: Path) -> None:
    pages = load("generated_pages")
    pages.write(tmp_path / "kept.rst", ["text", "", ""])
    (tmp_path / "former.rst").write_text("text\n")
    pages.remove_others(tmp_path, [tmp_path / "kept.rst"])
    assert [p.name for p in tmp_path.iterdir()] == ["kept.rst"] and (tmp_path / "kept.rst").read_text() == "text\n"


def test_every_folder_of_headers_has_a_title(load: Loader, root: Path) -> None:
    titles = load("generated_pages").TITLES
    rooms = {
        p.relative_to(root / "libocc").parts[0] for p in (root / "libocc").rglob("*.hpp") if "internal" not in p.parts
    }
    assert rooms == set(titles)
