"""CDLs of a timeline: comments * ASC_SOP and * ASC_SAT in an EDL, metadata in other files."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Iterable
from typing import Any

_SOP = re.compile(r"\*?\s*ASC_SOP\s*:?\s*(.*)")
_SAT = re.compile(r"\*?\s*ASC_SAT\s*:?\s*(.*)")

Three = tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class Cdl:
    """An ASC CDL: slope, offset and power a channel, and saturation."""

    slope: Three = (1.0, 1.0, 1.0)
    offset: Three = (0.0, 0.0, 0.0)
    power: Three = (1.0, 1.0, 1.0)
    saturation: float = 1.0

    @property
    def metadata(self) -> dict[str, object]:
        """The member `cdl` of a clip's metadata, as OpenTimelineIO's EDL adapter names it."""
        sop = {"slope": list(self.slope), "offset": list(self.offset), "power": list(self.power)}
        return {"asc_sat": self.saturation, "asc_sop": sop}

    @classmethod
    def of_metadata(cls, fields: Any) -> Cdl | None:
        """Return the CDL of `metadata`; None if it is none."""
        try:
            sop, sat = fields["asc_sop"], float(fields["asc_sat"])
            triples = [tuple(map(float, sop[name])) for name in ("slope", "offset", "power")]
        except (KeyError, TypeError, ValueError):
            return None
        whole = all(len(three) == 3 for three in triples)
        if not whole or not all(map(math.isfinite, [sat, *itertools.chain(*triples)])):
            return None
        slope, offset, power = ((a, b, c) for a, b, c in triples)
        return cls(slope, offset, power, sat)

    @property
    def comments(self) -> tuple[str, str]:
        """The two comments of an EDL; six decimals, as programs write them."""
        triples = (self.slope, self.offset, self.power)
        sop = "".join("(" + " ".join(f"{v:.6f}" for v in three) + ")" for three in triples)
        return f"* ASC_SOP {sop}", f"* ASC_SAT {self.saturation:.6f}"


def is_cdl(comment: str) -> bool:
    """Whether a comment is a part of a CDL."""
    return bool(_SOP.match(comment) or _SAT.match(comment))


def of_comments(comments: Iterable[str]) -> Cdl | None:
    """Return the CDL of an event's comments; None without one, or if it cannot be read."""
    slope, offset, power = Cdl.slope, Cdl.offset, Cdl.power
    saturation, stated = 1.0, False
    for comment in comments:
        if match := _SOP.match(comment):
            numbers = _numbers(match[1])
            if len(numbers) != 9:
                return None
            slope, offset, power = ((numbers[i], numbers[i + 1], numbers[i + 2]) for i in (0, 3, 6))
            stated = True
        elif match := _SAT.match(comment):
            numbers = _numbers(match[1])
            if len(numbers) != 1:
                return None
            saturation, stated = numbers[0], True
    return Cdl(slope, offset, power, saturation) if stated else None


def _numbers(text: str) -> list[float]:
    try:
        numbers = [float(word) for word in re.split(r"[\s,()]+", text) if word]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
