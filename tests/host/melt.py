"""Brings melt (MLT, the engine of Kdenlive and Shotcut), a real OpenFX host, to this machine.

Debian's packages are fetched with apt from the mirror that this machine uses already, unpacked
into a folder of their own and run with their own loader and libraries: nothing is installed, and
the machine need not be of the same Debian release. As a script: ``python melt.py [FOLDER]``.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SUITE = "forky"  # the first release whose MLT (7.36 and later) has the openfx module
MODULES = ("core", "openfx", "avformat", "xml", "normalize")
#: What those modules load, by the beginning of the package names that libmlt7 itself asks for.
LIBRARIES = (
    "libc6|libav(codec|device|filter|format|util)|libswresample|libswscale|libglib2|libgomp"
    "|libsdl2-2|libxml2|libgcc-s1|libstdc"
)
KEYRING = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
_COMPLETE = ".complete"


class MeltUnavailableError(Exception):
    """melt cannot be had on this machine; the text says why."""


def cache_folder() -> Path:
    """Where melt lies between runs: $PALETTE4D_CACHE/melt, else .cache/melt in the repository."""
    cache = os.environ.get("PALETTE4D_CACHE")
    return (Path(cache) if cache else Path(__file__).resolve().parents[2] / ".cache") / "melt"


def bring_melt(folder: Path | None = None) -> Path:
    """Return the program melt, fetched into `folder` unless it is there already.

    Raises
    ------
    MeltUnavailableError
        Without apt, a Debian mirror, a network, or with packages that do not run here.
    """
    folder = folder or cache_folder()
    melt = folder / "bin" / "melt"
    if (folder / _COMPLETE).exists():
        return melt
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        raise MeltUnavailableError("melt's packages are fetched for Linux on x86-64 only")
    for tool in ("apt-get", "apt-cache", "dpkg-deb", "tar", "objdump"):
        if not shutil.which(tool):
            raise MeltUnavailableError(f"{tool} is not on this machine")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="melt-", dir=folder.parent) as name:
        work = Path(name)
        root = work / "unpacked"
        root.mkdir()
        for package in _download(work / "apt"):
            _unpack(package, root)
        tree = work / "tree"
        _assemble(root, tree)
        _run([tree / "bin" / "melt", "--version"])
        (tree / _COMPLETE).touch()
        if folder.exists():
            shutil.rmtree(folder)
        tree.rename(folder)
    return melt


def _run(command: list[str | Path], **environment: str) -> str:
    """Run a program; its output, or the reason why it failed."""
    done = subprocess.run(
        [str(word) for word in command],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        env={**os.environ, **environment},
        check=False,
    )
    if done.returncode != 0:
        words = " ".join((done.stderr or done.stdout).split())[-400:]
        raise MeltUnavailableError(f"{Path(command[0]).name} failed: {words}")
    return done.stdout


def _mirror() -> str:
    """Return the address this machine's apt takes Debian itself from."""
    listing = _run(
        ["apt-get", "indextargets", "--format", "$(REPO_URI)", "Created-By: Packages"]
    ).split()
    for address in listing:
        if re.search(r"/debian/?$", address):
            return address
    raise MeltUnavailableError("apt on this machine knows no Debian mirror")


