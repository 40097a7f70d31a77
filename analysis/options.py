"""The options of an analysis: one table of names, defaults, limits and methods.

Defaults are the paper's, where it has one. Methods are the methods that the option affects.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Mapping
from typing import Any

from palette4d.common.errors import Arg, Palette4dError

METHODS = {
    "skew": "only handles that are worth their cost (default)",
    "paper": "the paper's thresholds",
    "static": "one palette for the whole clip",
    "rgbt": "a convex hull in RGB and time",
}

#: The method of `like`, the palette of an earlier version.
LIKE = "like"

_SKEW, _PAPER = ("skew",), ("paper",)
_POLYTOPES, _HULLS = ("skew", "paper"), ("skew", "paper", "static")
_MOVED = (*_HULLS, LIKE)
_ALL = (*METHODS, LIKE)


def _option(
    default: float, low: float, high: float, text: str, methods: tuple[str, ...] = _ALL
) -> Any:
    metadata = {"default": default, "low": low, "high": high, "text": text, "methods": methods}
    return dataclasses.field(default=default, metadata=metadata)


@dataclasses.dataclass(frozen=True)
class AnalysisOptions:
    """Options of `palette4d analyze`. `OPTIONS` explains them, with `lambda` for `lambda_`.

    Raises
    ------
    Palette4dError
        When a value is outside its limits; the message names the option.
    """

    method: str = "skew"
    vertices: int = _option(0, 0, 1e6, "most handles; 0: all that are worth it", ("skew", "rgbt"))
    handle_cost: float = _option(
        0.0025, 0, 1e6, "least gain in L' that justifies a handle; fewer handles if higher", _SKEW
    )
    blocks: int = _option(3, 1, 1e6, "most blocks (ranges of frames with one topology)", _SKEW)
    palette_size: int = _option(
        14, 4, 24, "most colours of one frame's palette; a hull has no more than 8", _HULLS
    )
    merge_distance: float = _option(
        0.1, 0, 1, "colours of a frame's hull closer than this are merged", _POLYTOPES
    )
    separation: float = _option(
        0.15, 0, 1, "palette colours closer than this repel each other; 0: the paper", _MOVED
    )
    convexity: float = _option(3.0, 0, 1e6, "weight of convex palettes; 0: the paper", _MOVED)
    reach: float = _option(
        0.1, 0, 10, "pixels this far outside count twice; 0: once, as in the paper", _MOVED
    )
    colours: int = _option(32768, 64, 1e8, "most colours kept per frame, for the losses")
    coarse_colours: int = _option(
        2048, 64, 1e8, "the same for hulls, merging and removal; up to twice as many in short clips"
    )
    threads: int = _option(0, 0, 1024, "threads; 0: one per processor; never changes the result")
    lambda_: float = _option(50.0, 0, 1e6, "weight of the reconstruction loss, eq. 4")
    k: float = _option(50.0, 1, 1e9, "pixels that a palette colour is compared with, eq. 3")
    gamma: float = _option(
        0.01, 0, 1e6, "weight of smoothness in time, eq. 12", (*_POLYTOPES, "rgbt", LIKE)
    )
    alpha: float = _option(10.0, 0, 1e6, "merging: weight of a block's length, eq. 10", _POLYTOPES)
    beta: float = _option(1.0, 0, 1e6, "merging: weight of a palette's size, eq. 10", _POLYTOPES)
    hull_box: float = _option(
        0.15, 0, 10, "how far a colour may move when a frame's hull is refined", _HULLS
    )
    refinement_box: float = _option(
        0.1, 0, 10, "how far a colour may move in vertex refinement, section 5.5", _MOVED
    )
    eta1: float = _option(
        3.5, 1, 1e6, "merging stops above this multiple of the first loss, section 5.3.3", _PAPER
    )
    eta2: float = _option(
        3.0, 1, 1e6, "removal stops above this multiple of the first loss, section 5.4.2", _PAPER
    )
    removal_candidates: int = _option(
        10, 1, 1e6, "vertices tried for each removal, section 5.4.2", _PAPER
    )
    refinement_cycles: int = _option(3, 0, 1000, "rounds of vertex refinement, section 5.5", _PAPER)

    def __post_init__(self) -> None:
        """Refuse values outside their limits."""
        if self.method not in _ALL:
            raise Palette4dError(
                f"option method: found {self.method!r}, expected one of {', '.join(METHODS)}"
            )
        for name, option in OPTIONS.items():
            option.check(name, getattr(self, option.field))

    @classmethod
    def of(cls, method: str, settings: Mapping[str, object]) -> AnalysisOptions:
        """Return the options of a method with settings by their names in `OPTIONS`, or with "_".

        Raises
        ------
        Palette4dError
            A setting is unknown, out of range, or without effect on the method.
        """
        texts = (f"{name.rstrip('_')}={value}" for name, value in settings.items())
        given: dict[str, Any] = dict(map(parse_setting, texts))
        options = cls(method=method, **given)
        check_methods(method, given)
        return options

    def recorded(self) -> dict[str, float | int | str]:
        """Return what the sidecar records: everything that can change the result."""
        values: dict[str, float | int | str] = {"method": self.method}
        values |= {name: getattr(self, option.field) for name, option in OPTIONS.items()}
        del values["threads"]
        return values


@dataclasses.dataclass(frozen=True)
class Option:
    """One row of the table: a number from `low` to `high` that affects some methods."""

    field: str
    default: float
    low: float
    high: float
    text: str
    methods: tuple[str, ...]

    def check(self, name: str, value: float) -> None:
        """Refuse a value outside the limits."""
        if not math.isfinite(value) or not self.low <= value <= self.high:
            raise Palette4dError(
                f"option {name}: found {value}, expected a number from {self.low:.10g} to "
                f"{self.high:.10g}"
            )


#: All options but the method, by the names that users write and sidecars record.
OPTIONS = {
    field.name.rstrip("_"): Option(field.name, **field.metadata)
    for field in dataclasses.fields(AnalysisOptions)
    if field.metadata
}


def parse_setting(text: str) -> tuple[str, float]:
    """Return the field of `AnalysisOptions` and the value that `NAME=VALUE` sets.

    Raises
    ------
    Palette4dError
        For an unknown name, a text that is no such number, or a number outside the limits.

    >>> parse_setting("lambda=20")
    ('lambda_', 20.0)
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        raise Palette4dError(f"found {text!r}, expected NAME=VALUE, such as handle_cost=0.001")
    if name not in OPTIONS:
        near = difflib.get_close_matches(name, OPTIONS, n=3, cutoff=0.5) or list(OPTIONS)
        raise Palette4dError(f"found no option {name!r}, expected for example {', '.join(near)}")
    option = OPTIONS[name]
    kind = type(option.default)
    try:
        number = kind(value)
    except ValueError:
        what = "a whole number" if kind is int else "a number"
        raise Palette4dError(
            f"option {name}: found {value!r}, expected {what} from {option.low:.10g} to "
            f"{option.high:.10g}"
        ) from None
    option.check(name, number)
    return option.field, number


def check_methods(method: str, given: dict[str, Any]) -> None:
    """Refuse fields that have no effect with a method.

    Raises
    ------
    Palette4dError
        The message names the first such option, and the methods that use it.
    """
    for name, option in OPTIONS.items():
        if option.field in given and method not in option.methods:
            if method == LIKE:
                raise Palette4dError(
                    f"{name} has no effect with {Arg('like')}, which keeps the handles; leave one "
                    "out"
                )
            raise Palette4dError(
                f"{name} has no effect with {Arg('method', method)}; expected "
                f"{' or '.join(option.methods)}"
            )
