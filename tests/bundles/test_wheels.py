"""Every wheel of `make wheels`: its tags, its module's imports and exports, and the bundle inside.

Those for Linux are installed where no compiler is, and run the demo. The modules for Windows and
macOS are only read.
"""

from __future__ import annotations

import os
import re
import subprocess
import zipfile
from pathlib import Path

import lief
import pytest

FOLDER = Path(os.environ.get("PALETTE4D_WHEELS", ""))
WHEELS = sorted(FOLDER.glob("*.whl"))
PLATFORMS = {
    "manylinux_2_28_x86_64": ".cpython-{}-x86_64-linux-gnu.so",
    "win_amd64": ".cp{}-win_amd64.pyd",
    "macosx_11_0_arm64": ".cpython-{}-darwin.so",
}
WINDOWS_LIBRARY = re.compile(r"(kernel32|api-ms-win-crt-[a-z]+-l1-1-0)\.dll")
C_LIBRARY = re.compile(r"(libc|libm|libpthread|libdl|ld-linux-x86-64)\.so\.\d+")


def named(wheel: Path) -> tuple[str, str]:
    """The version of Python, as 311, and the platform of a wheel."""
    _, _, python, abi, platform = wheel.stem.split("-")
    assert python == abi
    return python.removeprefix("cp"), platform


def of(platform: str) -> list[Path]:
    return [wheel for wheel in WHEELS if named(wheel)[1] == platform]


def module(wheel: Path) -> bytes:
    version, platform = named(wheel)
    with zipfile.ZipFile(wheel) as packed:
        return packed.read("palette4d/_core" + PLATFORMS[platform].format(version))


def python_exports(version: str) -> set[str]:
    """What the Python of Windows exports, or the one that runs here, if it is of that version."""
    folder = FOLDER.parent / f"python3.{version[1:]}-windows"
    pe = lief.PE.parse(folder / f"python{version}.dll")
    assert pe is not None
    return {str(entry.name) for entry in pe.get_export().entries}


def test_every_version_has_a_wheel_for_every_system() -> None:
    versions = {named(wheel)[0] for wheel in WHEELS}
    assert versions
    assert {named(wheel) for wheel in WHEELS} == {(v, p) for v in versions for p in PLATFORMS}


@pytest.mark.parametrize("wheel", WHEELS, ids=lambda wheel: wheel.name)
def test_it_says_its_tag_and_holds_one_module_and_the_bundle(wheel: Path, bundle: Path) -> None:
    version, platform = named(wheel)
    with zipfile.ZipFile(wheel) as packed:
        # auditwheel gives folders a name of their own.
        names = [name for name in packed.namelist() if not name.endswith("/")]
        (about,) = (name for name in names if name.endswith(".dist-info/WHEEL"))
        tags = re.findall(r"(?m)^Tag: (.*)$", packed.read(about).decode())
        assert tags == [f"cp{version}-cp{version}-{platform}"]
        compiled = [name for name in names if re.search(r"\.(so|pyd|dll|dylib|lib)$", name)]
        assert compiled == ["palette4d/_core" + PLATFORMS[platform].format(version)]
        (bill,) = (name for name in names if name.endswith("/sboms/palette4d.cdx.json"))
        assert b'"libc++"' in packed.read(bill)
        inside = f"palette4d/_ofx/{bundle.name}/"
        files = {path.relative_to(bundle).as_posix(): path for path in bundle.rglob("*")}
        files = {name: path for name, path in files.items() if path.is_file()}
        assert {name.removeprefix(inside) for name in names if name.startswith(inside)} == {*files}
        for name, path in files.items():
            assert packed.read(inside + name) == path.read_bytes()


@pytest.mark.parametrize("wheel", of("manylinux_2_28_x86_64"), ids=lambda wheel: wheel.name)
def test_linux_module(wheel: Path) -> None:
    elf = lief.ELF.parse(list(module(wheel)))
    assert elf is not None
    assert [name for name in elf.libraries if not C_LIBRARY.fullmatch(str(name))] == []
    assert "PyInit__core" in {symbol.name for symbol in elf.exported_symbols}


@pytest.mark.parametrize("wheel", of("win_amd64"), ids=lambda wheel: wheel.name)
def test_windows_module(wheel: Path) -> None:
    """Python's DLL has each name that is asked of it; the rest is of Windows 10."""
    version, _ = named(wheel)
    pe = lief.PE.parse(list(module(wheel)))
    assert pe is not None
    assert pe.header.machine == lief.PE.Header.MACHINE_TYPES.AMD64
    assert "PyInit__core" in {entry.name for entry in pe.get_export().entries}
    wanted = {
        str(used.name).lower(): {str(entry.name) for entry in used.entries} for used in pe.imports
    }
    python = wanted.pop(f"python{version}.dll")
    assert python - python_exports(version) == set()
    assert [name for name in wanted if not WINDOWS_LIBRARY.fullmatch(name)] == []
    flags = lief.PE.OptionalHeader.DLL_CHARACTERISTICS
    for flag in (flags.DYNAMIC_BASE, flags.HIGH_ENTROPY_VA, flags.NX_COMPAT):
        assert pe.optional_header.has(flag)
    assert [type(entry) for entry in pe.debug] == [lief.PE.Repro]


@pytest.mark.parametrize("wheel", of("macosx_11_0_arm64"), ids=lambda wheel: wheel.name)
def test_macos_module(wheel: Path) -> None:
    """Needs libSystem and Python alone. All it asks of Python stands in Windows' Python too."""
    version, _ = named(wheel)
    parsed = lief.MachO.parse(list(module(wheel)))
    assert parsed is not None
    (part,) = parsed
    assert part.header.cpu_type.name == "ARM64"
    assert part.build_version.platform == lief.MachO.BuildVersion.PLATFORMS.MACOS
    assert part.build_version.minos == [11, 0, 0]
    assert part.has_code_signature
    assert "_PyInit__core" in {symbol.name for symbol in part.exported_symbols}
    loads = lief.MachO.LoadCommand.TYPE.LOAD_DYLIB
    used = [str(library.name) for library in part.libraries if library.command == loads]
    assert used == ["/usr/lib/libSystem.B.dylib"]
    names = {str(symbol.name).removeprefix("_") for symbol in part.imported_symbols}
    looked_up = {name for name in names if re.match("_?Py", name)}
    assert looked_up
    assert looked_up - python_exports(version) == set()


@pytest.mark.parametrize("wheel", of("manylinux_2_28_x86_64"), ids=lambda wheel: wheel.name)
def test_the_demo_runs_in_a_bare_environment(
    wheel: Path, bundle: Path, tmp_path: Path, repo_root: Path
) -> None:
    version, _ = named(wheel)
    found = subprocess.run(
        [repo_root / "tools" / "find_python.sh", f"python3.{version[1:]}"],
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    programs = tmp_path / "env" / "bin"
    bare = {**os.environ, "CC": "/nonexistent", "CXX": "/nonexistent"}

    def run(*words: str | Path) -> None:
        subprocess.run(words, env=bare, check=True, cwd=tmp_path)

    run(found.stdout.strip(), "-m", "venv", tmp_path / "env")
    run(programs / "python", "-m", "pip", "-q", "install", "--only-binary", ":all:", wheel)
    run(programs / "python", repo_root / "tools" / "demo.py", tmp_path / "demo")
    run(programs / "palette4d", "install-plugin", "--dest", tmp_path / "OFX")
    for path in bundle.rglob("*"):
        if path.is_file():
            copy = tmp_path / "OFX" / bundle.name / path.relative_to(bundle)
            assert copy.read_bytes() == path.read_bytes()
