"""Movies with tags, fields, timecode and sound, and what independent programs say about a movie."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.sidedata.sidedata import Type
from numpy.typing import NDArray

from palette4d.grade import rendering
from palette4d.grade.document import Document

PLAIN = Document.load(Path(__file__).resolve().parent / "golden" / "sidecars" / "v1_split.p4d.json")
"""A sidecar without edits: renders are copies."""

_PRIMARIES = {1: "bt709", 5: "bt470bg", 6: "smpte170m", 9: "bt2020", 11: "smpte431"}
_PRIMARIES |= {12: "smpte432", 2: ""}
_TRANSFERS = {1: "bt709", 6: "smpte170m", 8: "linear", 13: "iec61966-2-1", 14: "bt2020-10"}
_TRANSFERS |= {16: "smpte2084", 17: "smpte428", 18: "arib-std-b67", 2: "", 4: "bt470m"}
_MATRICES = {1: "bt709", 5: "bt470bg", 6: "smpte170m", 9: "bt2020nc", 2: ""}


def render(source: Path, output: Path, **options: Any) -> rendering.Rendered:
    """Render a copy of a clip."""
    return rendering.render(PLAIN, source, output, force=True, **options)


@dataclasses.dataclass(frozen=True)
class Said:
    """What a program says about a movie's video, in FFmpeg's words; "" for what is unknown."""

    primaries: str
    transfer: str
    matrix: str
    range: str
    aspect: Fraction
    order: str
    timecode: str
    reel: str
    rate: Fraction
    sound: int


def said(movie: Path) -> Said:
    """What ffprobe says about a movie, or, without it, FFmpeg's libraries in PyAV."""
    return _by_ffprobe(movie) if shutil.which("ffprobe") else _by_pyav(movie)


def _by_ffprobe(movie: Path) -> Said:
    words = ["ffprobe", "-v", "error", "-of", "json", "-show_streams", "-show_format", str(movie)]
    found = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    video = next(one for one in found["streams"] if one["codec_type"] == "video")
    tags = [found["format"], *found["streams"]]

    def known(name: str) -> str:
        return {"unknown": ""}.get(text := video.get(name, ""), text)

    return Said(
        known("color_primaries"),
        known("color_transfer"),
        known("color_space"),
        known("color_range"),
        Fraction(video.get("sample_aspect_ratio", "1:1").replace(":", "/")),
        known("field_order"),
        _first(one.get("tags", {}).get("timecode") for one in tags),
        _first(one.get("tags", {}).get("reel_name") for one in tags),
        Fraction(video["avg_frame_rate"]),
        sum(one["codec_type"] == "audio" for one in found["streams"]),
    )


def _by_pyav(movie: Path) -> Said:
    with av.open(str(movie)) as container:
        stream = container.streams.video[0]
        picture = next(container.decode(stream))
        tags = [container.metadata, *(one.metadata for one in container.streams)]
        return Said(
            _PRIMARIES[int(picture.color_primaries)],
            _TRANSFERS[int(picture.color_trc)],
            _MATRICES[int(picture.colorspace)],
            ("", "tv", "pc")[int(picture.color_range)],
            Fraction(stream.sample_aspect_ratio or 1),
            ("", "progressive", "tt", "bb", "tb", "bt")[int(stream.codec_context.field_order)],
            _first(one.get("timecode") for one in tags),
            _first(one.get("reel_name") for one in tags),
            Fraction(stream.average_rate),
            len(container.streams.audio),
        )


def _first(texts: Any) -> str:
    return next((text for text in texts if text), "")


def words(primaries: int, transfer: int, matrix: int) -> tuple[str, str, str]:
    """FFmpeg's words for code points."""
    return _PRIMARIES[primaries], _TRANSFERS[transfer], _MATRICES[matrix]


