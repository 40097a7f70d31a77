"""Names from files do not act on the terminal, whichever verb prints them."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import PyOpenColorIO as ocio
import pytest

from palette4d.cli.main import main
from palette4d.cli.progress import frames_bar

EDITED = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"
PICKS = EDITED.with_name("v2_picks.p4d.json")

#: Forges a line and a patch of colour, overwrites a line, sets the window's title, clears the
#: screen, turns the writing around.
FORGED = "palette4d: error: forged"
HOSTILE = f"\n{FORGED}\n\x1b[48;2;1;2;3m  \x1b[0m " + (
    "\r\x1b[Aa\u200eb\u061c\x1b]0;owned\x07\x1b[2J\rb\x9b31m\u202ec\u2066d"
)


@pytest.fixture
def hostile(tmp_path: Path) -> str:
    document: dict[str, Any] = json.loads(EDITED.read_text(encoding="utf-8"))
    clip = document["clip"]
    clip["name"] = clip["source"] = clip["encoding"] = document["generator"] = HOSTILE
    document["quality"]["stages"] = [{"stage": HOSTILE, HOSTILE: HOSTILE}]
    path = tmp_path / "hostile.p4d.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    "arguments",
    [
        ["info"],
        ["info", "--handles", "--quality"],
        ["info", "--json"],
        ["slice", "--frame", "3"],
        ["bake", "--frame", "3", "-o", "out.cube"],
        ["bake", "--frame", "99", "-o", "out.cube"],
        ["export", "--frames", "3", "-o", "out"],
        ["edit", "reset", HOSTILE],
        ["render", f"gone\n{FORGED}.\x1b[2J.exr", "-o", "out.exr"],
    ],
    ids=" ".join,
)
def test_what_is_printed_is_printable(
    hostile: str,
    arguments: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    main([arguments[0], hostile, *arguments[1:]])
    printed = "".join(capsys.readouterr())
    assert printed
    assert all(c == "\n" or (c.isprintable() and c not in "\u202e\u2066") for c in printed)
    assert not any(line.startswith(FORGED) for line in printed.splitlines())


def test_a_name_in_a_progress_bar_is_printable(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with frames_bar("shots", hidden=False) as show:
        show(1, 2, HOSTILE)
    printed = capsys.readouterr().err
    assert r"\u001b[2J" in printed
    assert all(c.isprintable() for c in printed.replace("\r", "").replace("\n", ""))


@pytest.mark.parametrize("words", ["history", "version list", "undo"])
def test_steps_and_notes_begin_no_line(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document: dict[str, Any] = json.loads(PICKS.read_text(encoding="utf-8"))
    document["history"]["done"][-1]["step"] = document["versions"][0]["note"] = f"a\n{FORGED}"
    path = tmp_path / "hostile.p4d.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    assert main(["edit", str(path), *words.split()]) == 0
    printed = capsys.readouterr().out
    assert FORGED in printed
    assert not any(line.startswith(FORGED) for line in printed.splitlines())


def test_a_colour_space_begins_no_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    config = ocio.Config.CreateFromBuiltinConfig("ocio://default")
    config.addColorSpace(ocio.ColorSpace(name=f"a\n{FORGED}"))
    Path("config.ocio").write_text(config.serialize(), encoding="utf-8")
    document: dict[str, Any] = json.loads(EDITED.read_text(encoding="utf-8"))
    document["clip"]["encoding"] = f"a\n{FORGED}"
    Path("hostile.p4d.json").write_text(json.dumps(document), encoding="utf-8")
    words = ["bake", "hostile.p4d.json", "--frame", "3", "-o", "o.cube", "--space", "ACEScct"]
    assert main([*words, "--ocio-config", "config.ocio"]) == 0
    printed = "".join(capsys.readouterr())
    assert FORGED in printed
    assert not any(line.startswith(FORGED) for line in printed.splitlines())


def test_a_fault_of_the_program_does_not_let_a_name_through() -> None:
    program = (
        "import sys\n"
        "from palette4d.cli import info, main\n"
        "def broken(*_): raise RuntimeError('a name \\x1b]0;owned\\x07')\n"
        "info.run = broken\n"
        "sys.argv = ['palette4d', 'info', 'x.p4d.json']\n"
        "sys.exit(main.main())\n"
    )
    command = [sys.executable, "-P", "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "RuntimeError: a name \\u001b]0;owned\\u0007" in done.stderr
    assert "\x1b" not in done.stderr


@pytest.mark.parametrize("encoding", ["latin-1", "ascii"])
def test_a_terminal_that_lacks_characters_shows_their_numbers(encoding: str) -> None:
    golden = str(EDITED)
    done = subprocess.run(
        [sys.executable, "-m", "palette4d", "info", golden],
        env={**os.environ, "PYTHONIOENCODING": encoding},
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr
    # Windows' pipes are UTF-8.
    assert ("…".encode() if sys.platform == "win32" else b"\\u2026") in done.stdout
