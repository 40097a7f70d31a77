"""What each library in the bundle exports and needs, and how it is hardened; the archive."""

from __future__ import annotations

import hashlib
import plistlib
import re
import shutil
import struct
import sys
import zipfile
from pathlib import Path

import lief
import pytest

from palette4d import _core
from palette4d.hosts import bundle as hosts
from palette4d.hosts.bundle import architecture, default_destination
from palette4d.hosts.editors import install_kdenlive, install_shotcut

ENTRIES = ["OfxGetNumberOfPlugins", "OfxGetPlugin", "OfxSetHost"]
C_LIBRARY = re.compile(r"(libc|libm|libpthread|libdl|librt|ld-linux-(x86-64|aarch64))\.so\.\d+")
WINDOWS_LIBRARY = re.compile(r"(kernel32|ntdll|api-ms-win-crt-[a-z]+-l1-1-0)\.dll")
GLIBC = (2, 17)
MACOS = [11, 0, 0]


def library(bundle: Path, folder: str) -> Path:
    return bundle / "Contents" / folder / "Palette4D.ofx"


def test_the_bundle_has_a_library_for_every_system_and_nothing_else(bundle: Path) -> None:
    files = {path.relative_to(bundle).as_posix() for path in bundle.rglob("*") if path.is_file()}
    folders = ("Linux-x86-64", "Linux-aarch64", "Win64", "MacOS")
    expected = {f"Contents/{folder}/Palette4D.ofx" for folder in folders}
    expected.add("Contents/Info.plist")
    expected |= {
        f"Contents/Resources/{name}"
        for name in (
            "kdenlive/palette4d.xml",
            "shotcut/palette4d/meta.qml",
            "shotcut/palette4d/ui.qml",
        )
    }
    licences = {name for name in files if name.startswith("Contents/Resources/licences/")}
    assert licences
    assert files - licences == expected
    about = plistlib.loads((bundle / "Contents" / "Info.plist").read_bytes())
    assert (about["CFBundleExecutable"], about["CFBundlePackageType"]) == ("Palette4D.ofx", "BNDL")
    assert about["LSMinimumSystemVersion"] == "{}.{}".format(*MACOS)


@pytest.mark.parametrize("folder", ["Linux-x86-64", "Linux-aarch64"])
def test_linux(bundle: Path, folder: str) -> None:
    elf = lief.ELF.parse(library(bundle, folder))
    assert elf is not None
    assert elf.header.machine_type.name == folder.removeprefix("Linux-").upper().replace("-", "_")
    assert sorted(symbol.name for symbol in elf.exported_symbols) == ENTRIES
    assert [name for name in elf.libraries if not C_LIBRARY.fullmatch(name)] == []
    versions = {
        version.name
        for wanted in elf.symbols_version_requirement
        for version in wanted.get_auxiliary_symbols()
    }
    floors = [tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in versions]
    assert floors
    assert max(floors) <= GLIBC

    tags, segments = lief.ELF.DynamicEntry.TAG, lief.ELF.Segment.TYPE
    assert any(segment.type == segments.GNU_RELRO for segment in elf.segments)
    assert elf.has(tags.BIND_NOW) or lief.ELF.DynamicEntryFlags.FLAG.BIND_NOW in elf.get(tags.FLAGS)
    assert not elf.has(tags.TEXTREL)
    (stack,) = (segment for segment in elf.segments if segment.type == segments.GNU_STACK)
    assert lief.ELF.Segment.FLAGS.X not in stack.flags
    if folder == "Linux-x86-64":  # the guard's value, as compilers read it: mov reg, fs:0x28
        assert re.search(rb"\x64[\x48\x4c]\x8b.\x25\x28\0\0\0", elf.get_section(".text").content)
    assert not [section.name for section in elf.sections if section.name.startswith(".debug")]


def test_windows(bundle: Path) -> None:
    pe = lief.PE.parse(library(bundle, "Win64"))
    assert pe is not None
    assert pe.header.machine == lief.PE.Header.MACHINE_TYPES.AMD64
    assert sorted(entry.name for entry in pe.get_export().entries) == ENTRIES
    names = [wanted.name.lower() for wanted in pe.imports]
    assert names
    assert [name for name in names if not WINDOWS_LIBRARY.fullmatch(name)] == []
    flags = lief.PE.OptionalHeader.DLL_CHARACTERISTICS
    for flag in (flags.DYNAMIC_BASE, flags.HIGH_ENTROPY_VA, flags.NX_COMPAT):
        assert pe.optional_header.has(flag)
    assert pe.has_relocations
    # A hash of the content in place of the time, and no path of a debug file.
    assert [type(entry) for entry in pe.debug] == [lief.PE.Repro]


@pytest.mark.parametrize(
    "preset", ["linux-x86_64", "linux-aarch64", "windows", "macos-x86_64", "macos-arm64"]
)
def test_functions_check_their_stack(preset: str, bundle: Path, repo_root: Path) -> None:
    core = repo_root / "build" / "cmake" / preset / "core" / "libpalette4d_core.a"
    assert b"__stack_chk_fail" in core.read_bytes()


def slices(path: Path) -> list[bytes]:
    data = path.read_bytes()
    magic, count = struct.unpack_from(">II", data)
    assert magic == 0xCAFEBABE
    parts = [struct.unpack_from(">IIIII", data, 8 + 20 * i) for i in range(count)]
    return [data[offset : offset + size] for _, _, offset, size, _ in parts]


