"""What a frame shows: the recoloured picture, a matte, or the palette below the picture.

The names and their meaning are those of the node's parameters, and the core draws for both.
"""

from dataclasses import dataclass
from typing import Literal

from palette4d.common.errors import Palette4dError

#: The colour space of each value of `lightness_of`, by the core's names; "auto": the picture's own.
LIGHTNESS_OF = {
    "auto": "",
    "rec709": "Rec.709",
    "rec2020": "Rec.2020",
    "p3": "P3-D65",
    "ap1": "ACEScg",
    "rec601": "Rec.601",
}
#: Limits of `Output.outside_at`, in code values.
NEAREST, FARTHEST = 1e-4, 100.0
#: The kinds of output that an id follows.
_OF_ID = ("weight", "pick")


@dataclass(frozen=True)
class Output:
    """What to draw; the defaults draw the recoloured picture.

    Attributes
    ----------
    show : str
        "recoloured"; "weight:ID", the matte of a vertex or stop, which follows its colour through
        time; "pick:ID", the matte of a pick or hold; "outside", the matte of the colours outside
        the palette; "palette", the recoloured picture with the frame's palette below.
    strength : float
        0 the original, 1 the edit.
    keep_lightness : float
        The share of the source's lightness that the recoloured picture keeps, 0..1.
    lightness_of : {"auto", "rec709", "rec2020", "p3", "ap1", "rec601"}
        Whose luminance weights define lightness; "auto": the image's colour space.
    mix : float
        0 the source, 1 the output.
    matte_in : {"picture", "alpha"}
        "picture": a matte is a grey picture. "alpha": it multiplies alpha.
    outside_at : float
        The distance from the palette, in its code values, at which "outside" is 1.
    clean_up : float
        The share of the change by picks that is filtered along the picture's edges, 0..1, so that
        codec blocks, soft chroma and rims do not show. The image must be the whole picture: its
        lower left corner is where the filter's cells begin.
    """

    show: str = "recoloured"
    strength: float = 1.0
    keep_lightness: float = 0.0
    lightness_of: str = "auto"
    mix: float = 1.0
    matte_in: Literal["picture", "alpha"] = "picture"
    outside_at: float = 0.05
    clean_up: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        kind = self.kind
        if kind not in ("recoloured", *_OF_ID, "outside", "palette") or (
            kind in _OF_ID and not self.id
        ):
            raise Palette4dError(
                f"found {self.show!r} to show, expected 'recoloured', 'weight:ID' with the id of "
                "a vertex or stop, 'pick:ID' with that of a pick or hold, 'outside' or 'palette'"
            )
        for name in ("strength", "keep_lightness", "mix", "clean_up"):
            if not 0 <= getattr(self, name) <= 1:
                raise Palette4dError(
                    f"found the {name.replace('_', ' ')} {getattr(self, name)}, expected 0 to 1"
                )
        if self.lightness_of not in LIGHTNESS_OF:
            raise Palette4dError(
                f"found lightness of {self.lightness_of!r}, expected one of "
                + ", ".join(LIGHTNESS_OF)
            )
        if self.matte_in not in ("picture", "alpha"):
            raise Palette4dError(
                f"found a matte in {self.matte_in!r}, expected 'picture' or 'alpha'"
            )
        if not NEAREST <= self.outside_at <= FARTHEST:
            raise Palette4dError(
                f"found outside at {self.outside_at}, expected {NEAREST:g} to {FARTHEST:g}"
            )

    @property
    def kind(self) -> str:
        """`show` without the id."""
        kind, colon, _ = self.show.partition(":")
        return kind if colon == "" or kind in _OF_ID else self.show

    @property
    def id(self) -> str:
        """The id of the handle whose weight is shown, or of the pick whose matte is; or ""."""
        return self.show.partition(":")[2]

    @property
    def in_alpha(self) -> bool:
        """Whether the output needs an alpha channel."""
        return self.kind in (*_OF_ID, "outside") and self.matte_in == "alpha"
