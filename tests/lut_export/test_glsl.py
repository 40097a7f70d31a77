"""GLSL of a whole clip: checked by glslang, and drawn by Mesa on the processor."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import gl
import numpy as np
import pytest
from gpu_needed import lacks
from numpy.typing import NDArray
from parity.cases import DOCUMENTS, Document
from whole_clips import CONVERTED, PROMISE, converted, exact

import palette4d
from palette4d import Palette4dError

F32 = NDArray[np.float32]

MAIN = """
uniform sampler2D source;
out vec4 result;
void main() { result = palette4d(texelFetch(source, ivec2(gl_FragCoord.xy), 0)); }
"""
#: What mpv puts before a user shader, and around it.
MPV = """
uniform sampler2D source;
out vec4 result;
#define HOOKED_pos gl_FragCoord.xy
#define HOOKED_tex(at) texelFetch(source, ivec2(at), 0)
"""
MPV_MAIN = "\nvoid main() { result = hook(); }\n"


@pytest.fixture
def pixels() -> F32:
    """(n, 4) colours within and around the palettes, with alpha."""
    return np.random.default_rng(8).uniform(-0.2, 1.2, (600, 4)).astype(np.float32)


def exported(document: Document, folder: Path, name: str = "shot.glsl") -> str:
    """The GLSL of a document."""
    source, output = folder / "shot.p4d.json", folder / name
    source.write_text(json.dumps(document), encoding="utf-8")
    palette4d.export_glsl(source, output, force=True)
    return output.read_text(encoding="ascii")


@pytest.mark.parametrize(
    "name",
    [
        "changes-smooth",
        "flat-edited",
        # llvmpipe takes half a minute to compile picks.
        pytest.param("still-learned", marks=pytest.mark.slow),
        pytest.param("changes-holds", marks=pytest.mark.slow),
    ],
)
def test_the_function_draws_what_render_does(name: str, pixels: F32, tmp_path: Path) -> None:
    document = DOCUMENTS[name]
    shader = "#version 330\n" + exported(document, tmp_path) + MAIN
    first, last = (document["polytope"]["blocks"][i][k] for i, k in ((0, "first"), (-1, "last")))
    changed = 0.0
    for frame in sorted({first, (2 * first + last) // 3, last}):
        found = gl.run(shader, pixels, {"p4d_frame": frame, "p4d_strength": 1.0})
        expected = exact(document, frame, pixels[:, :3])
        assert np.abs(found[:, :3] - expected).max() < PROMISE
        changed = max(changed, float(np.abs(expected - pixels[:, :3]).max()))
        assert (found[:, 3] == pixels[:, 3]).all()
    assert changed > 0.05
    assert (gl.run(shader, pixels, {"p4d_frame": first, "p4d_strength": 0.0}) == pixels).all()


@pytest.mark.parametrize("name", CONVERTED)
def test_the_function_converts(name: str, pixels: F32, repo_root: Path, tmp_path: Path) -> None:
    document, steps = converted(name, repo_root)
    pixels[:, :3] = steps.to_clip(pixels[:, :3])
    shader = "#version 330\n" + exported(document, tmp_path) + MAIN
    frame = document["polytope"]["blocks"][0]["first"]
    found = gl.run(shader, pixels, {"p4d_frame": frame, "p4d_strength": 1.0})
    expected = steps.to_palette(exact(document, frame, pixels[:, :3]))
    error = np.abs(steps.to_palette(found[:, :3]) - expected)
    assert (error / np.maximum(np.abs(expected), 1)).max() < PROMISE


def test_the_shader_of_mpv_counts_from_the_first_frame(pixels: F32, tmp_path: Path) -> None:
    document = DOCUMENTS["changes-stops"]
    text = exported(document, tmp_path, "shot.hook")
    assert "\n//!HOOK MAIN\n//!BIND HOOKED\n" in text
    # Nothing but comments is before the first block.
    assert all(line.startswith("//") for line in text[: text.index("//!HOOK")].splitlines())
    first = document["polytope"]["blocks"][0]["first"]
    for shown in (0, 12):
        around = f"#version 330\n{MPV}const int frame = {shown};\n"
        found = gl.run(around + text + MPV_MAIN, pixels, {})
        expected = exact(document, first + shown, pixels[:, :3])
        assert np.abs(found[:, :3] - expected).max() < PROMISE


@pytest.mark.parametrize("version", ["330", "300 es\nprecision highp float;\nprecision highp int;"])
def test_glslang_has_nothing_to_say(version: str, tmp_path: Path) -> None:
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        lacks("no glslangValidator (Debian: glslang-tools)")
    shader = tmp_path / "shot.frag"
    for name in ("changes-holds", "colour-curve"):
        shader.write_text(f"#version {version}\n" + exported(DOCUMENTS[name], tmp_path) + MAIN)
        done = subprocess.run([compiler, shader], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout
        assert "WARNING" not in done.stdout


def test_another_extension_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match=r"NAME\.glsl.*NAME\.hook"):
        exported(DOCUMENTS["changes-stops"], tmp_path, "shot.frag")
