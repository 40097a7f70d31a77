"""DCTL files: the whole edit of a clip in one, compiled as C++ and as OpenCL."""

from __future__ import annotations

import copy
import ctypes
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from opencl import run
from palette4d.lut_export import clip_file, clip_text
from palette4d.lut_export.frame_edit import frame_edit
from parity.cases import (
    DOCUMENTS,
    Document,
    edited,
    learned_odds,
    picked,
    split_merge_document,
)
from parity.kernel import compiler
from whole_clips import CONVERTED, PROMISE, converted, exact, moved_picks

import palette4d
from palette4d import Palette4dError, _core

F32 = NDArray[np.float32]

NAMES = ["changes-smooth", "changes-stops", "changes-hold", "flat-edited", "grey-edited",
         "colour-edited", "still-edited"]  # fmt: skip
PICKS = ["still-picks", "still-holds", "still-learned", "colour-picks", "colour-curve",
         "changes-picks", "changes-holds", "changes-learned"]  # fmt: skip

#: What Resolve puts before a DCTL for OpenCL, and the flags that it builds with.
OPENCL_HOST = """
#define __DEVICE__ static
#define __CONSTANT__ __constant
#define make_float3(x, y, z) (float3)(x, y, z)
#define _fabs fabs
#define _sqrtf sqrt
#define _atan2f atan2
#define _fminf fmin
#define _fmaxf fmax
#define _log2f log2
#define _exp2f exp2
#define _powf pow
#define make_float4(x, y, z, w) (float4)(x, y, z, w)
#define DEFINE_UI_PARAMS(name, label, kind, ...)
#define p4d_strength 1.0f
#define p4d_offset 0
"""
OPENCL_MAIN = """
__kernel void draw(__global const float *in, __global float *out) {
    int i = 3 * (int)get_global_id(0);
#ifdef ALPHA
    float4 to = transform(1, 1, 0, 0, in[i], in[i + 1], in[i + 2], 0.25f);
    if (to.w != 0.25f) to.x = 99.0f;
#else
    float3 to = transform(1, 1, 0, 0, in[i], in[i + 1], in[i + 2]);
#endif
    out[i] = to.x; out[i + 1] = to.y; out[i + 2] = to.z;
}
"""
OPENCL_FLAGS = "-cl-fast-relaxed-math -cl-mad-enable -cl-denorms-are-zero"


@pytest.fixture
def colours() -> F32:
    """(n, 3) colours within and around the palettes."""
    return np.random.default_rng(8).uniform(-0.2, 1.2, (3000, 3)).astype(np.float32)


def exported(document: Document, folder: Path, **options: Any) -> tuple[Path, clip_file.ClipExport]:
    """The DCTL of a document."""
    source, output = folder / "shot.p4d.json", folder / "shot.dctl"
    source.write_text(json.dumps(document), encoding="utf-8")
    return output, palette4d.export_dctl(source, output, force=True, **options)


class Compiled:
    """A DCTL file as C++."""

    def __init__(self, path: Path, *flags: str) -> None:
        compiled, library = path.with_suffix(".o"), path.with_suffix(".so")
        source = Path(__file__).with_name("dctl_host.cpp")
        command = [compiler(), "-std=c++17", "-O1", *flags, "-Wall", "-Wno-unused-parameter"]
        command += ["-Werror", "-c", "-fPIC", f'-DPALETTE4D_DCTL="{path}"', str(source)]
        subprocess.run([*command, "-o", str(compiled)], check=True, timeout=120)
        # Linked without the flags: a library of -ffast-math switches off the process' subnormals.
        link = [compiler(), "-shared", str(compiled), "-o", str(library)]
        subprocess.run(link, check=True, timeout=120)
        self.library = ctypes.CDLL(str(library))

    def draw(self, frame: int, colours: F32, strength: float = 1.0, offset: int = 0) -> F32:
        """The colours at a frame of the timeline."""
        result = np.empty_like(colours)
        self.library.draw(
            ctypes.c_int(frame),
            ctypes.c_float(strength),
            ctypes.c_int(offset),
            ctypes.c_void_p(colours.ctypes.data),
            ctypes.c_void_p(result.ctypes.data),
            ctypes.c_long(len(colours)),
        )
        return result


