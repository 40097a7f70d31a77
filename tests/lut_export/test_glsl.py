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
from whole_clips import CONVERTED, PROMISE, converted, exact, moved_picks

import palette4d
from palette4d import Palette4dError

F32 = NDArray[np.float32]

MAIN = """
uniform sampler2D source;
out vec4 result;
void main() { result = palette4d(texelFetch(source, ivec2(gl_FragCoord.xy), 0)); }
"""
#: What mpv puts before a user shader, and around it; its `frame` is 1 at the first frame.
MPV = """
uniform sampler2D p4d_mattes;
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


def exported(
    document: Document, folder: Path, name: str = "shot.glsl"
) -> tuple[str, NDArray[np.uint8] | None]:
    """The GLSL of a document, and its texture."""
    source = folder / "shot.p4d.json"
    source.write_text(json.dumps(document), encoding="utf-8")
    done = palette4d.export_glsl(source, folder / name, force=True)
    texture = None
    if done.texture is not None:
        texture = np.fromfile(done.texture, np.uint8).reshape(-1, 256, 4)
    return Path(done.output).read_text(encoding="ascii"), texture


def blocks(hook: str) -> list[tuple[list[str], str]]:
    """The blocks of a user shader as mpv reads them: settings, and what follows."""
    found: list[tuple[list[str], str]] = []
    settings: list[str] = []
    for line in hook[hook.index("//!") :].splitlines():
        if line.startswith("//!"):
            settings.append(line[3:])
        else:
            if settings:
                found.append((settings, ""))
                settings = []
            found[-1] = (found[-1][0], found[-1][1] + line + "\n")
    return found


@pytest.mark.parametrize(
    "name",
    [
        "changes-smooth",
        "flat-edited",
        "still-learned",
        # llvmpipe takes some seconds to compile each.
        pytest.param("colour-curve", marks=pytest.mark.slow),
        pytest.param("changes-holds", marks=pytest.mark.slow),
        pytest.param("changes-learned", marks=pytest.mark.slow),
    ],
)
def test_the_function_draws_what_render_does(name: str, pixels: F32, tmp_path: Path) -> None:
    document = DOCUMENTS[name]
    text, picks = exported(document, tmp_path)
    assert (picks is not None) == ("picks" in document["edits"])
    shader = "#version 330\n" + text + MAIN
    first, last = (document["polytope"]["blocks"][i][k] for i, k in ((0, "first"), (-1, "last")))
    changed = 0.0
    for frame in sorted({first, (2 * first + last) // 3, last}):
        found = gl.run(shader, pixels, {"p4d_frame": frame, "p4d_strength": 1.0}, picks)
        expected = exact(document, frame, pixels[:, :3])
        assert np.abs(found[:, :3] - expected).max() < PROMISE
        changed = max(changed, float(np.abs(expected - pixels[:, :3]).max()))
        assert (found[:, 3] == pixels[:, 3]).all()
    assert changed > 0.05
    assert (
        gl.run(shader, pixels, {"p4d_frame": first, "p4d_strength": 0.0}, picks) == pixels
    ).all()


def test_picks_that_move_are_whole(pixels: F32, tmp_path: Path) -> None:
    document = moved_picks(390, held=True)
    text, picks = exported(document, tmp_path)
    assert len(text) < 100_000  # few keys
    for frame in range(5, 391, 55):
        uniforms = {"p4d_frame": frame, "p4d_strength": 1.0}
        found = gl.run("#version 330\n" + text + MAIN, pixels, uniforms, picks)
        assert np.abs(found[:, :3] - exact(document, frame, pixels[:, :3])).max() < PROMISE


@pytest.mark.parametrize("name", CONVERTED)
def test_the_function_converts(name: str, pixels: F32, repo_root: Path, tmp_path: Path) -> None:
    document, steps = converted(name, repo_root)
    pixels[:, :3] = steps.to_clip(pixels[:, :3])
    shader = "#version 330\n" + exported(document, tmp_path)[0] + MAIN
    frame = document["polytope"]["blocks"][0]["first"]
    found = gl.run(shader, pixels, {"p4d_frame": frame, "p4d_strength": 1.0})
    expected = steps.to_palette(exact(document, frame, pixels[:, :3]))
    error = np.abs(steps.to_palette(found[:, :3]) - expected)
    assert (error / np.maximum(np.abs(expected), 1)).max() < PROMISE


def test_the_shader_of_mpv_counts_from_the_first_frame(pixels: F32, tmp_path: Path) -> None:
    document = DOCUMENTS["changes-stops"]
    text, _ = exported(document, tmp_path, "shot.hook")
    assert [settings for settings, _ in blocks(text)] == [
        ["HOOK MAIN", "BIND HOOKED", "DESC palette4d: case"]
    ]
    # Nothing but comments is before the first block.
    assert all(line.startswith("//") for line in text[: text.index("//!HOOK")].splitlines())
    first = document["polytope"]["blocks"][0]["first"]
    for shown in (0, 12):
        around = f"#version 330\n{MPV}const int frame = {shown + 1};\n"
        found = gl.run(around + text + MPV_MAIN, pixels, {})
        expected = exact(document, first + shown, pixels[:, :3])
        assert np.abs(found[:, :3] - expected).max() < PROMISE


def test_the_shader_of_mpv_has_its_texture(pixels: F32, tmp_path: Path) -> None:
    document = DOCUMENTS["still-learned"]
    text, beside = exported(document, tmp_path, "shot.hook")
    assert beside is None
    (settings, data), (hook, shader) = blocks(text)
    assert settings[0] == "TEXTURE p4d_mattes"
    assert settings[2:] == ["FORMAT rgba8", "FILTER NEAREST"]
    assert hook[:3] == ["HOOK MAIN", "BIND HOOKED", "BIND p4d_mattes"]
    width, height = map(int, settings[1].removeprefix("SIZE ").split())
    # mpv wants one line, and neither more nor fewer bytes.
    picks = np.frombuffer(bytes.fromhex(data.removesuffix("\n")), np.uint8)
    picks = picks.reshape(height, width, 4)
    around = f"#version 330\n{MPV}const int frame = 1;\n"
    found = gl.run(around + shader + MPV_MAIN, pixels, {}, picks)
    first = document["polytope"]["blocks"][0]["first"]
    assert np.abs(found[:, :3] - exact(document, first, pixels[:, :3])).max() < PROMISE


@pytest.mark.parametrize("version", ["330", "300 es\nprecision highp float;\nprecision highp int;"])
def test_glslang_has_nothing_to_say(version: str, tmp_path: Path) -> None:
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        lacks("no glslangValidator (Debian: glslang-tools)")
    shader = tmp_path / "shot.frag"
    for name in ("changes-holds", "colour-curve"):
        shader.write_text(f"#version {version}\n" + exported(DOCUMENTS[name], tmp_path)[0] + MAIN)
        done = subprocess.run([compiler, shader], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout
        assert "WARNING" not in done.stdout


def test_another_extension_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match=r"NAME\.glsl.*NAME\.hook"):
        exported(DOCUMENTS["changes-stops"], tmp_path, "shot.frag")


def test_a_texture_is_replaced_only_by_force(tmp_path: Path) -> None:
    source, other = tmp_path / "shot.p4d.json", tmp_path / "shot.rgba"
    source.write_text(json.dumps(DOCUMENTS["still-pick"]), encoding="utf-8")
    other.write_bytes(b"the user's")
    with pytest.raises(Palette4dError, match=r"shot\.rgba"):
        palette4d.export_glsl(source, tmp_path / "shot.glsl")
    assert other.read_bytes() == b"the user's"
    assert not (tmp_path / "shot.glsl").exists()
    palette4d.export_glsl(source, tmp_path / "shot.glsl", force=True)
    assert other.stat().st_size % 1024 == 0
