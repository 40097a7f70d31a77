"""How many lines of the readers the fuzz corpora reach: `make fuzz-coverage`.

The corpora of tests/fuzz alone, so that every machine counts alike. It fails below a floor: then a
reader has grown, and its corpus has not.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

SIDECARS = ("tests/fuzz/corpus", "tests/golden/sidecars")
TARGETS = {
    "sidecar": SIDECARS,
    "copy": SIDECARS,
    "node": SIDECARS,
    "program": ("tests/fuzz/readers/program",),
}
#: Per cent of the lines of a room.
FLOORS = {"core/sidecar": 85.0, "node": 48.0}


def main(build: Path) -> int:
    """Run the targets on their corpora, print each file's share, and compare with the floors."""
    programs = [build / f"tests/fuzz/fuzz_{name}" for name in TARGETS]
    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "all.profdata"
        for program, corpora in zip(programs, TARGETS.values(), strict=True):
            subprocess.run(
                [program, "-runs=0", "-max_len=16384", "-verbosity=0", *corpora],
                env=os.environ | {"LLVM_PROFILE_FILE": f"{folder}/%p-%m.profraw"},
                stderr=subprocess.DEVNULL,
                check=True,
            )
        raw = sorted(Path(folder).glob("*.profraw"))
        subprocess.run(["llvm-profdata", "merge", "-o", profile, *raw], check=True)
        first, *others = [*programs, *build.glob("node/*/Contents/*/Palette4D.ofx")]
        objects = [word for other in others for word in ("-object", other)]
        command = ["llvm-cov", "export", "-summary-only", f"-instr-profile={profile}"]
        report = subprocess.run([*command, first, *objects], stdout=subprocess.PIPE, check=True)
    lines: Counter[str] = Counter()
    reached: Counter[str] = Counter()
    for file in json.loads(report.stdout)["data"][0]["files"]:
        room, _, name = file["filename"].rpartition("ofx_plugin/")[2].rpartition("/")
        count = file["summary"]["lines"]
        if room in FLOORS and count["count"]:
            lines[room] += count["count"]
            reached[room] += count["covered"]
            print(f"{count['percent']:5.1f} %  {count['count']:5}  {room}/{name}")
    failed = 0
    for room, floor in FLOORS.items():
        share = 100 * reached[room] / max(1, lines[room])
        failed += share < floor
        print(f"{room}: {share:.1f} % of {lines[room]} lines, expected {floor:g} % or more")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