def cpu_flags() -> str:
    """What this processor can do, as Linux says."""
    info = Path("/proc/cpuinfo")
    return info.read_text() if info.exists() else ""


def frames_of(document: Document) -> tuple[int, int]:
    blocks = document["polytope"]["blocks"]
    return blocks[0]["first"], blocks[-1]["last"]


@pytest.mark.parametrize("flags", [(), ("-ffast-math",)], ids=["exact", "fast-math"])
@pytest.mark.parametrize("name", NAMES + PICKS)
def test_every_frame_is_as_rendered(
    name: str, flags: tuple[str, ...], colours: F32, tmp_path: Path
) -> None:
    document = DOCUMENTS[name]
    path, done = exported(document, tmp_path)
    compiled = Compiled(path, *flags)
    if name in PICKS:
        colours = colours[:800]
    first, last = frames_of(document)
    assert (done.first, done.last) == (first, last)
    changed = 0.0
    for frame in range(first, last + 1):
        # The timeline begins with 1 where the clip has its first frame.
        found = compiled.draw(frame - first + 1, colours)
        expected = exact(document, frame, colours)
        assert np.abs(found - expected).max() < PROMISE, frame
        changed = max(changed, float(np.abs(found - colours).max()))
    assert changed > 0.05


@pytest.mark.parametrize("flags", [(), ("-ffast-math",)], ids=["exact", "fast-math"])
@pytest.mark.parametrize("name", CONVERTED)
def test_a_clip_in_another_colour_space_is_converted(
    name: str, flags: tuple[str, ...], colours: F32, repo_root: Path, tmp_path: Path
) -> None:
    document, steps = converted(name, repo_root)
    colours = steps.to_clip(colours).astype(np.float32)
    path, done = exported(document, tmp_path)
    compiled = Compiled(path, *flags)
    changed = 0.0
    for frame in range(done.first, done.last + 1):
        found = compiled.draw(frame - done.first + 1, colours)
        expected = exact(document, frame, colours)
        # In the palette's code values, in which the promise is.
        in_palette = steps.to_palette(expected)
        error = np.abs(steps.to_palette(found) - in_palette)
        assert (error / np.maximum(np.abs(in_palette), 1)).max() < PROMISE
        changed = max(changed, float(np.abs(expected - colours).max()))
    assert changed > 0.01


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize(
    "name", ["changes-smooth", "flat-edited", "changes-picks", "still-learned"]
)
def test_it_runs_as_opencl_with_the_flags_of_resolve(
    name: str, alpha: bool, colours: F32, tmp_path: Path
) -> None:
    document = DOCUMENTS[name]
    path, _ = exported(document, tmp_path, alpha=alpha)
    first, last = frames_of(document)
    for frame in (first, (first + last) // 2, last):
        now = f"#define TIMELINE_FRAME_INDEX {frame - first + 1}\n"
        offset = OPENCL_HOST.replace("p4d_offset 0", f"p4d_offset {first - 1}")
        if alpha:
            now += "#define ALPHA\n#define DEFINE_DCTL_ALPHA_MODE_STRAIGHT\n"
        source = now + offset + path.read_text(encoding="ascii") + OPENCL_MAIN
        found = run(source, "draw", OPENCL_FLAGS, colours)
        assert np.abs(found - exact(document, frame, colours)).max() < PROMISE


def test_sliders_and_frames_beyond_the_clip(colours: F32, tmp_path: Path) -> None:
    document = DOCUMENTS["changes-stops"]
    compiled = Compiled(exported(document, tmp_path)[0])
    full = exact(document, 12, colours)
    np.testing.assert_allclose(
        compiled.draw(3, colours, strength=0.25, offset=10),
        colours + 0.25 * (full - colours),
        atol=PROMISE,
    )
    assert (compiled.draw(13, colours, strength=0.0) == colours).all()
    assert (compiled.draw(-50, colours) == compiled.draw(1, colours)).all()
    assert (compiled.draw(5000, colours) == compiled.draw(31, colours)).all()


def test_unedited_colours_keep_their_bits(colours: F32, tmp_path: Path) -> None:
    document = DOCUMENTS["changes"]
    compiled = Compiled(exported(document, tmp_path)[0])
    for frame in (1, 12, 31):
        assert (compiled.draw(frame, colours).view(np.uint32) == colours.view(np.uint32)).all()


def test_smooth_ramps_need_few_keys(tmp_path: Path) -> None:
    base = split_merge_document()
    straight, smooth = (
        exported(edited(base, {"a1": (0.3, 0.5, 0.2)}, [("ea", 11, (0.4, 0, 0.1))], ramp=ramp),
                 tmp_path)[1]
        for ramp in ("linear", "smooth")
    )  # fmt: skip
    assert smooth.keys <= straight.keys + 2 < 20


def test_what_picks_keep_through_time_is_stored_once(tmp_path: Path) -> None:
    # Three picks, of which one follows its colour.
    some, more = (
        exported(DOCUMENTS["changes-picks"], tmp_path, frames=f"1-{last}")[1].constant_bytes
        for last in (10, 20)
    )
    assert some < more < some + 10 * 200


def test_a_range_of_frames_is_smaller(colours: F32, tmp_path: Path) -> None:
    document = DOCUMENTS["changes-smooth"]
    whole = exported(document, tmp_path)[1]
    path, part = exported(document, tmp_path, frames="12-18")
    assert part.constant_bytes < whole.constant_bytes
    assert (part.first, part.last) == (12, 18)
    # Frames count from the whole clip's first one, as those of other parts do.
    found = Compiled(path).draw(15 - whole.first + 1, colours)
    assert np.abs(found - exact(document, 15, colours)).max() < PROMISE


def noisy(seed: int) -> NDArray[np.uint8]:
    """Log odds as noisy as those that are learned from clips."""
    odds = learned_odds(seed).astype(int)
    soft = (odds > 0) & (odds < 126)
    noise = np.random.default_rng(seed).integers(-40, 41, odds.shape)
    return np.where(soft, np.clip(odds + noise, 1, 126), odds).astype(np.uint8)


@pytest.mark.parametrize(("room", "levels"), [(65536, 35), (52000, 14), (44000, 10)])
def test_mattes_get_fewer_values_where_they_have_no_room(
    room: int, levels: int, colours: F32, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clip_text, "MOST_BYTES", room)
    base = DOCUMENTS["still-learned"]
    picks = [{**pick, "softness": 0.9, "reach": 0} for pick in base["edits"]["picks"]]
    grids = {name: noisy(seed) for seed, name in enumerate("abc")}
    document = picked(base, picks, grids)
    path, done = exported(document, tmp_path, max_error=0.05)
    assert done.matte_levels == levels
    assert 0.8 * room < done.constant_bytes <= room
    assert f"{done.matte_levels} values" in path.read_text(encoding="ascii").split("#", 1)[0]
    colours = np.abs(colours).clip(0, 1)
    found = Compiled(path).draw(1, colours)
    error = np.abs(found - exact(document, done.first, colours)).max()
    # The error was measured on other colours.
    assert 0.5 * done.error < error < 1.1 * done.error < 0.3 / levels
    less = done.error * 0.99
    with pytest.raises(Palette4dError, match=r"off by about 0\.\d+.*frames=.*max_error=0\.0\d"):
        exported(document, tmp_path, max_error=less)
    # One pick has room as it is.
    assert exported(picked(base, picks[:1], grids), tmp_path)[1].matte_levels == 0


@pytest.mark.parametrize("held", [False, True])
def test_picks_that_move_have_keys_of_their_own(held: bool, colours: F32, tmp_path: Path) -> None:
    document = moved_picks(390, held=held)
    path, done = exported(document, tmp_path)
    # 27 times in each path, and some more where a path enters another cell of the grid.
    assert done.keys < 12
    assert done.pick_keys < 300
    assert done.matte_levels == 0
    assert done.constant_bytes < 64000
    sidecar = _core.parse_sidecar(json.dumps(document), "case")
    for name, flags in (("plain", ()), ("fast", ("-ffast-math",))):
        named = path.rename(path.with_stem(name))
        compiled, path = Compiled(named, *flags), named
        for frame in range(391):
            part = colours[:300]
            found = compiled.draw(frame + 1, part)
            assert np.abs(found - frame_edit(sidecar, frame).exact(part)).max() < PROMISE, frame


@pytest.mark.parametrize("flags", ["plain", "fused", "fast"])
def test_picks_that_fade_beside_others_end_in_nothing(
    flags: str, colours: F32, tmp_path: Path
) -> None:
    """Where the strength becomes 0 its rounding must not count, whatever a compiler makes of it."""
    fused = ("-ffp-contract=fast", *(["-mfma"] if "fma" in cpu_flags() else []))
    options = {"plain": (), "fused": fused, "fast": ("-ffast-math", *fused)}[flags]
    draws = np.random.default_rng(7)
    for case in range(3):
        (start, until), fade = sorted(draws.integers(2, 40, 2).tolist()), int(draws.integers(2, 9))
        document = moved_picks(60, held=False)
        first, *others = document["edits"]["picks"]
        ranged = {**first, "from": start, "until": until, "fade": fade}
        document["edits"]["picks"] = [ranged, *others]
        folder = tmp_path / str(case)
        folder.mkdir()
        path, done = exported(document, folder, max_error=1.0)
        compiled = Compiled(path, *options)
        for frame in range(done.first, done.last + 1):
            found = compiled.draw(frame - done.first + 1, colours)
            off = np.abs(found - exact(document, frame, colours)).max()
            assert off < max(PROMISE, done.error + PROMISE), (case, frame)


def test_the_error_is_that_of_each_frame(colours: F32, tmp_path: Path) -> None:
    document = moved_picks(60, held=True, odds=noisy)
    path, done = exported(document, tmp_path)
    assert done.matte_levels == 35
    compiled = Compiled(path)
    colours = colours.clip(0, 1)
    errors = [
        np.abs(compiled.draw(frame + 1, colours) - exact(document, frame, colours)).max()
        for frame in range(0, 61, 3)
    ]
    assert 0.5 * done.error < max(errors) < 1.1 * done.error


def test_what_a_dctl_cannot_hold_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = DOCUMENTS["changes-smooth"]
    with pytest.raises(Palette4dError, match=r"outside the clip"):
        exported(document, tmp_path, frames="12-400")
    for wrong in (-1, float("nan"), "0.1"):
        with pytest.raises(Palette4dError, match="expected 0 or more code values"):
            exported(document, tmp_path, max_error=wrong)
    fields = copy.deepcopy(document)
    ends = {fields["clip"]["frames"][end]: far for end, far in (("first", -1e9), ("last", 1e9))}
    polytope, frames = fields["polytope"], fields["clip"]["frames"]
    for owner in (frames, *polytope["vertices"], *polytope["blocks"]):
        for name in owner.keys() & {"first", "last", "frame"}:
            owner[name] = ends.get(owner[name], owner[name])
    with pytest.raises(Palette4dError, match=r"more than 1000000 frames"):
        exported(fields, tmp_path)
    monkeypatch.setattr(clip_text, "MOST_BYTES", 1000)
    with pytest.raises(Palette4dError, match=r"room for 0 KB.*frames="):
        exported(document, tmp_path)
    with pytest.raises(Palette4dError, match=r"KB.*switch picks off"):
        exported(DOCUMENTS["still-pick"], tmp_path)
    with pytest.raises(Palette4dError, match=r"\.dctl"):
        palette4d.export_dctl(tmp_path / "shot.p4d.json", tmp_path / "shot.cube")
    assert not list(tmp_path.glob("*.dctl"))
