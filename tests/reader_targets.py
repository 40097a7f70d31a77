"""What the readers and verbs do with any bytes: the targets of tests/fuzz/test_readers.py.

Each takes a file and a folder for what it writes. It returns "accepted" or "refused"; every other
error than `Palette4dError` is a fault. `many` gives them mutations of tests/fuzz/readers/.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import io
import json
import os
import random
import time
import traceback
from pathlib import Path
from typing import Any
from unittest import mock

import PyOpenColorIO as ocio
from palette4d.lut_export import cdl, series_index
from palette4d.lut_export.series import Series
from palette4d.lut_export.writers import Description

import palette4d
from palette4d import _core
from palette4d.cli import export
from palette4d.cli.main import build_parser, main
from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.shows import manifest as manifests
from palette4d.shows import timeline_clips, timeline_shots
from palette4d.shows.shots import numbered

CORPORA = Path(__file__).parent / "fuzz/readers"
GOLDEN = Path(__file__).parent / "golden/sidecars"
SIDECARS = [GOLDEN / f"{name}.p4d.json" for name in ("v1_edited", "v1_split", "v2_picks")]
TOKENS = (
    *(b"{", b"}", b"[", b"]", b",", b":", b'"', b"null", b"true", b"[]", b"{}", b'""', b"-", b"\0"),
    *(b"1e999", b"-1e308", b"0.5", b"NaN", b"9" * 400, b"2147483648", b"\\ud800", b"\\u0000"),
    *(b"\xff", b"\xef\xbb\xbf", b"\x1b[2J", b"[" * 80, b"../", b"\r\n", b"00:00:00:00", b"<&\"'>"),
)
RAW = ocio.Config.CreateRaw()
VALUES: tuple[Any, ...] = (
    *(None, True, 0, -1, 0.5, 2**31, 10**30, -(10**400), 1e308, "", "a", "../x", "\0", "x" * 400),
    *([], {}, [1], [[]], {"a": 1}, "\ud800", ["a", "b"], [24, 0], [1e300, 1], ["1e9999999"]),
)


def manifest(path: Path, folder: Path) -> str:
    """Read a manifest; one that is accepted is written and read back."""
    try:
        found = manifests.read(path)
    except Palette4dError:
        return "refused"
    copy = folder / "copy.shots.json"
    manifests.write(found, copy)
    assert manifests.read(copy) == found
    with contextlib.suppress(Palette4dError):
        manifests.sidecars(path)
    return "accepted"


def index(path: Path, folder: Path) -> str:
    """Read the index of a series; one that is accepted is reported and written."""
    header = json.loads((CORPORA / "index/two.json").read_text("utf-8"))
    del header["frames"]
    try:
        entries = series_index.read_index(path, header, force=False)
    except Palette4dError:
        return "refused"
    document = series_index.document_of(header, entries)
    done = Series(path, document, [], sorted(entries), {})
    with contextlib.redirect_stderr(io.StringIO()):
        export.report(done)
        export.warn(argparse.Namespace(parser=build_parser("export")), [done])
    series_index.write_index(folder / "copy.json", header, entries)
    return "accepted"


def correction(path: Path, folder: Path) -> str:
    """Write a CDL whose texts are the bytes; OpenColorIO must read its numbers back.

    The length of the bytes chooses the format.
    """
    text = path.read_bytes().decode("utf-8", "ignore")
    about = Description("urn:x", text, (text,), text)
    written = cdl.Cdl((1.5, 1.0, 1.0), saturation=0.5)
    ocio.ClearAllCaches()  # of earlier files of these names
    name = ("cc", "ccc", "cdl")[len(text) % 3]
    file = folder / f"x.{name}"
    file.write_text(cdl.write(written, name, text, about), "utf-8", newline="\n")
    transform: Any = ocio.FileTransform(src=str(file), cccId="0")
    processor = RAW.getProcessor(transform)
    assert processor.createGroupTransform()[0].getSat() == 0.5
    return "accepted"


def unopened(*_: object) -> None:
    raise Palette4dError("media are not opened here, where no child process can start")


def edit(path: Path, folder: Path) -> str:
    """Read a timeline and its shots; return a fault as its traceback."""
    try:
        with mock.patch.object(timeline_shots.Child, "call", unopened):
            numbered(timeline_shots.shots_of(timeline_clips.clips_of(path))[0])
    except Palette4dError:
        return "refused"
    except Exception:
        return traceback.format_exc()
    return "accepted"


#: What a sidecar is given to: the verbs that read one, without those that decode or take seconds.
VERBS = (
    *(("info", "S", "--json"), ("slice", "S", "--frame", "1"), ("edit", "S", "history")),
    *(("edit", "S", "picks", "--json"), ("edit", "S", "set", "v1", "--rgb", "0.1", "0.2", "0.3")),
    *(("edit", "S", "ramp", "smooth"), ("edit", "S", "version", "save", "one")),
    *(("edit", "S", "reset"), ("edit", "S", "undo"), ("edit", "S", "redo")),
    *(("edit", "S", "track", "v1", "--hue", "20"), ("edit", "S", "version", "list")),
)


def verbs(path: Path, folder: Path) -> str:
    """Give a sidecar to the core's reader, to `palette4d.load` and to the verbs.

    All accept it or none does. The steps of the history are for `palette4d.load` alone: the core
    skips them, so that a node draws a grade whose steps are damaged. Who refuses a sidecar changes
    nothing; who accepts it keeps its `extra`, where other programs write.
    """
    before = path.read_bytes()
    try:
        _core.read_sidecar(str(path))
        accepted = True
    except SidecarError:
        accepted = False
    try:
        palette4d.load(path)
        loaded = True
    except SidecarError as error:
        loaded = accepted and "remove the member `history`" in error.expected
    assert loaded == accepted, "palette4d.load and the core do not agree"
    for words in VERBS:
        output = io.StringIO()
        given = [str(path) if word == "S" else word for word in words]
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            status = main(given)
        assert status in ((0, 1) if accepted else (1,)), (words, status)
        if status == 1:
            assert "palette4d: error: " in output.getvalue(), words
            assert path.read_bytes() == before, words
        else:
            after = path.read_bytes()
            assert json.loads(after).get("extra") == json.loads(before).get("extra"), words
            _core.read_sidecar(str(path))
            before = after
    return "accepted" if accepted else "refused"


TARGETS = {
    "verbs": verbs,
    "manifest": manifest,
    "index": index,
    "correction": correction,
    "otio": edit,
    "edl": edit,
}


def many(kind: str, seed: str, first: int, count: int, folder: Path) -> dict[str, int]:
    """Give a target the inputs of these numbers; return how many were accepted and refused.

    The file `number` in the folder holds the number of the input that is tried.
    """
    files = SIDECARS if kind == "verbs" else sorted((CORPORA / kind).iterdir())
    corpus = [path.read_bytes() for path in files]
    path = folder / f"input.{kind}"
    outcomes: collections.Counter[str] = collections.Counter()
    told = os.open(folder / "number", os.O_WRONLY | os.O_CREAT)
    for number in range(first, first + count):
        os.pwrite(told, b"%20d" % number, 0)
        choose = random.Random(f"{kind} {seed} {number}")
        data = corpus[number] if number < len(corpus) else mutated(choose, corpus)
        path.write_bytes(data)
        start = time.process_time()
        try:
            outcome = TARGETS[kind](path, folder)
        except Exception:
            outcome = traceback.format_exc()
        assert outcome in ("accepted", "refused"), f"input {number}, {data!r}: {outcome}"
        assert time.process_time() - start < 5, f"input {number} took too long: {data!r}"
        outcomes[outcome] += 1
    os.close(told)
    return dict(outcomes)


def mutated(choose: random.Random, corpus: list[bytes]) -> bytes:
    """One input: half of them change one value of a JSON text, the others change bytes."""
    data = choose.choice(corpus)
    if choose.random() < 0.5:
        try:
            return with_other_value(choose, data)
        except (ValueError, RecursionError):
            pass
    for _ in range(choose.choice((1, 1, 2, 3, 12))):
        at, end = sorted(choose.randrange(len(data) + 1) for _ in range(2))
        end = min(end, at + choose.choice((0, 1, 8, 200)))
        other = choose.choice(corpus)
        start = choose.randrange(len(other) + 1)
        piece = choose.choice((b"", choose.choice(TOKENS), other[start : start + 40]))
        data = data[:at] + piece + data[end:]
    return data


def with_other_value(choose: random.Random, data: bytes) -> bytes:
    document = json.loads(data)
    places: list[tuple[Any, Any]] = []
    left = [document]
    while left:
        held = left.pop()
        if isinstance(held, dict | list):
            keys = list(held) if isinstance(held, dict) else range(len(held))
            places += [(held, key) for key in keys]
            left += [held[key] for key in keys]
    if not places:
        raise ValueError("nothing to change")
    held, key = choose.choice(places)
    if choose.random() < 0.2:
        del held[key]
    else:
        held[key] = choose.choice(VALUES)
    return json.dumps(document).encode()