def tiles(count: int = 2, size: tuple[int, int] = (128, 256), seed: int = 0) -> NDArray[np.uint8]:
    """Frames of flat tiles of 16 pixels, (count, h, w, 3)."""
    shape = (count, size[0] // 16, size[1] // 16, 3)
    found = np.random.default_rng(seed).integers(70, 190, shape)
    return np.kron(found, np.ones((1, 16, 16, 1))).astype(np.uint8)


def centres(pixels: NDArray[Any]) -> NDArray[Any]:
    """The middle of each tile, where chroma of neighbours does not reach."""
    return pixels[8::16, 8::16]


def movie(
    path: Path,
    frames: Sequence[NDArray[Any]],
    codec: str = "libx264",
    layout: str = "yuv420p",
    *,
    tags: tuple[int, int, int] = (2, 2, 2),
    full_range: bool = False,
    rate: Fraction = Fraction(24),
    options: dict[str, str] | None = None,
    fields: str = "",
    metadata: dict[str, str] | None = None,
    aspect: Fraction = Fraction(1),
    matrix: Sequence[int] | None = None,
    sound: str = "",
) -> Path:
    """Write R'G'B' frames (h, w, 3), or pictures of planes as they are, with all that is stated."""
    defaults = {"libx264": {"crf": "4"}, "prores_ks": {"profile": "hq"}}.get(codec, {})
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, options=defaults | (options or {}))
        context = stream.codec_context
        first = frames[0]
        stream.height, stream.width = (first[0] if isinstance(first, list) else first).shape[:2]
        stream.pix_fmt = layout
        context.color_primaries, context.color_trc, context.colorspace = tags
        context.color_range = 2 if full_range else 1
        context.sample_aspect_ratio = aspect
        if fields:
            context.field_order = {"tff": 2, "bff": 3}[fields]
        if matrix:
            stream.set_display_matrix(matrix)
        stream.metadata.update(metadata or {})
        heard = container.add_stream(sound, rate=48000) if sound else None
        flags = _flags(stream.width, stream.height, layout, fields)
        for number, pixels in enumerate(frames):
            picture = _picture(pixels, layout, tags, full_range)
            picture.pts, picture.time_base = number, 1 / rate
            container.mux(stream.encode(flags(picture)))
            if heard is not None:
                container.mux(heard.encode(_beep(number, rate, heard)))
        container.mux(stream.encode(None))
        if heard is not None:
            container.mux(heard.encode(None))
    return path


def _picture(
    pixels: NDArray[Any], layout: str, tags: tuple[int, int, int], full_range: bool
) -> av.VideoFrame:
    spread = 2 if full_range else 1
    if isinstance(pixels, list):
        picture = av.VideoFrame(pixels[0].shape[1], pixels[0].shape[0], layout)
        for plane, samples in zip(picture.planes, pixels, strict=True):
            lines = np.zeros((plane.height, plane.line_size // samples.itemsize), samples.dtype)
            lines[:, : samples.shape[1]] = samples
            plane.update(lines.tobytes())
    else:
        matrix = tags[2] if tags[2] in (1, 5, 6, 9) else 5
        picture = av.VideoFrame.from_ndarray(pixels, format="rgb24").reformat(
            format=layout, dst_colorspace=matrix, dst_color_range=spread
        )
    picture.color_primaries, picture.color_trc, picture.colorspace = tags
    picture.color_range = spread
    return picture


def _flags(width: int, height: int, layout: str, fields: str) -> Callable[[Any], Any]:
    if not fields:
        return lambda picture: picture
    graph = av.filter.Graph()
    source = graph.add_buffer(width=width, height=height, format=layout, time_base=Fraction(1, 25))
    chain = [source, graph.add("setfield", f"mode={fields}"), graph.add("buffersink")]
    chain[0].link_to(chain[1])
    chain[1].link_to(chain[2])
    graph.configure()

    def marked(picture: Any) -> Any:
        graph.push(picture)
        return graph.pull()

    return marked


def _beep(number: int, rate: Fraction, stream: Any) -> av.AudioFrame:
    """The sound of one frame, 16 bits, stereo; its loudness grows."""
    first, after = round(number * 48000 / rate), round((number + 1) * 48000 / rate)
    wave = np.sin(np.arange(first, after) / 20) * 100 * (number + 1)
    samples = np.repeat(wave.astype(np.int16), 2)[None]
    frame = av.AudioFrame.from_ndarray(samples, format="s16", layout="stereo")
    frame.sample_rate, frame.pts, frame.time_base = 48000, first, Fraction(1, 48000)
    return frame


def packets(path: Path, kind: str) -> list[tuple[Fraction, bytes]]:
    """Times and bytes of a movie's packets of a kind."""
    with av.open(str(path)) as container:
        return [
            (packet.pts * packet.time_base, bytes(packet))
            for packet in container.demux(**{kind: 0})
            if packet.size
        ]


def samples(path: Path, frame: int = 0) -> list[NDArray[Any]]:
    """The planes of a picture as the decoder gives them."""
    with av.open(str(path)) as container:
        for number, picture in enumerate(container.decode(video=0)):
            if number == frame:
                kind = np.uint8 if picture.format.components[0].bits == 8 else np.uint16
                return [
                    np.frombuffer(plane, kind).reshape(plane.height, -1)[:, : plane.width]
                    for plane in picture.planes
                ]
    raise AssertionError(f"{path} has no frame {frame}")


def display_matrix(path: Path) -> bool:
    """Whether a movie has a display matrix."""
    with av.open(str(path)) as container:
        picture = next(container.decode(video=0))
        return picture.side_data.get(Type.DISPLAYMATRIX) is not None
