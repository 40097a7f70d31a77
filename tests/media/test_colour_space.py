"""The palette's colour space: how it is chosen, its exactness, and refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest
from clip_files import write_image, write_movie

from palette4d import _core
from palette4d.cli.main import main
from palette4d.colour import ocio_config
from palette4d.colour.conversion_chain import TOLERANCE, Comparison, conversion
from palette4d.colour.conversion_steps import ConversionError
from palette4d.common.errors import Palette4dError
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document
from palette4d.media.clip import open_clip
from palette4d.media.colour_space import SpaceOptions, Spaces, spaces_of
from palette4d.media.frame_writer import write_frame

STUDIO = "ocio://studio-config-v1.0.0_aces-v1.3_ocio-v2.1"
NEWEST = "ocio://studio-config-v2.2.0_aces-v1.3_ocio-v2.4"


@pytest.fixture(autouse=True)
def no_config(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OCIO", raising=False)


def scene(frame: int, height: int = 36, width: int = 48) -> np.ndarray[Any, Any]:
    """A scene-linear picture, from below 0 to 50, that changes a little with the frame."""
    y, x = np.mgrid[0:height, 0:width] / np.array([height, width])[:, None, None]
    fade = frame / 6
    light = np.stack([0.02 + 0.4 * x * (1 - fade), 0.05 + 0.2 * y, 0.01 + 0.5 * (1 - x) * y], -1)
    light *= np.exp2(np.random.default_rng(frame).normal(0, 0.5, (height, width, 1)))
    light[:4] *= 50 / light[:4].max()
    light[-3:] -= 0.08
    light[15:20, 20:28] = 6, 2, 0.4
    return light.astype(np.float32)


@pytest.fixture
def linear_clip(tmp_path: Path) -> str:
    """Scene-linear ACEScg from below 0 to 50, 4 frames of EXR."""
    for frame in range(1, 5):
        write_image(tmp_path / f"cg.{frame:04d}.exr", scene(frame), "float")
    return str(tmp_path / "cg.####.exr")


@pytest.fixture
def display_clip(tmp_path: Path) -> str:
    for frame in (1, 2):
        write_image(tmp_path / f"d.{frame:04d}.png", np.clip(scene(frame), 0, 1), "uint8")
    return str(tmp_path / "d.####.png")


def through(config: Any, source: str, target: str, colours: Any) -> np.ndarray[Any, Any]:
    """OpenColorIO's own, without its approximations."""
    cpu = config.getProcessor(source, target).getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
    result = np.array(colours, dtype=np.float32, order="C").reshape(1, -1, 3)
    cpu.applyRGB(result)
    return result.reshape(-1, 3)


# --------------------------------------------------------------------------- how exact a chain is


@pytest.mark.parametrize(
    ("config", "source", "target"),
    [
        (STUDIO, "ACEScg", "ACEScct"),
        (STUDIO, "ACES2065-1", "ARRI LogC3 (EI800)"),
        (STUDIO, "ARRI LogC4", "ACEScct"),
        (STUDIO, "S-Log3 S-Gamut3.Cine", "ACEScct"),
        (STUDIO, "V-Log V-Gamut", "ACEScg"),
        (STUDIO, "sRGB - Texture", "ACEScct"),
        (STUDIO, "Gamma 2.4 Rec.709 - Texture", "ACEScg"),
        (STUDIO, "CanonLog3 CinemaGamut D55", "ACEScct"),
        (NEWEST, "Apple Log", "ACEScct"),
        (NEWEST, "ACEScg", "ST2084-P3-D65 - Display"),
    ],
)
def test_a_chain_is_opencolorio_s_conversion(config: str, source: str, target: str) -> None:
    """Both ways, on grids of our own; where OpenColorIO brings a colour back, so do we."""
    opened = ocio_config.load_config(config, "test")
    chain = conversion(opened, source, target).chain
    for ways, there, back, start in (
        (chain.to_palette, (source, target), (target, source), source),
        (chain.to_clip, (target, source), (source, target), target),
    ):
        linear = opened.getColorSpace(start).getEncoding() == "scene-linear"
        ramp = np.geomspace(1e-4, 60, 21) if linear else np.linspace(0, 1, 21)
        colours = np.stack(np.meshgrid(ramp, ramp[::4], ramp[::4]), -1).reshape(-1, 3)
        wanted = through(opened, *there, colours)
        returned = through(opened, *back, wanted)
        inside = (np.abs(returned - colours) < 1e-6 * np.maximum(colours, 1)).all(axis=1)
        assert inside.sum() > 50
        # OpenColorIO computes in single precision: so far it may be off by its own rounding.
        found = ways(colours)
        shake = np.random.default_rng(3).choice([-1, 1], (8, *colours.shape)) * 2.0**-21
        shaken = [ways(colours + s * colours.max(axis=1, keepdims=True)) - found for s in shake]
        rounding = np.abs(shaken).max(axis=0)
        off = (np.abs(found - wanted) - rounding) / np.maximum(np.abs(wanted), 1)
        assert off[inside].max() < TOLERANCE


