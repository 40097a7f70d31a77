"""The bundle as hosts load it: laid out by the standard, three symbols, the C library alone."""

from __future__ import annotations

import platform
import re
import struct
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from palette4d.hosts.bundle import find_bundle

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="reads ELF files, which Linux has"
)

#: What glibc itself is made of, and the loader.
C_LIBRARY = re.compile(r"(libc|libm|libpthread|libdl|librt)\.so\.\d+|ld-linux.*\.so\.\d+")


@dataclass(frozen=True)
class Elf:
    """The dynamic section and symbols of a 64-bit little-endian shared object."""

    needed: list[str]
    exported: list[str]
    versions: list[str]
    text_relocations: bool


def read_elf(path: Path) -> Elf:
    """Read the few tables that say what a library needs and offers (System V ABI, chapter 5)."""
    data = path.read_bytes()
    assert data[:6] == b"\x7fELF\x02\x01", "not a 64-bit little-endian ELF file"
    section_offset, entry_size, count = (
        struct.unpack_from("<Q", data, 0x28)[0],
        *struct.unpack_from("<HH", data, 0x3A),
    )
    sections = [
        struct.unpack_from("<IIQQQQIIQQ", data, section_offset + i * entry_size)
        for i in range(count)
    ]

    def text(table: int, offset: int) -> str:
        start = sections[table][4] + offset
        return data[start : data.index(b"\0", start)].decode()

    needed, exported, versions = [], [], []
    text_relocations = False
    for _, kind, _, _, offset, size, link, info, _, _ in sections:
        if kind == 6:  # SHT_DYNAMIC
            for at in range(offset, offset + size, 16):
                tag, value = struct.unpack_from("<qQ", data, at)
                if tag == 1:  # DT_NEEDED
                    needed.append(text(link, value))
                text_relocations |= tag == 22  # DT_TEXTREL
        elif kind == 11:  # SHT_DYNSYM
            for at in range(offset, offset + size, 24):
                name, how, _, section, _, _ = struct.unpack_from("<IBBHQQ", data, at)
                # Global or weak, and defined here.
                if how >> 4 in (1, 2, 10) and section not in (0, 0xFFF1):
                    exported.append(text(link, name))
        elif kind == 0x6FFFFFFE:  # SHT_GNU_verneed
            at = offset
            for _ in range(info):
                _, names, _, first, following = struct.unpack_from("<HHIII", data, at)
                inner = at + first
                for _ in range(names):
                    _, _, _, name, step = struct.unpack_from("<IHHII", data, inner)
                    versions.append(text(link, name))
                    inner += step
                at += following
    return Elf(needed, sorted(exported), sorted(set(versions)), text_relocations)


@pytest.fixture(scope="module")
def bundle() -> Path:
    return find_bundle()


@pytest.fixture(scope="module")
def binary(bundle: Path) -> Path:
    binaries = list(bundle.glob("Contents/*/*.ofx"))
    assert len(binaries) == 1
    return binaries[0]


def test_layout(bundle: Path, binary: Path) -> None:
    assert bundle.name == "Palette4D.ofx.bundle"
    assert binary.name == "Palette4D.ofx"
    assert re.fullmatch(r"Linux-x86(-64)?|Linux-\w+", binary.parent.name)
    assert binary.stat().st_mode & 0o111


def test_exports_its_entry_points_alone(binary: Path) -> None:
    assert read_elf(binary).exported == ["OfxGetNumberOfPlugins", "OfxGetPlugin", "OfxSetHost"]


def test_links_the_c_library_alone(binary: Path) -> None:
    needed = read_elf(binary).needed
    assert needed
    assert [name for name in needed if not C_LIBRARY.fullmatch(name)] == []


def test_asks_for_glibc_versions_alone(binary: Path) -> None:
    elf = read_elf(binary)
    assert elf.versions
    assert [version for version in elf.versions if not version.startswith("GLIBC_")] == []
    assert not elf.text_relocations


def test_the_readme_states_the_glibc_floor(binary: Path, repo_root: Path) -> None:
    readme = (repo_root / "README.md").read_text(encoding="utf-8")
    stated = re.search(r"runs with glibc (\d+)\.(\d+) or later", readme)
    assert stated, "README.md does not state the node's glibc floor"
    floor = int(stated[1]), int(stated[2])
    here = tuple(int(part) for part in platform.libc_ver()[1].split(".")[:2])
    if here > (2, 36):
        pytest.skip("the README's figure is that of a node built on Debian 12 (glibc 2.36)")
    needed = [
        tuple(int(part) for part in version.removeprefix("GLIBC_").split(".")[:2])
        for version in read_elf(binary).versions
    ]
    assert max(needed) <= floor


def test_the_reader_sees_what_a_library_exports() -> None:
    """The checks above mean something: the same reader finds what `_core` exports and needs."""
    from palette4d import _core

    elf = read_elf(Path(_core.__file__))
    assert "PyInit__core" in elf.exported
    assert any(not C_LIBRARY.fullmatch(name) for name in elf.needed)