def test_macos(bundle: Path) -> None:
    parsed = lief.MachO.parse(library(bundle, "MacOS"))
    assert parsed is not None
    processors = []
    for part in parsed:
        processors.append(part.header.cpu_type.name)
        exported = {symbol.name for symbol in part.exported_symbols}
        # zig's linker also exports the weak operators new and delete, and two names of its own.
        assert {f"_{name}" for name in ENTRIES} == {
            name for name in exported if not re.match(r"__Zn|__Zd|__mh_|___dso_handle$", name)
        }
        loads = lief.MachO.LoadCommand.TYPE.LOAD_DYLIB
        assert [used.name for used in part.libraries if used.command == loads] == [
            "/usr/lib/libSystem.B.dylib"
        ]
        assert part.build_version.platform == lief.MachO.BuildVersion.PLATFORMS.MACOS
        assert part.build_version.minos == MACOS
        assert "___stack_chk_guard" in {symbol.name for symbol in part.symbols}
        assert not [segment.name for segment in part.segments if segment.name == "__DWARF"]
    assert processors == ["X86_64", "ARM64"]


def test_the_arm64_part_has_the_signature_that_macos_asks_for(bundle: Path) -> None:
    """Ad hoc: the hash of every page; a Mac loads no arm64 code whose hashes differ."""
    part = slices(library(bundle, "MacOS"))[1]
    parsed = lief.MachO.parse(list(part))
    assert parsed is not None
    where = parsed.at(0).code_signature
    blobs = part[where.data_offset : where.data_offset + where.data_size]
    assert struct.unpack_from(">I", blobs)[0] == 0xFADE0CC0
    count = struct.unpack_from(">I", blobs, 8)[0]
    index = dict(struct.unpack_from(">II", blobs, 12 + 8 * i) for i in range(count))
    directory = blobs[index[0] :]
    magic, _, _, flags, hashes, _, _, pages, limit = struct.unpack_from(">9I", directory)
    size, kind, _, page_bits = struct.unpack_from(">4B", directory, 36)
    assert (magic, kind, size) == (0xFADE0C02, 2, 32)  # a code directory, SHA-256
    assert flags & 2  # ad hoc
    assert limit == where.data_offset
    step = 1 << page_bits
    assert pages == -(-limit // step)
    for page in range(pages):
        start = page * step
        found = directory[hashes + 32 * page : hashes + 32 * (page + 1)]
        assert found == hashlib.sha256(part[start : min(start + step, limit)]).digest(), page


@pytest.mark.parametrize("system", ["linux", "win32", "darwin"])
def test_it_installs_on_every_system(
    system: str, bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As from a wheel, to where the hosts of that system look."""
    package = tmp_path / "palette4d"
    shutil.copytree(bundle, package / "_ofx" / bundle.name)
    monkeypatch.setattr(_core, "__file__", str(package / "_core.so"))
    monkeypatch.setattr(hosts, "architecture", lambda: architecture(system, "AMD64"))
    monkeypatch.setenv("OFX_PLUGIN_PATH", str(tmp_path / "OFX"))
    assert default_destination(system) == tmp_path / "OFX"
    installed = hosts.install_bundle(hosts.find_bundle(), default_destination(system))
    library = installed / "Contents" / architecture(system, "AMD64") / "Palette4D.ofx"
    assert library.read_bytes() == (bundle / library.relative_to(installed)).read_bytes()
    assert (installed / hosts.PROGRAM).read_text() == f"{sys.executable}\n"


def test_the_files_of_editors_are_inside(bundle: Path, tmp_path: Path) -> None:
    """docs/hosts says which folder to copy where; `install-plugin` writes the same files."""
    resources = bundle / "Contents" / "Resources"
    for folder, install in (("kdenlive", install_kdenlive), ("shotcut", install_shotcut)):
        written = install(tmp_path / folder)
        assert written
        for file in written:
            assert (resources / file.relative_to(tmp_path)).read_bytes() == file.read_bytes()


def test_no_library_tells_where_it_was_built(bundle: Path, repo_root: Path) -> None:
    for path in bundle.rglob("*.ofx"):
        data = path.read_bytes()
        for text in (repo_root, Path.home()):
            assert str(text).encode() + b"/" not in data, f"{path}: {text}"


def test_the_archive_holds_the_bundle_and_has_no_times(bundle: Path) -> None:
    (archive,) = bundle.parent.glob("Palette4D-*.ofx.bundle.zip")
    files = {path for path in bundle.rglob("*") if path.is_file()}
    with zipfile.ZipFile(archive) as packed:
        entries = packed.infolist()
        assert [entry.filename for entry in entries] == sorted(
            path.relative_to(bundle.parent).as_posix() for path in files
        )
        for entry in entries:
            path = bundle.parent / entry.filename
            assert packed.read(entry) == path.read_bytes()
            assert entry.date_time == (1980, 1, 1, 0, 0, 0)
            assert entry.external_attr >> 16 == (0o100755 if path.suffix == ".ofx" else 0o100644)


def test_the_checksums_are_of_these_files(bundle: Path) -> None:
    lines = (bundle.parent / "SHA256SUMS-bundle").read_text(encoding="utf-8").splitlines()
    summed = {}
    for line in lines:
        digest, name = line.split("  ", 1)
        summed[name] = digest
        assert hashlib.sha256((bundle.parent / name).read_bytes()).hexdigest() == digest
    assert any(name.endswith(".zip") for name in summed)
    assert len([name for name in summed if name.endswith("Palette4D.ofx")]) == 4