def saturated() -> np.ndarray[Any, Any]:
    """(n, 3) colours of 8 bits, many of them with channels at 0."""
    random = np.random.default_rng(0)
    codes = random.integers(0, 256, (4096, 3))
    for channel in range(3):
        codes[channel :: 2 + channel, channel] = 0
    return (np.minimum(codes, random.integers(0, 256, (4096, 1))) / 255).astype(np.float32)


@pytest.mark.parametrize(
    "source", ["Gamma 2.2 Rec.709 - Texture", "Rec.1886 Rec.709 - Display", "ADX10"]
)
def test_opencolorio_s_own_rounding_near_black_is_not_the_chain_s(source: str) -> None:
    config = ocio_config.load_config(STUDIO, "test")
    chain = conversion(config, source, "ACEScct").chain
    there = through(config, source, "ACEScct", saturated())
    off = np.abs(chain.to_clip(there) - through(config, "ACEScct", source, there))
    assert off.max() > TOLERANCE  # OpenColorIO's
    seen = Comparison(config, source, "ACEScct", chain)
    seen.add(saturated())
    assert seen.error < 1e-6
    assert seen.colours == 4096
    assert seen.beyond == 0


def test_a_chain_that_is_off_near_black_is_seen() -> None:
    """By 1e-4 of a gamma, and by a matrix that mixes 1e-4 of a channel into another."""
    config = ocio_config.load_config(STUDIO, "test")
    spaces = "Gamma 2.2 Rec.709 - Texture", "ACEScct"
    for kind in ("gamma", "matrix"):
        steps = json.loads(json.dumps(conversion(config, *spaces).steps))
        (step,) = (step for step in steps if step["kind"] == kind)
        if kind == "gamma":
            step["gamma"] = [value * (1 + 1e-4) for value in step["gamma"]]
        else:
            step["matrix"][0][1] += 1e-4
        seen = Comparison(config, *spaces, _core.ColourConversion(json.dumps(steps), "wrong"))
        seen.add(saturated())
        assert seen.error > TOLERANCE


def test_what_a_chain_cannot_do_is_refused() -> None:
    config = ocio_config.load_config(NEWEST, "test")
    with pytest.raises(ConversionError, match=r"REC2100_SURROUND.*depend on each other"):
        conversion(config, "Rec.2100-HLG - Display", "ACEScct")
    # OpenColorIO clamps AP0 at 0 on the way: colours outside of it come back as others.
    with pytest.raises(ConversionError, match=r"difference of .* expected at most 1e-05"):
        conversion(config, "ACEScg", "ACEScc")


def custom(transforms: list[Any]) -> Any:
    """A config with the spaces `lin` and `odd`, which these transforms lead to."""
    config = ocio.Config.CreateRaw()
    config.setMajorVersion(2)
    config.addColorSpace(ocio.ColorSpace(name="lin", encoding="scene-linear"))
    odd = ocio.ColorSpace(name="odd", encoding="log")
    odd.setTransform(ocio.GroupTransform(transforms), ocio.COLORSPACE_DIR_FROM_REFERENCE)
    config.addColorSpace(odd)
    config.setRole("scene_linear", "lin")
    return config


def table_of(values: list[float]) -> Any:
    table = ocio.Lut1DTransform(length=len(values), inputHalfDomain=False)
    table.setData(np.repeat(np.array(values, np.float32), 3))
    return table


