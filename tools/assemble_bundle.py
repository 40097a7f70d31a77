"""`make bundles`: one bundle of the libraries for every system, its archive and their checksums.

    python tools/assemble_bundle.py BUILDS OUT

BUILDS holds the build folders of the release presets (`ofx_plugin/CMakePresets.json`). OUT gets
Palette4D.ofx.bundle, Palette4D-VERSION.ofx.bundle.zip and SHA256SUMS-bundle. The same libraries
give the same bytes: the archive is sorted and has no times. Runs in the environment of ziglang and
nlohmann-json, whose licences go into the bundle. So do the files for Kdenlive and Shotcut.
"""

from __future__ import annotations

import argparse
import hashlib
import plistlib
import shutil
import struct
import sys
import types
import zipfile
from importlib import metadata
from pathlib import Path

BUNDLE = "Palette4D.ofx.bundle"
LIBRARIES = {
    "Linux-x86-64": ["linux-x86_64"],
    "Linux-aarch64": ["linux-aarch64"],
    "Win64": ["windows"],
    "MacOS": ["macos-x86_64", "macos-arm64"],
}
"""The folders in the bundle, and the presets that build the library there."""
FAT_MAGIC = 0xCAFEBABE
PAGE_BITS = 14
"""macOS maps each part of a universal file at a page of arm64, 16 KiB."""


def universal(parts: list[bytes]) -> bytes:
    """Return one Mach-O file of several, each for a processor (<mach-o/fat.h>)."""
    page = 1 << PAGE_BITS
    header = struct.pack(">II", FAT_MAGIC, len(parts))
    body = b""
    for part in parts:
        processor = struct.unpack_from("<II", part, 4)
        body += bytes(-len(body) % page)
        header += struct.pack(">IIIII", *processor, page + len(body), len(part), PAGE_BITS)
        body += part
    return header.ljust(page, b"\0") + body


def licences() -> dict[str, Path]:
    """Return the licences of all that is in the libraries."""
    zig = Path(str(metadata.distribution("ziglang").locate_file("ziglang")))
    files = metadata.files("nlohmann-json") or []
    (json,) = (Path(str(file.locate())) for file in files if file.name == "LICENSE")
    return {
        "palette4d": Path(__file__).parent.parent / "LICENSE",
        "nlohmann-json": json,
        "zig": zig / "LICENSE",
        "llvm": zig / "lib" / "libcxx" / "LICENSE.TXT",
        "mingw-w64": zig / "lib" / "libc" / "mingw" / "COPYING",
    }


def editors_files(version: str) -> dict[str, str]:
    """Return the files of editing programs, by their paths in the bundle's resources."""
    # palette4d is not installed here, and these parts of it need nothing of the rest.
    package = types.ModuleType("palette4d")
    package.__path__ = [str(Path(__file__).parent.parent / "src" / "palette4d")]
    sys.modules["palette4d"] = package
    from palette4d.hosts import kdenlive, shotcut

    files = {f"kdenlive/{kdenlive.FILE}": kdenlive.effect_file(version)}
    for name, text in shotcut.filter_files(version).items():
        files[f"shotcut/{shotcut.FOLDER}/{name}"] = text
    return files


def assemble(builds: Path, bundle: Path) -> None:
    """Lay out the bundle from the build folders; a library that is missing is an error."""
    shutil.rmtree(bundle, ignore_errors=True)
    built = {
        preset: builds / preset / "node" / BUNDLE / "Contents" / folder
        for folder, presets in LIBRARIES.items()
        for preset in presets
    }
    for folder, presets in LIBRARIES.items():
        parts = [(built[preset] / "Palette4D.ofx").read_bytes() for preset in presets]
        library = bundle / "Contents" / folder / "Palette4D.ofx"
        library.parent.mkdir(parents=True)
        library.write_bytes(parts[0] if len(parts) == 1 else universal(parts))
        library.chmod(0o755)
    shutil.copyfile(built["macos-arm64"].parent / "Info.plist", bundle / "Contents" / "Info.plist")
    resources = bundle / "Contents" / "Resources" / "licences"
    resources.mkdir(parents=True)
    for name, file in licences().items():
        shutil.copyfile(file, resources / f"{name}.txt")
    for name, text in editors_files(version_of(bundle)).items():
        path = resources.parent / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def version_of(bundle: Path) -> str:
    """Return the version that Info.plist says."""
    about = plistlib.loads((bundle / "Contents" / "Info.plist").read_bytes())
    return str(about["CFBundleShortVersionString"])


def pack(bundle: Path, archive: Path) -> None:
    """Write a zip of the bundle, sorted and without times; links stay links."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for file in sorted(p for p in bundle.rglob("*") if p.is_symlink() or p.is_file()):
            entry = zipfile.ZipInfo(file.relative_to(bundle.parent).as_posix())
            entry.create_system = 3  # whose permissions follow
            runs = file.suffix == ".ofx" or file.parent.name == "MacOS"
            linked = file.is_symlink()
            entry.external_attr = (0o120755 if linked else 0o100755 if runs else 0o100644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(entry, str(file.readlink()) if linked else file.read_bytes())


def main() -> None:
    """Assemble, pack and sum up what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("builds", type=Path)
    parser.add_argument("out", type=Path)
    arguments = parser.parse_args()
    out: Path = arguments.out
    bundle = out / BUNDLE
    assemble(arguments.builds, bundle)
    archive = out / f"Palette4D-{version_of(bundle)}.ofx.bundle.zip"
    pack(bundle, archive)
    files = [archive, *sorted(path for path in bundle.rglob("*") if path.is_file())]
    lines = [
        f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.relative_to(out).as_posix()}\n"
        for file in files
    ]
    (out / "SHA256SUMS-bundle").write_text("".join(lines), encoding="utf-8")
    print("".join(lines), end="")


if __name__ == "__main__":
    main()
