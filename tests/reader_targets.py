"""What the readers do with any bytes: the targets of tests/fuzz/test_readers.py.

Each takes a file and a folder for what it writes. It returns "accepted" or "refused"; every other
error than `Palette4dError` is a fault.
"""

from __future__ import annotations

import contextlib
import io
import json
import traceback
from pathlib import Path
from typing import Any

import PyOpenColorIO as ocio
from palette4d.lut_export import cdl, series_index
from palette4d.lut_export.series import Series
from palette4d.lut_export.writers import Description

from palette4d.cli import export
from palette4d.common.errors import Palette4dError
from palette4d.shows import manifest as manifests
from palette4d.shows import timeline, timeline_files
from palette4d.shows.shots import numbered


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
    header = json.loads((Path(__file__).parent / "fuzz/readers/index/two.json").read_text("utf-8"))
    del header["frames"]
    try:
        entries = series_index.read_index(path, header, force=False)
    except Palette4dError:
        return "refused"
    document = series_index.document_of(header, entries)
    done = Series(path, document, [], sorted(entries), {})
    with contextlib.redirect_stderr(io.StringIO()):
        export.report(done)
        export.warn([done])
    series_index.write_index(folder / "copy.json", header, entries)
    return "accepted"


def correction(path: Path, folder: Path) -> str:
    """Write a CDL whose texts are the bytes; OpenColorIO must read its numbers back."""
    text = path.read_bytes().decode("utf-8", "ignore")
    about = Description("urn:x", text, (text,), text)
    written = cdl.Cdl((1.5, 1.0, 1.0), saturation=0.5)
    for name in ("cc", "ccc", "cdl"):
        file = folder / f"x.{name}"
        file.write_text(cdl.write(written, name, text, about), "utf-8", newline="\n")
        transform: Any = ocio.FileTransform(src=str(file), cccId="0")
        processor = ocio.Config.CreateRaw().getProcessor(transform)
        assert processor.createGroupTransform()[0].getSat() == 0.5
    return "accepted"


def edit(path: Path, folder: Path) -> str:
    """Read a timeline and its shots, in a child process; return a fault as its traceback."""
    try:
        text = timeline_files.as_json(str(path), {})
    except Exception:  # an adapter may raise anything; `timeline_files.read` reports it
        return "refused"
    try:
        numbered(timeline.shots_of(timeline_files.document_of(path, text)).shots)
    except Palette4dError:
        return "refused"
    except Exception:
        return traceback.format_exc()
    return "accepted"