def test_every_kind_of_transform_becomes_a_step() -> None:
    ramp = np.linspace(0, 1, 64)
    table = ocio.Lut1DTransform(length=64, inputHalfDomain=False)
    table.setData(np.stack([ramp**1.5, ramp, 2 * ramp], 1).astype(np.float32).ravel())
    cases: list[tuple[list[Any], str]] = [
        ([ocio.MatrixTransform(np.diag([2.0, 3, 4, 1]).ravel(), [0.1, 0, 0, 0])], "matrix"),
        ([ocio.RangeTransform(0.0, 0.5, 0.0, 1.0)], "matrix"),
        ([ocio.LogAffineTransform([0.2] * 3, [0.6] * 3, [1.0] * 3, [0.01] * 3)], "log"),
        ([ocio.ExponentTransform([2.0, 2.2, 2.4, 1])], "gamma"),
        ([ocio.ExponentWithLinearTransform([2.4, 2.4, 2.4, 1], [0.055] * 3 + [0.0])], "gamma"),
        ([table], "curve"),
    ]
    for transforms, kind in cases:
        made = conversion(custom(transforms), "lin", "odd")
        assert [step["kind"] for step in made.steps] == [kind]
        colours = np.random.default_rng(1).uniform(0.02, 0.45, (500, 3)).astype(np.float32)
        wanted = through(custom(transforms), "lin", "odd", colours)
        np.testing.assert_allclose(made.chain.to_palette(colours), wanted, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("transform", "found"),
    [
        (table_of([0.0, 0.6, 0.5, 1.0]), "curve that falls"),
        (table_of([0.5, 0.5, 0.5]), "curve that is level"),
        (
            ocio.MatrixTransform([1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1.0]),
            "no way|inver",
        ),
    ],
)
def test_transforms_without_a_way_back_are_refused(transform: Any, found: str) -> None:
    with pytest.raises(ConversionError, match=found):
        conversion(custom([transform]), "lin", "odd")


# --------------------------------------------------------------------------------- what is chosen


def chosen(clip: str, **options: Any) -> Spaces | None:
    return spaces_of(open_clip(clip), SpaceOptions(**options))


def test_scene_linear_goes_to_a_log_and_the_rest_stays(linear_clip: str) -> None:
    for given, source, palette in (
        ("ACEScg", "ACEScg", "ACEScct"),
        ("lin_rec709", "Linear Rec.709 (sRGB)", "ACEScct"),
        ("ARRI LogC4", "ARRI LogC4", "ARRI LogC4"),
        ("sRGB - Texture", "sRGB - Texture", "sRGB - Texture"),
    ):
        spaces = chosen(linear_clip, input_space=given)
        assert spaces is not None
        assert (spaces.input_space, spaces.palette_space) == (source, palette)
        assert (spaces.conversion is None) == (source == palette)