def _download(apt: Path) -> list[Path]:
    """Fetch melt's packages with an apt of its own configuration: no root, nothing installed."""
    for part in ("parts", "state/lists/partial", "cache/archives/partial"):
        (apt / part).mkdir(parents=True)
    (apt / "status").touch()
    if not KEYRING.exists():
        raise MeltUnavailableError(f"{KEYRING} is missing (package debian-archive-keyring)")
    (apt / "sources.list").write_text(f"deb [signed-by={KEYRING}] {_mirror()} {SUITE} main\n")
    settings = {
        "Dir::Etc": apt,
        "Dir::Etc::SourceList": apt / "sources.list",
        "Dir::Etc::SourceParts": "/dev/null",
        "Dir::Etc::Parts": apt / "parts",
        "Dir::Etc::Preferences": "/dev/null",
        "Dir::Etc::PreferencesParts": "/dev/null",
        "Dir::State": apt / "state",
        "Dir::State::status": apt / "status",
        "Dir::Cache": apt / "cache",
        "APT::Architecture": "amd64",
        "APT::Install-Recommends": "false",
        "APT::Sandbox::User": "root",
        "Acquire::Languages": "none",
        "Acquire::Retries": "3",
        # A mirror or a clock that is some weeks off does no harm here; signatures are checked.
        "Acquire::Check-Valid-Until": "false",
        "Acquire::IndexTargets::deb::Contents-deb::DefaultEnabled": "false",
    }
    lines = [f'{key} "{value}";' for key, value in settings.items()]
    # Cleared first: the list would otherwise keep the machine's own foreign architectures.
    lines += ["#clear APT::Architectures;", 'APT::Architectures { "amd64"; };']
    (apt / "apt.conf").write_text("\n".join(lines) + "\n")
    config = {"APT_CONFIG": str(apt / "apt.conf")}
    _run(["apt-get", "-qq", "update"], **config)
    record = _run(["apt-cache", "show", "--no-all-versions", "libmlt7"], **config)
    depends = re.search(r"^Depends: (.*)$", record, re.MULTILINE)
    if not depends:
        raise MeltUnavailableError(f"Debian {SUITE} on this mirror has no package libmlt7")
    names = [re.split(r"[ |(]", entry.strip())[0] for entry in depends[1].split(",")]
    libraries = [name for name in names if re.match(LIBRARIES, name)]
    _run(["apt-get", "-qq", "-y", "--download-only", "install", *libraries], **config)
    archives = apt / "cache" / "archives"
    # MLT's other dependencies (desktop libraries) belong to modules that are left out.
    done = subprocess.run(
        ["apt-get", "-qq", "download", "melt", "libmlt7", "libmlt-data"],
        cwd=archives,
        env={**os.environ, **config},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise MeltUnavailableError(f"apt-get download failed: {done.stderr[-400:]}")
    return sorted(archives.glob("*.deb"))


def _unpack(package: Path, root: Path) -> None:
    """Unpack a package's files; /bin, /lib, … are links into /usr as on an installed Debian."""
    for name in ("bin", "sbin", "lib", "lib64"):
        (root / "usr" / name).mkdir(parents=True, exist_ok=True)
        if not (root / name).is_symlink():
            (root / name).symlink_to(f"usr/{name}")
    skipped = [f"--exclude=./usr/share/{name}" for name in ("doc", "man", "locale", "icons")]
    with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", package], stdout=subprocess.PIPE) as deb:
        tar = subprocess.run(
            ["tar", "-x", "-C", root, "--no-same-owner", "--keep-directory-symlink", *skipped],
            stdin=deb.stdout,
            check=False,
        )
    if tar.returncode != 0 or deb.returncode != 0:
        raise MeltUnavailableError(f"{package.name} could not be unpacked")


def _assemble(root: Path, tree: Path) -> None:
    """Lay out melt, the wanted modules and just the libraries they load."""
    libraries = root / "usr/lib/x86_64-linux-gnu"
    (tree / "bin").mkdir(parents=True)
    (tree / "share").mkdir()
    modules = tree / "lib" / "mlt-7"
    modules.mkdir(parents=True)
    for name in MODULES:
        module = libraries / "mlt-7" / f"libmlt{name}.so"
        if module.exists():
            shutil.copy2(module, modules)
    if not (modules / "libmltopenfx.so").exists():
        raise MeltUnavailableError(f"MLT of Debian {SUITE} has no openfx module here")
    shutil.copytree(root / "usr/share/mlt-7", tree / "share" / "mlt-7", symlinks=True)
    shutil.copy2(root / "usr/bin/melt", tree / "bin" / "melt.real")
    shutil.copy2((root / "lib64/ld-linux-x86-64.so.2").resolve(), tree / "lib" / "ld.so")

    todo = [tree / "bin" / "melt.real", *modules.iterdir()]
    # SDL2 is a shim that loads SDL3 by name when it starts.
    wanted = {"libSDL3.so.0"}
    done: set[str] = set()
    while todo or wanted - done:
        for name in sorted(wanted - done):
            done.add(name)
            found = next(
                (p for p in (libraries, *_folders(libraries)) if (p / name).exists()), None
            )
            if found:
                target = tree / "lib" / name
                shutil.copy2((found / name).resolve(), target)
                todo.append(target)
        if todo:
            headers = _run(["objdump", "-p", *todo])
            wanted |= set(re.findall(r"NEEDED\s+(\S+)", headers))
            todo = []
    wrapper = tree / "bin" / "melt"
    wrapper.write_text(
        "#!/bin/sh\n"
        'root=$(cd "$(dirname "$0")/.." && pwd)\n'
        'export MLT_REPOSITORY="$root/lib/mlt-7" MLT_DATA="$root/share/mlt-7"\n'
        'export MLT_PROFILES_PATH="$root/share/mlt-7/profiles"\n'
        'export MLT_PRESETS_PATH="$root/share/mlt-7/presets"\n'
        'exec "$root/lib/ld.so" --library-path "$root/lib" "$root/bin/melt.real" "$@"\n'
    )
    wrapper.chmod(0o755)


def _folders(libraries: Path) -> list[Path]:
    """Folders below that hold libraries of their own (pulseaudio, …)."""
    return [path for path in libraries.iterdir() if path.is_dir() and path.name != "mlt-7"]


if __name__ == "__main__":
    try:
        print(bring_melt(Path(sys.argv[1]) if len(sys.argv) > 1 else None))
    except MeltUnavailableError as error:
        sys.exit(f"melt.py: {error}")
