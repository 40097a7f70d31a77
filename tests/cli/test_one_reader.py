"""A verb reads a sidecar once and writes it once, by the core alone; what follows it is refused."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clip_files import write_image

import palette4d
from palette4d import _core
from palette4d.cli import main
from palette4d.grade import sidecar

#: Each verb that reads a sidecar, and how often it writes one; in this order each finds what it
#: needs in the file.
VERBS = {
    "edit S pick --frame 1 --pixel 12,3 --to '#ff8800'": 1,
    "edit S pick --frame 2 --pixel 12,3 --with p1": 1,
    "edit S hold --frame 0 --pixel 2,2": 1,
    "edit S area p1 --frame 1 --pixel 14,4": 1,
    "edit S change p1 --reach 1": 1,
    "edit S disable p1": 1,
    "edit S enable p1": 1,
    "edit S lock v1": 1,
    "edit S unlock v1": 1,
    "edit S picks": 0,
    "edit S picks --json": 0,
    "edit S version save one": 1,
    "edit S version list": 0,
    "edit S set v1 --rgb 0.1 0.2 0.3": 1,
    "edit S set --near 0.4 0.6 0.9 --frame 1 --by 0.1 0 0 --anyway": 1,
    "edit S track v1 --hue 20": 1,
    "edit S palette --lightness 1.1": 1,
    "edit S move v1 --by 0.1 0 0": 1,
    "edit S ramp smooth": 1,
    "edit S reset v1": 1,
    "edit S version use one": 1,
    "edit S undo": 1,
    "edit S redo": 1,
    "edit S history": 0,
    "edit S unpick p1": 1,
    "edit S reset": 1,
    "info S": 0,
    "slice S --frame 1": 0,
    "plot S -o plot.svg --force": 0,
    "render S clip -o out/frame.####.png --force": 0,
    "bake S --frame 1 -o look.cube --force": 0,
    "bake S --frame 1 -o look.cube --force --version one": 0,
    "edit S version remove one": 1,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with clip/, three frames of a red square before a sky, and its sidecar."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "clip").mkdir()
    for frame in range(3):
        pixels = np.empty((16, 24, 3), np.uint8)
        pixels[:] = (100, 150, 230)
        pixels[8:] = (50 + 20 * frame, 150, 50)
        pixels[2:6, 10 + frame : 16 + frame] = (180, 40, 25)
        write_image(folder / "clip" / f"clip.{frame:04d}.png", pixels)
    document = palette4d.analyze(str(folder / "clip"))
    document.save_version("one")
    document.save(folder / "clip.p4d.json")
    return folder


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How often the text of a sidecar is read and written."""
    found = {"read": 0, "written": 0}

    def count(owner: Any, name: str, kind: str, counts: Callable[[Any], bool]) -> None:
        real = getattr(owner, name)

        def counted(first: Any, *args: Any, **named: Any) -> Any:
            found[kind] += counts(first)
            return real(first, *args, **named)

        monkeypatch.setattr(owner, name, counted)

    for name in ("parse_sidecar", "read_sidecar", "decode_sidecar"):
        count(_core, name, "read", lambda _: True)
    count(json, "loads", "read", lambda text: "palette4d.sidecar" in str(text))
    count(sidecar, "write", "written", lambda _: True)
    return found


def test_a_verb_reads_once_and_writes_once(
    folder: Path, counts: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    path = Path("edited.p4d.json")
    path.write_bytes(Path("clip.p4d.json").read_bytes())
    for words, writes in VERBS.items():
        counts |= {"read": 0, "written": 0}
        assert main.main([path.name if w == "S" else w for w in shlex.split(words)]) == 0, words
        assert counts == {"read": 1, "written": writes}, words


@pytest.mark.parametrize("after", ["\0", "\0\0x", "x", "{}", "\n\n]"])
def test_what_follows_the_sidecar_is_refused(
    folder: Path, after: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "more.p4d.json"
    path.write_text((folder / "clip.p4d.json").read_text("utf-8") + after, "utf-8")
    before = path.read_bytes()
    for verb in (
        "edit S set v1 --rgb 0.1 0.2 0.3",
        "edit S picks",
        "edit S undo",
        "info S",
        "slice S --frame 1",
        f"plot S -o {folder / 'none.svg'}",
        f"render S {folder / 'clip'} -o {folder / 'none.####.png'}",
        f"bake S --frame 1 -o {folder / 'none.cube'}",
        f"export S --every 1 -o {folder / 'none'}",
        f"config S --every 1 -o {folder / 'none'}",
    ):
        words = [str(path) if w == "S" else w for w in shlex.split(verb)]
        try:
            assert main.main(words) == 1, verb
        except SystemExit as end:
            raise AssertionError(f"{verb}: wrong usage") from end
        error = capsys.readouterr().err
        assert "JSON text (RFC 8259)" in error, verb
        assert str(path) in error, verb
        assert path.read_bytes() == before
    assert not list(folder.glob("none*"))
