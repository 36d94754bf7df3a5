# SPDX-License-Identifier: Apache-2.0
"""tools/finish_wheel: what is linked into a wheel is found, and what may not be shipped is refused."""

import importlib.util
import zipfile
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType

import pytest

MAP = """Archive member included to satisfy reference by file (symbol)

{libraries}/libtiff.a(tif_open.c.o)
                              libocc/tiff_file.cpp.o (TIFFOpen)
{libraries}/libtiff.a(tif_lzw.c.o)
                              {libraries}/libtiff.a(tif_codec.c.o) (TIFFInitLZW)
{member}

Linker script and memory map

LOAD /usr/lib/gcc/x86_64-linux-gnu/12/crtbeginS.o
LOAD libocc/tiff_file.cpp.o
LOAD {libraries}/libtiff.a
LOAD /usr/lib/x86_64-linux-gnu/libamd.so
LOAD {other}
LOAD /usr/lib/gcc/x86_64-linux-gnu/12/libstdc++.so
"""


@pytest.fixture(scope="module")
def tool(root: Path) -> ModuleType:
    loader = SourceFileLoader("finish_wheel", str(root / "tools" / "finish_wheel"))
    spec = importlib.util.spec_from_loader("finish_wheel", loader)
    assert spec
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


@pytest.fixture
def build(tmp_path: Path) -> Path:
    build = tmp_path / "build"
    build.mkdir()
    return build


def write_maps(build: Path, other: str, member: str = "") -> None:
    for name in ("libocc.map", "_core.map"):
        (build / name).write_text(MAP.format(libraries=build.parent, other=other, member=member))


def test_linked_archives_and_their_object_files_are_found(tool: ModuleType, build: Path) -> None:
    write_maps(build, str(build / "main.o"))  # built here, so no object file of others
    assert tool.used_libraries(build) == {"libtiff.a": {"tif_open.c.o", "tif_lzw.c.o"}}


def test_an_archive_of_which_nothing_is_linked_needs_no_licence(tool: ModuleType, build: Path) -> None:
    write_maps(build, "/somewhere/libz.a")
    assert tool.used_libraries(build).keys() == {"libtiff.a"}


@pytest.mark.parametrize(
    "other, member, named",
    [
        ("/usr/lib/libjbig.a", "/usr/lib/libjbig.a(jbig.o)", "libjbig.a"),
        ("/usr/lib/special.o", "", "special.o"),
    ],
)
def test_an_archive_of_unknown_licence_is_refused(
    tool: ModuleType, build: Path, other: str, member: str, named: str
) -> None:
    write_maps(build, other, member)
    with pytest.raises(SystemExit, match=f"{named} is linked, and its licence is unknown"):
        tool.used_libraries(build)


def test_a_wheel_without_maps_is_refused(tool: ModuleType, build: Path) -> None:
    with pytest.raises(SystemExit, match="build the wheel with tools/wheel"):
        tool.used_libraries(build)


def test_copyright_notices_of_linked_sources_are_collected_once(tool: ModuleType, tmp_path: Path) -> None:
    comment = "/* Copyright A. Author */"
    (tmp_path / "a.c").write_text(f"{comment}\nint a;\n/* no notice */\n")
    (tmp_path / "b.c").write_text(f"{comment}\n// Copyright B. Author\n// All rights reserved.\nint b;\n")
    (tmp_path / "c.c").write_text("// Copyright of a file that is not linked\n")
    found = tool.notices(tmp_path, {"a.c.o", "b.c.o", "generated.c.o"})
    assert found == [comment, "// Copyright B. Author\n// All rights reserved.\n"]


@pytest.mark.parametrize("text", ["under the GNU General Public License", "SPDX-License-Identifier: LGPL"])
def test_a_linked_source_under_the_gpl_is_refused(tool: ModuleType, tmp_path: Path, text: str) -> None:
    (tmp_path / "a.c").write_text(f"/* {text} */\n")
    with pytest.raises(SystemExit, match="a.c mentions the GPL"):
        tool.notices(tmp_path, {"a.c.o"})
    assert tool.notices(tmp_path, {"b.c.o"}) == []


def test_licences_enter_metadata_and_record(tool: ModuleType, tmp_path: Path) -> None:
    wheel = tmp_path / "libocc-1-cp313-cp313-manylinux_2_36_x86_64.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("libocc-1.dist-info/METADATA", "Name: libocc\nLicense-Expression: Apache-2.0\n\nText.\n")
        archive.writestr("libocc-1.dist-info/RECORD", "old")
    made = tool.finish(wheel, tmp_path / "dist", {"zlib/LICENSE": "zlib's"}, {"Zlib", "Apache-2.0"})
    with zipfile.ZipFile(made) as archive:
        metadata = archive.read("libocc-1.dist-info/METADATA").decode()
        record = archive.read("libocc-1.dist-info/RECORD").decode()
        assert archive.read("libocc-1.dist-info/licenses/zlib/LICENSE") == b"zlib's"
    assert "License-Expression: Apache-2.0 AND Zlib\nLicense-File: zlib/LICENSE\n\nText.\n" in metadata
    names = [line.split(",")[0] for line in record.splitlines()]
    assert names == [f"libocc-1.dist-info/{name}" for name in ("METADATA", "licenses/zlib/LICENSE", "RECORD")]


def test_libraries_that_auditwheel_adds_are_refused(tool: ModuleType, tmp_path: Path) -> None:
    wheel = tmp_path / "libocc-1-cp313-cp313-manylinux_2_36_x86_64.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("libocc.libs/libjbig-1.so", "")
        archive.writestr("libocc-1.dist-info/METADATA", "Name: libocc\n\n")
        archive.writestr("libocc-1.dist-info/RECORD", "")
    with pytest.raises(SystemExit, match="libjbig"):
        tool.finish(wheel, tmp_path / "dist", {}, {"Apache-2.0"})
