"""Any bytes at all for the readers written in Python: a refusal, or something that can be used.

The inputs are mutations of tests/fuzz/readers/, the same in every run. PALETTE4D_FUZZ_SECONDS=N
makes others for N seconds, by PALETTE4D_FUZZ_SEED.
"""

from __future__ import annotations

import itertools
import json
import os
import random
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import reader_targets

from palette4d.common.child import Child, ChildError

CORPUS = Path(__file__).parent / "readers"
TOKENS = (
    *(b"{", b"}", b"[", b"]", b",", b":", b'"', b"null", b"true", b"[]", b"{}", b'""', b"-", b"\0"),
    *(b"1e999", b"-1e308", b"0.5", b"NaN", b"9" * 400, b"2147483648", b"\\ud800", b"\\u0000"),
    *(b"\xff", b"\xef\xbb\xbf", b"\x1b[2J", b"[" * 80, b"../", b"\r\n", b"00:00:00:00", b"<&\"'>"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, 0, -1, 0.5, 2**31, 10**30, -(10**400), 1e308, "", "a", "../x", "\0", "x" * 400),
    *([], {}, [1], [[]], {"a": 1}, "\ud800", ["a", "b"], [24, 0], [1e300, 1], ["1e9999999"]),
)


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


def corpus_of(kind: str) -> list[bytes]:
    return [path.read_bytes() for path in sorted((CORPUS / kind).iterdir())]


def fuzz(kind: str, suffix: str, target: Callable[[Path], str], folder: Path, inputs: int) -> None:
    corpus = corpus_of(kind)
    seconds = float(os.environ.get("PALETTE4D_FUZZ_SECONDS") or 0)
    ends = time.monotonic() + seconds
    choose = random.Random(kind + os.environ.get("PALETTE4D_FUZZ_SEED", ""))
    path = folder / f"input{suffix}"
    outcomes: set[str] = set()
    for number in itertools.count(-len(corpus)):
        if time.monotonic() > ends if seconds else number >= inputs:
            break
        data = corpus[number] if number < 0 else mutated(choose, corpus)
        path.write_bytes(data)
        start = time.process_time()
        try:
            outcome = target(path)
        except Exception as error:
            raise AssertionError(f"{type(error).__name__} for input {number}: {data!r}") from error
        assert outcome in ("accepted", "refused"), f"input {number}, {data!r}: {outcome}"
        assert time.process_time() - start < 5, f"input {number} took too long: {data!r}"
        outcomes.add(outcome)
    assert "accepted" in outcomes
    print(f"{kind}: {number} inputs")


LENGTHS = [400, pytest.param(100_000, marks=pytest.mark.slow)]


@pytest.mark.parametrize("inputs", LENGTHS)
@pytest.mark.parametrize("kind", ["manifest", "index", "correction"])
def test_any_bytes(kind: str, inputs: int, tmp_path: Path) -> None:
    written = tmp_path / "written"
    written.mkdir()
    target = getattr(reader_targets, kind)
    suffix = {"manifest": ".shots.json", "index": ".series.json", "correction": ".txt"}[kind]
    fuzz(kind, suffix, lambda path: target(path, written), tmp_path, inputs)


@pytest.mark.parametrize("inputs", LENGTHS)
@pytest.mark.parametrize("kind", ["otio", "edl"])
def test_any_bytes_as_a_timeline(kind: str, inputs: int, tmp_path: Path) -> None:
    with Child(30, 1024) as child:

        def target(path: Path) -> str:
            try:
                return child.call(reader_targets.edit, path, tmp_path)
            except ChildError as error:  # the library crashed; `timeline_files.read` says so
                return "took too long" if "longer" in str(error) else "refused"

        fuzz(kind, f".{kind}", target, tmp_path, inputs)
