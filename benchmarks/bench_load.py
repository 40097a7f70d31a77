"""Do time and memory stay linear under load: many stops, values, edits, shots, frames?

    python benchmarks/bench_load.py [SIDECAR] [--load NAME]

Each line has a load, its time at a quarter of it and at all of it, and the process's largest
memory after it. Linear time is four times as much; SIDECAR is a small edited sidecar.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import resource
import tempfile
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.cli.main import main as palette4d
from palette4d.common.json_files import read_json
from palette4d.grade.document import Document
from palette4d.shows import manifest as manifests
from palette4d.shows.manifest import DONE, Entry, Manifest
from palette4d.shows.shots import Shot

GOLDEN = Path(__file__).resolve().parents[1] / "tests/golden/sidecars/v1_edited.p4d.json"


def with_stops(source: Path, target: Path, count: int) -> None:
    """Write a sidecar with `count` stops on one edge."""
    document: dict[str, Any] = json.loads(source.read_text("utf-8"))
    polytope = document["polytope"]
    frames = {vertex["id"]: vertex["frame"] for vertex in polytope["vertices"]}
    edge = max(polytope["edges"], key=lambda e: frames[e["to"]] - frames[e["from"]])
    first, last = frames[edge["from"]], frames[edge["to"]]
    document["edits"]["stops"] = [
        {
            "id": f"t{i}",
            "edge": edge["id"],
            "frame": first + (last - first) * (i + 1) / (count + 1),
            "rgb": [0.5, 0.5, i / count],
        }
        for i in range(count)
    ]
    target.write_text(json.dumps(document), "utf-8")


def reset(source: Path, folder: Path, count: int) -> None:
    """`edit reset` of every stop."""
    with_stops(source, folder / "stops.p4d.json", count)
    with contextlib.redirect_stdout(io.StringIO()):
        assert palette4d(["edit", str(folder / "stops.p4d.json"), "reset"]) == 0


def info(source: Path, folder: Path, count: int) -> None:
    """`info` and `plot` of stops on one edge."""
    with_stops(source, folder / "stops.p4d.json", count)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        assert palette4d(["info", str(folder / "stops.p4d.json")]) == 0
        plot = ["plot", str(folder / "stops.p4d.json"), "-o", str(folder / "stops.svg")]
        assert palette4d([*plot, "--force"]) == 0


def extra(source: Path, folder: Path, count: int) -> None:
    """One edit of a sidecar with many values that palette4d only keeps."""
    document: dict[str, Any] = json.loads(source.read_text("utf-8"))
    document["extra"] = {"other": [0] * count}
    (folder / "extra.p4d.json").write_text(json.dumps(document), "utf-8")
    edited = Document.load(folder / "extra.p4d.json")
    edited.set(edited.grade.core.polytope.vertex_ids[0], rgb=(1, 0, 0))
    edited.save()


def edits(source: Path, folder: Path, count: int) -> None:
    """Many edits, each loaded and saved by itself."""
    path = folder / "edits.p4d.json"
    path.write_bytes(source.read_bytes())
    for i in range(count):
        edited = Document.load(path)
        edited.set(edited.grade.core.polytope.vertex_ids[0], rgb=(i / count, 0, 0))
        edited.save()


def shots(source: Path, folder: Path, count: int) -> None:
    """A manifest of many shots, written and read."""
    entries = [
        Entry(Shot(f"s{i:05}", f"m/{i}.mov", 0, 19, (4, 15)), DONE, (0, 17)) for i in range(count)
    ]
    path = folder / "x.shots.json"
    manifests.write(Manifest("edit.otio", "0" * 64, Fraction(24), {}, tuple(entries)), path)
    assert len(manifests.read(path).entries) == count
    read_json(path)


def frames(source: Path, folder: Path, count: int) -> None:
    """Every frame's palette of a long clip."""
    document = Document.load(source)
    first, last, _ = document.grade.frames
    for i in range(count):
        document.grade.palette(first + (last - first) * i / count)


def main() -> None:
    """Run each load at a quarter and in full."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sidecar", nargs="?", type=Path, default=GOLDEN)
    loads: list[tuple[Callable[[Path, Path, int], None], int]] = [
        (frames, 100_000), (info, 20_000), (reset, 20_000), (shots, 10_000), (extra, 3_900_000),
        (edits, 20_000),
    ]  # fmt: skip
    parser.add_argument("--load", choices=[load.__name__ for load, _ in loads])
    args = parser.parse_args()
    for load, count in loads:
        if args.load not in (None, load.__name__):
            continue
        taken = []
        for part in (count // 4, count):
            with tempfile.TemporaryDirectory() as folder:
                start = time.process_time()
                load(args.sidecar, Path(folder), part)
                taken.append(time.process_time() - start)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{load.__name__:8} {count:9}: {taken[0]:7.2f} s, {taken[1]:7.2f} s, {memory:5.0f} MB",
            flush=True,
        )


if __name__ == "__main__":
    main()
