"""What does a bake cost, and how large is its error?

The peer is what `ociobakelut` does: OpenColorIO's baker, given the same edit. As it cannot ask the
core, the edit is given to it as a CLF of 129 samples a side, the largest that OpenColorIO reads;
what making that costs is stated apart. Both write a .cube of each size, in turn, and the errors of
both are measured against the exact core on the clip's colours at that frame.

    python benchmarks/bench_bake.py SIDECAR --frame T [--clip CLIP] [--sizes 17,33,50,65] [--runs 5]
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio
from palette4d.lut_export import lut3d
from palette4d.lut_export.bake import bake
from palette4d.lut_export.bake_error import Figures, load, measure
from palette4d.lut_export.frame_edit import frame_edit
from palette4d.lut_export.shaper import UNSHAPED
from palette4d.lut_export.writers import Description, by_baker, by_transforms

from palette4d import _core
from palette4d.colour.difference import viewing_of
from palette4d.media.source_clip import frame_colours

CUBE = by_baker("resolve_cube")
CLF = by_transforms("Academy/ASC Common LUT Format")
NOTHING = Description(identifier="urn:uuid:00000000-0000-0000-0000-000000000000", name="benchmark")


def by_ocio(source: Path, target: Path, size: int) -> None:
    """Bake as ociobakelut does: a conversion between two spaces of a config, read from a file."""
    ocio.ClearAllCaches()
    config = ocio.Config.CreateRaw()
    config.addColorSpace(ocio.ColorSpace(name="before"))
    after = ocio.ColorSpace(name="after")
    after.setTransform(ocio.FileTransform(src=str(source)), ocio.COLORSPACE_DIR_FROM_REFERENCE)
    config.addColorSpace(after)
    baker = ocio.Baker()
    baker.setConfig(config)
    baker.setFormat("resolve_cube")
    baker.setInputSpace("before")
    baker.setTargetSpace("after")
    baker.setCubeSize(size)
    target.write_text(baker.bake(), encoding="utf-8")


def seconds(work: Callable[[], object]) -> float:
    """Return how long a call takes."""
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("sidecar", type=Path)
    parser.add_argument("--frame", type=float, required=True)
    parser.add_argument("--clip")
    parser.add_argument("--sizes", default="17,33,50,65")
    parser.add_argument("--runs", type=int, default=5)
    args = parser.parse_args()
    sidecar = _core.read_sidecar(str(args.sidecar))
    image, number = frame_colours(args.sidecar, sidecar.clip, args.frame, args.clip)
    edit = frame_edit(sidecar, args.frame)
    viewing = viewing_of(sidecar.clip["encoding"])
    colours = lut3d.dense_grid(UNSHAPED) if image is None else np.asarray(image[..., :3])
    where = "a dense grid" if image is None else f"the clip's colours at frame {number}"

    def error(path: Path) -> Figures:
        found = measure(colours, load(path, ["tetrahedral"]), edit, viewing)
        assert found is not None
        return found.worst

    with tempfile.TemporaryDirectory() as folder:
        big, ours, theirs = (Path(folder) / name for name in ("big.clf", "ours.cube", "peer.cube"))

        def make_big() -> None:
            big.write_text(CLF(lut3d.sample(edit, 129), NOTHING), encoding="utf-8")

        print(
            f"wall seconds and errors, medians of {args.runs} runs; errors on {where}, tetrahedral"
        )
        made = statistics.median(seconds(make_big) for _ in range(args.runs))
        print(f"the peer's source, a CLF of 129 a side: {made:.2f} s, once\n")
        print(
            "size  palette4d   peer     ratio    with its error   mean error        largest error"
        )
        print("      table s     table s           stated, s        ours / peer       ours / peer")
        for size in map(int, args.sizes.split(",")):

            def table(size: int = size) -> None:
                text = CUBE(lut3d.sample(edit, size), NOTHING)
                ours.write_text(text, encoding="utf-8")

            def whole(size: int = size) -> None:
                bake(
                    args.sidecar,
                    args.frame,
                    Path(folder) / "whole.cube",
                    size=size,
                    shaper="none",
                    clip=image,
                    force=True,
                )

            def peer(size: int = size) -> None:
                by_ocio(big, theirs, size)

            times = [(seconds(table), seconds(peer), seconds(whole)) for _ in range(args.runs)]
            ratio = statistics.median(a / b for a, b, _ in times)
            own, other, all_ = (statistics.median(column) for column in zip(*times, strict=True))
            a, b = error(ours), error(theirs)
            print(
                f"{size:4d}  {own:9.3f}  {other:8.3f}  {ratio:6.2f}   {all_:14.3f}   "
                f"{a.relative_mean:.2e} / {b.relative_mean:.2e}  "
                f"{a.relative_largest:.4f} / {b.relative_largest:.4f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