def test_files_and_rules_decide_when_nothing_is_said(
    linear_clip: str, display_clip: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert chosen(linear_clip) is None  # no config, no option: nothing
    monkeypatch.setenv("OCIO", STUDIO)
    by_default = chosen(linear_clip)
    assert by_default is not None
    assert by_default.input_space == "ACES2065-1"  # the config's default rule
    display = chosen(display_clip)
    assert display is not None
    assert display.input_space == display.palette_space == "sRGB - Texture"
    assert display.conversion is None


def test_a_file_rule_decides_by_name(
    linear_clip: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = ocio_config.load_config(STUDIO, "test")
    rules = config.getFileRules()
    rules.insertRule(0, "cg renders", "ACEScg", "*/cg.*", "exr")
    config.setFileRules(rules)
    path = tmp_path / "config.ocio"
    path.write_text(config.serialize(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    spaces = chosen(linear_clip, ocio_config=path.name)
    assert spaces is not None
    assert spaces.input_space == "ACEScg"
    assert spaces.config_name == str(path)  # sidecars are read in other folders
    archive = tmp_path / "packed.ocioz"
    config.setWorkingDir(str(tmp_path))
    config.archive(str(archive))
    packed = chosen(linear_clip, ocio_config=str(archive))
    assert packed is not None
    assert packed.input_space == "ACEScg"


def test_a_file_that_says_otherwise_than_the_rule_is_told(tmp_path: Path) -> None:
    for name, said in (("plain", ""), ("ap1", "lin_ap1_scene"), ("ap0", "lin_ap0_scene")):
        pixels = np.full((4, 4, 3), 0.2, np.float32)
        metadata = [("oiio:ColorSpace", "string", said)] if said else []
        write_frame(tmp_path / f"{name}.1.exr", pixels, "half", metadata=metadata)
        spaces = chosen(str(tmp_path / f"{name}.#.exr"), ocio_config="ocio://studio-config-latest")
        assert spaces is not None
        assert spaces.input_space == "ACES2065-1"  # its rule for all EXRs
        assert ("'ACEScg'" in spaces.note) == (name == "ap1")
        assert bool(spaces.note) == (name == "ap1")


# ---------------------------------------------------------------------------- from clip to sidecar


def analyse(clip: str, output: Path, *options: str, method: str = "static") -> dict[str, Any]:
    words = ["--quiet", "--method", method, *options]
    assert main(["analyze", clip, "-o", str(output), *words]) == 0
    document: dict[str, Any] = json.loads(output.read_text(encoding="utf-8"))
    return document


def test_a_scene_linear_clip_end_to_end(linear_clip: str, tmp_path: Path) -> None:
    document = analyse(
        linear_clip, tmp_path / "cg.p4d.json", "--input-space", "ACEScg", method="skew"
    )
    assert document["clip"]["encoding"] == "ACEScct"
    stated = document["clip"]["conversion"]
    assert (stated["input_space"], stated["config"]) == ("ACEScg", ocio_config.BUILT_IN)
    assert 0 < stated["error"] < TOLERANCE
    assert [step["kind"] for step in stated["steps"]] == ["log"]
    # The palette holds the clip's colours in ACEScct: none of the analysis' colours is beyond it.
    rgb = np.array([vertex["rgb"] for vertex in document["polytope"]["vertices"]])
    assert rgb.max() < 1.2
    assert document["quality"]["stages"][-1]["L"] < 1


def test_hulls_in_linear_light_are_useless(linear_clip: str, tmp_path: Path, capsys: Any) -> None:
    """The same clip, the same options: what the docs claim."""
    log = analyse(linear_clip, tmp_path / "log.p4d.json", "--input-space", "ACEScg", method="skew")
    assert "scene-linear" not in capsys.readouterr().err
    linear = analyse(linear_clip, tmp_path / "lin.p4d.json", method="skew")
    assert "--input-space" in capsys.readouterr().err
    assert "conversion" not in linear["clip"]
    worse = linear["quality"]["stages"][-1]["L"] / log["quality"]["stages"][-1]["L"]
    assert worse > 5


def test_without_options_and_without_ocio_nothing_changes(
    display_clip: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = analyse(display_clip, tmp_path / "a.p4d.json")
    assert "conversion" not in plain["clip"]
    assert "conversion" not in plain["clip"]
    # The encoding is named by the config then; no number changes.
    monkeypatch.setenv("OCIO", STUDIO)
    named = analyse(display_clip, tmp_path / "b.p4d.json")
    assert "conversion" not in named["clip"]
    assert named["polytope"] == plain["polytope"]


def test_unedited_pixels_keep_their_bits_and_edited_ones_come_back(
    linear_clip: str, tmp_path: Path
) -> None:
    path = tmp_path / "cg.p4d.json"
    document = analyse(linear_clip, path, "--input-space", "ACEScg")
    image = scene(2)
    assert np.array_equal(Document.load(path).recolour(image, 2), image)

    # Brighter by half a stop everywhere: in ACEScct all colours move by the same step.
    half = 0.5 / 17.52
    document["edits"]["vertices"] = [
        {"vertex": vertex["id"], "rgb": [value + half for value in vertex["rgb"]]}
        for vertex in document["polytope"]["vertices"]
    ]
    brighter = Document(document).recolour(image, 2)
    # ACEScct is straight below 0.0078125, above it a step is a factor.
    bright = (image > 0.02).all(axis=-1)
    np.testing.assert_allclose(brighter[bright] / image[bright], np.sqrt(2), rtol=2e-3)
    document["edits"]["vertices"] = [
        {"vertex": vertex["id"], "rgb": [value - half for value in vertex["rgb"]]}
        for vertex in document["polytope"]["vertices"]
    ]
    back = Document(document).recolour(brighter, 2)
    np.testing.assert_allclose(back, image, rtol=2e-3, atol=1e-5)


def test_the_neutral_stays_monotone_and_finite(linear_clip: str, tmp_path: Path) -> None:
    path = tmp_path / "cg.p4d.json"
    document = analyse(linear_clip, path, "--input-space", "ACEScg")
    for vertex in document["polytope"]["vertices"]:
        document["edits"]["vertices"].append(
            {"vertex": vertex["id"], "rgb": [value + 0.05 for value in vertex["rgb"]]}
        )
    grade = Document(document)
    ramp = np.concatenate([-np.geomspace(100, 1e-6, 400), [0], np.geomspace(1e-6, 6e4, 2000)])
    image = np.repeat(ramp.astype(np.float32)[None, :, None], 3, axis=2)
    result = grade.recolour(image, 2.5)
    assert np.isfinite(result).all()
    assert (np.diff(result[0], axis=0) > -1e-6 * np.abs(result[0, 1:])).all()
    odd = np.array([[[np.nan, 1, 1], [np.inf, 0, 0], [3e38, -3e38, 0]]], dtype=np.float32)
    passed = grade.recolour(odd, 2.5)
    assert np.array_equal(passed[0, :2], odd[0, :2], equal_nan=True)
    assert np.isfinite(passed[0, 2]).all()


# ------------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--input-space", "acesg"], ["acesg", "ACEScg", "--input-space"]),
        (["--input-space", "ACEScg", "--palette-space", "logc3"], ["logc3", "LogC3"]),
        (["--input-space", "Raw"], ["data, not colours"]),
        (["--ocio-config", "missing.ocio"], ["missing.ocio", "found no config", "--ocio-config"]),
        (["--ocio-config", "ocio://studio"], ["no such config", "ocio://studio-config-v"]),
        (["--input-space", "ACEScg", "--palette-space", "ACEScc"], ["expected at most 1e-05"]),
    ],
)
def test_bad_names_are_refused_and_nothing_is_written(
    linear_clip: str, tmp_path: Path, capsys: Any, options: list[str], words: list[str]
) -> None:
    output = tmp_path / "x.p4d.json"
    assert main(["analyze", linear_clip, "-o", str(output), "--quiet", *options]) == 1
    error = capsys.readouterr().err
    assert error.startswith("palette4d: error: ")
    for word in words:
        assert word in error
    assert not output.exists()


def test_configs_that_cannot_be_used(
    linear_clip: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "broken.ocio"
    broken.write_text("ocio_profile_version: 2\ncolorspaces: [", encoding="utf-8")
    with pytest.raises(Palette4dError, match="cannot use it as a config"):
        chosen(linear_clip, ocio_config=str(broken))
    # Scene-linear light, and no log encoding to go to.
    plain = tmp_path / "plain.ocio"
    config = ocio.Config.CreateRaw()
    config.addColorSpace(ocio.ColorSpace(name="lin", encoding="scene-linear"))
    plain.write_text(config.serialize(), encoding="utf-8")
    with pytest.raises(Palette4dError, match="roles color_timing and compositing_log"):
        chosen(linear_clip, ocio_config=str(plain), input_space="lin")
    monkeypatch.setenv("OCIO", str(tmp_path / "gone.ocio"))
    with pytest.raises(Palette4dError, match=r"\$OCIO"):
        chosen(linear_clip)


# ------------------------------------------------------------------------ logs, displays, movies


@pytest.mark.parametrize(
    ("space", "extension", "samples"),
    [("ARRI LogC4", "exr", "half"), ("S-Log3 S-Gamut3.Cine", "exr", "float"),
     ("sRGB - Texture", "png", "uint16")],
)  # fmt: skip
def test_other_encodings_in_a_common_palette_space(
    tmp_path: Path, space: str, extension: str, samples: str
) -> None:
    """Camera logs and displays, palettes in ACEScct: as OpenColorIO there, our edit, and back."""
    config = ocio_config.load_config(STUDIO, "test")
    for frame in (1, 2):
        light = np.clip(scene(frame), 0, 1 if extension == "png" else None)
        encoded = through(config, "Linear Rec.709 (sRGB)", space, light).reshape(light.shape)
        if samples == "uint16":
            encoded = np.round(np.clip(encoded, 0, 1) * 65535).astype(np.uint16)
        write_image(tmp_path / f"c.{frame:04d}.{extension}", encoded, samples)
    clip, output = str(tmp_path / f"c.####.{extension}"), tmp_path / "c.p4d.json"
    assert "conversion" not in analyse(clip, output, "--input-space", space)["clip"]
    document = analyse(clip, output, "--input-space", space, "--palette-space", "ACEScct")
    assert document["clip"]["encoding"] == "ACEScct"
    document["edits"]["vertices"] = [
        {"vertex": document["polytope"]["vertices"][0]["id"], "rgb": [0.5, 0.2, 0.4]}
    ]
    read = sidecars.validate(document)
    image = open_clip(clip).read(1)
    found = Document(document).recolour(image, 1)
    cut = _core.slice_at(read.polytope, 1)
    recolourer = _core.Recolourer(
        cut.rgb, _core.edited_colours(read.polytope, read.edits, cut), cut.faces
    )
    own = through(config, space, "ACEScct", image).reshape(image.shape)
    moved = recolourer.apply(own, precision="single")
    wanted = through(config, "ACEScct", space, moved).reshape(image.shape)
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=2e-4)
    assert np.abs(found - image).max() > 0.02
    untouched = (moved == own).all(axis=-1)
    assert np.array_equal(found[untouched], image[untouched])


def test_bad_frames_and_movies(linear_clip: str, tmp_path: Path, capsys: Any) -> None:
    Path(linear_clip.replace("####", "0002")).write_bytes(b"no picture")
    output = tmp_path / "cg.p4d.json"
    arguments = ["analyze", linear_clip, "-o", str(output), "--quiet", "--input-space", "ACEScg"]
    assert main(arguments) == 1
    assert "frame 2" in capsys.readouterr().err
    assert main([*arguments, "--skip-bad-frames"]) == 0
    document = json.loads(output.read_text(encoding="utf-8"))
    assert document["clip"]["frames"]["skipped"] == [2]

    grey = [np.full((32, 48, 3), 40 * level, np.uint8) for level in (1, 2)]
    movie = write_movie(tmp_path / "m.mkv", "ffv1", "bgr0", grey, "rgb24")
    document = analyse(
        str(movie), tmp_path / "m.p4d.json",
        "--input-space", "g24_rec709_tx", "--palette-space", "ACEScct", "--allow-cuts",
    )  # fmt: skip
    # Grey 40 and 80 of 255 by a power of 2.4, in ACEScct.
    wanted = (np.log2((np.array([40, 80]) / 255) ** 2.4) + 9.72) / 17.52
    rgb = np.array([vertex["rgb"] for vertex in document["polytope"]["vertices"]])
    assert np.abs(rgb.min() - wanted[0]) < 0.01
    assert np.abs(rgb.max() - wanted[1]) < 0.01


def test_colours_beyond_an_encoding_s_end_are_told_and_come_back(
    tmp_path: Path, capsys: Any
) -> None:
    """Canon's log ends at code 1, where OpenColorIO clamps: our curves go on."""
    codes = np.random.default_rng(6).uniform(0.1, 1.2, (24, 32, 3)).astype(np.float32)
    write_image(tmp_path / "c.0001.exr", codes, "float")
    output = tmp_path / "c.p4d.json"
    spaces = ["--input-space", "CanonLog3 CinemaGamut D55", "--palette-space", "ACEScct"]
    document = analyse(str(tmp_path / "c.0001.exr"), output, *spaces)
    note = capsys.readouterr().err
    assert "of the clip's colours lie beyond what OpenColorIO brings back" in note
    read = _core.read_sidecar(output)
    assert read.conversion is not None
    own = read.conversion.steps.to_palette(codes)
    np.testing.assert_allclose(read.conversion.steps.to_clip(own), codes, atol=1e-9)
    document["edits"]["vertices"] = [
        {"vertex": vertex["id"], "rgb": [value + 0.01 for value in vertex["rgb"]]}
        for vertex in document["polytope"]["vertices"]
    ]
    moved = Document(document).recolour(codes, 1)
    assert np.isfinite(moved).all()
    assert 0 < np.median(np.abs(moved - codes)) < 0.05


def test_an_archive_that_is_none(linear_clip: str, tmp_path: Path) -> None:
    broken = tmp_path / "broken.ocioz"
    broken.write_bytes(b"PK no archive")
    with pytest.raises(Palette4dError, match=r"broken\.ocioz.*cannot use it as a config"):
        chosen(linear_clip, ocio_config=str(broken))
