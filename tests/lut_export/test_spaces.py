"""Files in another colour space: transforms beside the 3D LUT in CLF, else within it."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from palette4d.lut_export.bake import bake
from palette4d.lut_export.bake_error import stated
from palette4d.lut_export.config import write_config
from palette4d.lut_export.frame_edit import frame_edit
from palette4d.lut_export.spaces import space_of, transforms

from palette4d import Palette4dError, _core
from palette4d.colour import ocio_config
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document
from palette4d.jobs.workers import Workers

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
SIDECAR = GOLDEN / "v1_scene_linear.p4d.json"  # lin_rec709, its palette in ACEScct
EVERY_STEP = GOLDEN / "v1_every_step.p4d.json"
PLAIN = GOLDEN / "v1_edited.p4d.json"
FRAME = 6.0

F32 = NDArray[np.float32]


@pytest.fixture(autouse=True)
def no_config(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OCIO", raising=False)


@pytest.fixture
def gentle(tmp_path: Path) -> Path:
    """The same palette with small edits, which a table of modest size holds."""
    document = sidecars.load(SIDECAR)
    document["edits"] = {"stops": [], "vertices": []}
    for vertex in document["polytope"]["vertices"][::3]:
        moved = [value + d for value, d in zip(vertex["rgb"], (0.02, -0.01, 0.015), strict=True)]
        document["edits"]["vertices"].append({"vertex": vertex["id"], "rgb": moved})
    path = tmp_path / "gentle.p4d.json"
    sidecars.save(document, path)
    return path


def scene() -> F32:
    """(32, 32, 3) scene-linear colours whose ACEScct lies within 0.1..0.9."""
    random = np.random.default_rng(4)
    light = np.exp2(random.uniform(-5, 4, (32, 32, 1))) * random.uniform(0.5, 1, (32, 32, 3))
    return light.astype(np.float32)


def applied(path: Path, colours: F32) -> F32:
    """What OpenColorIO makes of colours with a file."""
    transform = ocio.FileTransform(src=str(path), interpolation=ocio.INTERP_TETRAHEDRAL)
    processor = ocio.Config.CreateRaw().getProcessor(transform)
    result = np.ascontiguousarray(colours.copy())
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(result)
    return result


def through(source: str, target: str, colours: F32) -> F32:
    config = ocio.Config.CreateFromBuiltinConfig(ocio_config.BUILT_IN)
    result = np.ascontiguousarray(colours.copy())
    processor = config.getProcessor(source, target)
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(result)
    return result


def rendered(path: Path, colours: F32) -> F32:
    return Document.load(path).recolour(colours, FRAME)


@pytest.mark.parametrize("extension", [".clf", ".ctf"])
def test_a_list_of_transforms_has_the_conversion_beside_the_table(
    gentle: Path, tmp_path: Path, extension: str
) -> None:
    out = tmp_path / f"a{extension}"
    image = scene()
    result = bake(gentle, FRAME, out, size=65, clip=image)
    assert result.encoding == "Linear Rec.709 (sRGB)"
    assert "beside the 3D LUT" in str(result.conversion)
    kinds = [element.tag.rpartition("}")[2] for element in ET.parse(out).getroot()]
    assert kinds.count("LUT3D") == 1
    assert kinds.count("Log") == 2
    assert kinds.count("Matrix") == 2
    found, wanted = applied(out, image), rendered(gentle, image)
    relative = np.abs(found - wanted) / np.maximum(np.abs(wanted), 0.1)
    assert result.clip is not None
    # render is within 1e-4 of the core in the log, 0.07 % of the light, and no more.
    assert relative.max() < result.clip.worst.relative_largest + 2e-3
    assert relative.mean() < 2e-3
    assert (np.abs(wanted - image) > 0.01 * image).any()


def test_aces_look_transforms_take_and_return_ap0(
    gentle: Path, tmp_path: Path, ocio_tool: Callable[..., str]
) -> None:
    out = tmp_path / "look.clf"
    image = scene()
    result = bake(gentle, FRAME, out, size=65, space="ACES2065-1", clip=image)
    assert result.encoding == "ACES2065-1"
    root = ET.parse(out).getroot()
    for name in ("InputDescriptor", "OutputDescriptor"):
        (descriptor,) = [e.text for e in root if e.tag.endswith(name)]
        assert descriptor == "ACES2065-1"
    ap0 = through("Linear Rec.709 (sRGB)", "ACES2065-1", image)
    back = through("ACES2065-1", "Linear Rec.709 (sRGB)", applied(out, ap0))
    wanted = rendered(gentle, image)
    assert (np.abs(back - wanted) / np.maximum(np.abs(wanted), 0.1)).mean() < 2e-3
    steps = re.findall(r"<(\w+)Transform", ocio_tool("ociochecklut", out))
    assert steps == ["Matrix", "LogCamera", "Lut3D", "LogCamera", "Matrix"]


def test_a_table_holds_the_conversion_where_the_format_has_no_room(
    gentle: Path, tmp_path: Path
) -> None:
    out = tmp_path / "a.cube"
    image = scene()
    result = bake(gentle, FRAME, out, size=65, clip=image)
    assert result.shaper.kind == "log"  # scene-linear light: beyond 1
    assert "within the 3D LUT" in str(result.conversion)
    found, wanted = applied(out, image), rendered(gentle, image)
    relative = np.abs(found - wanted) / np.maximum(np.abs(wanted), 0.1)
    assert result.clip is not None
    assert relative.max() < result.clip.worst.relative_largest + 2e-3


def test_the_palette_s_own_numbers(gentle: Path, tmp_path: Path) -> None:
    out = tmp_path / "p.cube"
    result = bake(gentle, FRAME, out, space="palette", clip=scene())
    assert result.encoding == "ACEScct"
    assert result.conversion is None
    read = _core.read_sidecar(gentle)
    cct = through("Linear Rec.709 (sRGB)", "ACEScct", scene())
    wanted = frame_edit(read, FRAME).apply(cct)
    np.testing.assert_allclose(applied(out, cct), wanted, atol=2e-2)


def test_without_an_edit_every_space_gives_its_input_back(gentle: Path, tmp_path: Path) -> None:
    document = sidecars.load(gentle)
    document["edits"] = {"stops": [], "vertices": []}
    plain = tmp_path / "plain.p4d.json"
    sidecars.save(document, plain)
    for space in ("input", "palette", "ACES2065-1", "ARRI LogC4", "sRGB - Texture"):
        name = str(space_of(plain.read_bytes(), _core.read_sidecar(plain), space, None).name)
        colours = through("Linear Rec.709 (sRGB)", name, scene())
        out = tmp_path / f"{name.split()[0]}.clf"
        result = bake(plain, FRAME, out, size=9, space=space, clip=scene())
        assert result.identity
        np.testing.assert_allclose(applied(out, colours), colours, rtol=2e-5, atol=2e-5)


def test_transforms_are_the_steps() -> None:
    """Every kind of step, both ways, by OpenColorIO and by the core."""
    document: dict[str, Any] = json.loads(EVERY_STEP.read_text(encoding="utf-8"))
    steps = document["clip"]["conversion"]["steps"]
    config = ocio.Config.CreateRaw()
    colours = np.random.default_rng(0).uniform(0.1, 0.9, (1, 400, 3)).astype(np.float32)
    for step in [*steps, {**steps[0], "direction": "forward"}]:
        chain = _core.ColourConversion(json.dumps([step]))
        there, back = transforms((step,))
        for transform, wanted in (
            (there, chain.to_palette(colours)),
            (back, chain.to_clip(colours)),
        ):
            result = colours.copy()
            group = ocio.GroupTransform(transform)
            config.getProcessor(group).getOptimizedCPUProcessor(
                ocio.OPTIMIZATION_LOSSLESS
            ).applyRGB(result)
            # A curve's table has the spacing of half floats, and misses its bends by that.
            tolerance = 2e-3 if step["kind"] == "curve" else 1e-5
            np.testing.assert_allclose(result, wanted, rtol=tolerance, atol=tolerance)


def test_a_config_s_look_has_the_palette_s_space(gentle: Path, tmp_path: Path) -> None:
    written = write_config(
        [gentle],
        tmp_path / "show",
        choose=lambda sidecar: (6,),
        names=("shot",),
        workers=Workers(1),
        anyway=True,
    )
    assert written.shots[0].process_space == "ACEScct"
    config = ocio.Config.CreateFromFile(str(written.path))
    look = ocio.LookTransform(
        src="Linear Rec.709 (sRGB)", dst="Linear Rec.709 (sRGB)", looks="shot"
    )
    # The error is of ACEScct's numbers, and said to be.
    said = f"in ACEScct {stated(written.shots[0].error)}"
    assert config.getLook("shot").getDescription().endswith(said)
    assert written.shots[0].baked.document["frames"][0]["error_space"] == "ACEScct"
    context = config.getCurrentContext()
    context["FRAME"] = "6"
    result = scene()
    processor = config.getProcessor(context, look, ocio.TRANSFORM_DIR_FORWARD)
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(result)
    wanted = rendered(gentle, scene())
    assert (np.abs(result - wanted) / np.maximum(np.abs(wanted), 0.1)).mean() < 3e-3


@pytest.mark.parametrize(
    ("sidecar", "options", "words"),
    [
        (SIDECAR, {"space": "ACESgc"}, '"ACESgc".*ACEScg'),
        (SIDECAR, {"space": "Raw"}, "data, not colours"),
        (SIDECAR, {"space": "ACEScg", "ocio_config": "no.ocio"}, "no.ocio.*ocio_config=…"),
        (SIDECAR, {"space": "ACEScc"}, "expected at most 1e-05"),
        (EVERY_STEP, {"space": "ACEScg"}, "a display's.*does not know.*ocio_config=…"),
    ],
)
def test_spaces_that_cannot_be_reached(
    tmp_path: Path, sidecar: Path, options: dict[str, str], words: str
) -> None:
    out = tmp_path / "x.clf"
    frame = 0.0 if sidecar is EVERY_STEP else FRAME
    with pytest.raises(Palette4dError, match=words):
        bake(sidecar, frame, out, **options)  # type: ignore[arg-type]
    assert not out.exists()


def test_a_sidecar_without_a_conversion_is_baked_as_before(tmp_path: Path) -> None:
    first, second = tmp_path / "a.clf", tmp_path / "b.clf"
    bake(PLAIN, FRAME, first, size=5)
    bake(PLAIN, FRAME, second, size=5, space="palette")
    assert first.read_bytes() == second.read_bytes()
