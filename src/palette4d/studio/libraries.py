"""The system's libraries that Qt needs, and the packages that have them.

Qt aborts without one of its platform's libraries and may name another one; without those of its
windows, the import fails and names the first. Here all are named at once.
"""

import ctypes
import importlib.util
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

#: How packages are installed in Debian and Ubuntu, Fedora and Rocky, and Arch.
INSTALLS = ("apt install", "dnf install", "pacman -S")
#: The package of each library in each of these. `tests/studio/test_libraries.py` compares it with
#: what Qt's files ask for.
PACKAGES = {
    "libEGL.so.1": ("libegl1", "libglvnd-egl", "libglvnd"),
    "libGL.so.1": ("libgl1", "libglvnd-glx", "libglvnd"),
    "libX11-xcb.so.1": ("libx11-xcb1", "libX11-xcb", "libx11"),
    "libX11.so.6": ("libx11-6", "libX11", "libx11"),
    "libbrotlicommon.so.1": ("libbrotli1", "libbrotli", "brotli"),
    "libbrotlidec.so.1": ("libbrotli1", "libbrotli", "brotli"),
    "libdbus-1.so.3": ("libdbus-1-3", "dbus-libs", "dbus"),
    "libfontconfig.so.1": ("libfontconfig1", "fontconfig", "fontconfig"),
    "libfreetype.so.6": ("libfreetype6", "freetype", "freetype2"),
    "libglib-2.0.so.0": ("libglib2.0-0", "glib2", "glib2"),
    "libgssapi_krb5.so.2": ("libgssapi-krb5-2", "krb5-libs", "krb5"),
    "libgthread-2.0.so.0": ("libglib2.0-0", "glib2", "glib2"),
    "libwayland-client.so.0": ("libwayland-client0", "libwayland-client", "wayland"),
    "libwayland-cursor.so.0": ("libwayland-cursor0", "libwayland-cursor", "wayland"),
    "libxcb-cursor.so.0": ("libxcb-cursor0", "xcb-util-cursor", "xcb-util-cursor"),
    "libxcb-icccm.so.4": ("libxcb-icccm4", "xcb-util-wm", "xcb-util-wm"),
    "libxcb-image.so.0": ("libxcb-image0", "xcb-util-image", "xcb-util-image"),
    "libxcb-keysyms.so.1": ("libxcb-keysyms1", "xcb-util-keysyms", "xcb-util-keysyms"),
    "libxcb-randr.so.0": ("libxcb-randr0", "libxcb", "libxcb"),
    "libxcb-render-util.so.0": (
        "libxcb-render-util0",
        "xcb-util-renderutil",
        "xcb-util-renderutil",
    ),
    "libxcb-render.so.0": ("libxcb-render0", "libxcb", "libxcb"),
    "libxcb-shape.so.0": ("libxcb-shape0", "libxcb", "libxcb"),
    "libxcb-shm.so.0": ("libxcb-shm0", "libxcb", "libxcb"),
    "libxcb-sync.so.1": ("libxcb-sync1", "libxcb", "libxcb"),
    "libxcb-util.so.1": ("libxcb-util1", "xcb-util", "xcb-util"),
    "libxcb-xfixes.so.0": ("libxcb-xfixes0", "libxcb", "libxcb"),
    "libxcb-xkb.so.1": ("libxcb-xkb1", "libxcb", "libxcb"),
    "libxcb.so.1": ("libxcb1", "libxcb", "libxcb"),
    "libxkbcommon-x11.so.0": ("libxkbcommon-x11-0", "libxkbcommon-x11", "libxkbcommon-x11"),
    "libxkbcommon.so.0": ("libxkbcommon0", "libxkbcommon", "libxkbcommon"),
    "libz.so.1": ("zlib1g", "zlib", "zlib"),
    "libzstd.so.1": ("libzstd1", "libzstd", "zstd"),
}
#: The files of PySide6's wheels that a window loads; the last one is its platform's.
WINDOWS = ("libQt6Core.so.6", "libQt6Gui.so.6", "libQt6Widgets.so.6", "libQt6Network.so.6")
PLATFORM = {"xcb": "libqxcb.so", "wayland": "libqwayland*.so", "offscreen": "libqoffscreen.so"}


def qt_files(platform: str) -> list[Path]:
    """Return Qt's files for a platform; none where the system's packages have Qt."""
    spec = importlib.util.find_spec("PySide6")
    for folder in [] if spec is None else spec.submodule_search_locations or []:
        qt = Path(folder, "Qt")
        plugins = sorted((qt / "plugins" / "platforms").glob(PLATFORM.get(platform, "-")))
        if plugins:
            return [*(qt / "lib" / name for name in WINDOWS), *plugins]
    return []


def platforms() -> list[str]:
    """Return the platforms that Qt can use here: any of them will do."""
    wanted = os.environ.get("QT_QPA_PLATFORM", "")
    if wanted:
        return [each.partition(":")[0].partition("-")[0] for each in wanted.split(";")]
    found = ["wayland"] if os.environ.get("WAYLAND_DISPLAY") else []
    return [*found, "xcb"] if os.environ.get("DISPLAY") or not found else found


def missing() -> list[str]:
    """Return the libraries that all platforms of now lack; [] if one of these works."""
    lacks = [_lacking(platform) for platform in platforms()]
    return min(lacks, key=len, default=[])


def _lacking(platform: str) -> list[str]:
    """Return what Qt's files for a platform lack."""
    # Only a file that does not load counts: versions of Qt differ in what they need.
    refused = [why for path in qt_files(platform) if (why := _refusal(path)) is not None]
    if not refused:
        return []
    skipped = {"xcb": "libwayland", "wayland": "libxcb"}.get(platform, "-")
    known = [name for name in PACKAGES if not name.startswith(skipped)]
    found = [name for name in known if _refusal(Path(name)) is not None]
    return found or [refused[0].partition(":")[0]]


def _refusal(library: Path) -> str | None:
    """Return why a library does not load, or None."""
    try:
        ctypes.CDLL(str(library))
    except OSError as error:
        return str(error)
    return None


def advice(lacking: Iterable[str]) -> str:
    """Return an error's text: these libraries, and the packages that have them."""
    lacking = list(lacking)
    return (
        f"found no {', '.join(lacking)}, expected {'it' if len(lacking) == 1 else 'them'} for "
        f"Qt's window. Run {', or '.join(_commands(lacking)) or 'your package manager'}"
    )


def _commands(lacking: Iterable[str]) -> Iterator[str]:
    known = [PACKAGES[name] for name in lacking if name in PACKAGES]
    for install, names in zip(INSTALLS, zip(*known, strict=True), strict=False):
        yield f"`{install} {' '.join(dict.fromkeys(names))}`"
