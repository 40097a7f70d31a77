"""Check which room of the C++ sources includes which: `python tools/check_core_rooms.py`."""

import re
import sys
from pathlib import Path

OFX = Path(__file__).resolve().parents[1] / "ofx_plugin"

# Each room with the rooms it may include, besides itself. No room may appear above a room that
# includes it, so cycles are impossible. The node never sees `fit`, which serves the analysis alone.
ROOMS: dict[str, set[str]] = {
    "core/simd": set(),
    "core/threads": set(),
    "core/model": set(),
    "core/convert": {"model"},
    "core/sidecar": {"model", "convert"},
    "core/recolour": {"simd", "threads", "model", "convert"},
    "core/output": {"simd", "threads", "model", "convert", "recolour"},
    "core/fit": {"simd", "threads", "model"},
    "gpu": {"gpu/kernel", "simd", "model", "convert", "recolour", "output"},
    "node": {"model", "convert", "sidecar", "recolour", "output", "gpu"},
}
INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"', re.MULTILINE)


def problems() -> list[str]:
    """One line a fault: an include that its room may not make, or a room without a rule."""
    found = []
    for folder in (OFX / "core").iterdir():
        if folder.is_dir() and f"core/{folder.name}" not in ROOMS:
            found.append(f"{folder}: found no rule for this room, expected it in ROOMS")
    for room, allowed in ROOMS.items():
        for source in sorted((OFX / room).glob("*.?pp")):
            for included in INCLUDE.findall(source.read_text(encoding="utf-8")):
                folder = included.rpartition("/")[0]
                if not folder or folder == Path(room).name:
                    continue
                if folder not in allowed:
                    names = ", ".join(sorted(allowed)) or "no other room"
                    found.append(f'{source}: found #include "{included}", expected only {names}')
    return found


def main() -> int:
    """Print every fault; 1 if there is one."""
    faults = problems()
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
