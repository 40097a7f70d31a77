"""The bounded JSON reader: what would take all memory, hang, or fail later is refused at once."""

import os
import time
from pathlib import Path

import pytest
from posix_files import pipes

from palette4d.common import json_files
from palette4d.common.json_files import UnusableFile, parse, read_json, read_regular

HOSTILE = {
    "an infinite number": b'{"a": 1e999}',
    "NaN": b"[NaN]",
    "Infinity": b"[-Infinity]",
    "deep lists": b"[" * 200_000,
    "deep objects": b'{"a":' * 100 + b"1" + b"}" * 100,
    "many values": b"[" + b"[]," * 4_100_000 + b"[]]",
    "half a character": b'["\\ud800"]',
    "no UTF-8": b'["\xff"]',
    "a number of many digits": b"[" + b"9" * 10_000 + b"]",
    "nothing": b"",
    "an open text": b'["' + b"a" * 100_000,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_text_is_refused_quickly(name: str, tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(HOSTILE[name])
    start = time.process_time()
    with pytest.raises(UnusableFile, match=r"x\.json: .* expected"):
        read_json(path)
    assert time.process_time() - start < 5


def test_what_is_in_texts_does_not_count() -> None:
    text = b'{"a": "[[[[' + b"[" * 1000 + rb"\"[{," + b'", "b": ["\\ud83d\\ude00", 1.5e3, -0]}'
    assert parse(text)["b"] == ["\N{GRINNING FACE}", 1500.0, 0]


@pipes
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    handles = Path("/proc/self/fd")
    before = len(list(handles.iterdir())) if handles.exists() else 0
    for path in (pipe, Path("/dev/zero"), tmp_path):
        with pytest.raises(UnusableFile, match="pipe or device"):
            read_json(path)
    if before:  # who waits for a lock whose file is a folder looks at it hundreds of times
        assert len(list(handles.iterdir())) == before
    with pytest.raises(FileNotFoundError):
        read_json(tmp_path / "gone")


def test_large_files_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "large"
    with path.open("wb") as stream:
        stream.truncate(json_files.LARGEST_FILE + 1)
    with pytest.raises(UnusableFile, match="expected a smaller file"):
        read_regular(path)
