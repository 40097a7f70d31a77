"""Pictures of a drag from its first ones: what an edit adds to a pixel is linear in what it moves.

A recoloured pixel is p + sum_j (a_j(p) d_j + b_j(p) mean(d_j)), where d_j is the displacement of a
palette colour, or the change of a pick, whose light, its mean, has a weight of its own. The weights
stay while the palette and the mattes do; cleaning up is linear too. A drag moves few of the d_j. So
one picture for each tells its weights, and the others are sums. It knows no toolkit.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core

if TYPE_CHECKING:
    from palette4d.studio.preview import Grade

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

#: The most colours whose weights are worth a picture each.
MOST_MOVING = 3


class Moves:
    """What a grade moves at a time, and what the weights depend on."""

    def __init__(self, grade: "Grade") -> None:
        palette, picks = grade.palette, grade.picks
        self._grade = grade
        self._picks = [] if picks is None else picks.picks
        moved = np.asarray(palette.edited) - palette.rgb
        changes = np.array([change for _, change, _, _ in self._picks]).reshape(-1, 3)
        #: (n, 3) displacements of the palette's colours, and changes of the picks
        self.by = np.concatenate([moved, changes])

    def weighs_as(self, other: "Moves") -> bool:
        """Return whether the weights are those of other moves."""
        return (
            len(self._picks) == len(other._picks)
            and all(map(np.array_equal, self._fixed(), other._fixed()))
            and self._windows() == other._windows()
        )

    def _windows(self) -> list[Any]:
        """Return where in the picture the picks are."""
        return [] if self._grade.picks is None else self._grade.picks.windows

    def _fixed(self) -> list[Any]:
        """Return what decides the weights."""
        palette, picks = self._grade.palette, self._grade.picks
        left = None if picks is None else picks.left
        fixed = [palette.rgb, palette.faces, np.zeros(0) if left is None else left]
        for colour, _, strength, matte in self._picks:
            fixed += [colour, strength, matte]
        return fixed

    def drawn(self, source: F32, by: F64) -> F32:
        """Return (h, w, 3) pixels with other displacements and changes."""
        palette, picks, count = self._grade.palette, self._grade.picks, len(self._grade.palette.rgb)
        if picks is not None:
            picks = picks.with_changes(by[count:].tolist())
        moved = np.asarray(palette.rgb) + by[:count]
        recolourer = _core.Recolourer(palette.rgb, moved, palette.faces, picks=picks)
        if picks is not None and picks.count:
            return _core.draw(source, "recoloured", recolourer)
        return recolourer.apply(source, precision="single")


@dataclass
class Base:
    """A picture that was drawn, and the weights of colours that have moved since."""

    source: F32
    moves: Moves
    picture: F32
    #: (h, w) a and b of each colour that has moved
    weights: dict[int, tuple[F32, F32]] = field(default_factory=dict)


class Responses:
    """Pictures of the grades of a drag, one after another."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._base: Base | None = None

    def forget(self) -> None:
        """Forget the pictures."""
        self._base = None

    def picture(self, source: F32, grade: "Grade") -> F32:
        """Return (h, w, 3) pixels of the palette's space with a grade, within 1e-4 of it."""
        moves, base = Moves(grade), self._base
        if base is None or base.source is not source or not moves.weighs_as(base.moves):
            return self._begin(source, moves)
        by = (moves.by - base.moves.by).astype(np.float32)
        rows = np.flatnonzero(by.any(axis=1)).tolist()
        if len(rows) > MOST_MOVING:
            return self._begin(source, moves)
        result = base.picture.copy()
        part = np.empty_like(result)
        for row in rows:
            if row not in base.weights:
                base.weights[row] = self._weights(base, row)
            own, light = base.weights[row]
            np.multiply(own[..., None], by[row], out=part)
            result += part
            result += (light * by[row].mean())[..., None]
        return result

    @staticmethod
    def _weights(base: Base, row: int) -> tuple[F32, F32]:
        """Return a and b of a colour, from a picture in which its red has moved by 1."""
        unit = base.moves.by.copy()
        unit[row, 0] += 1
        added = base.moves.drawn(base.source, unit) - base.picture
        added[~np.isfinite(added)] = 0
        return added[..., 0] - added[..., 1], 3 * added[..., 1]

    def _begin(self, source: F32, moves: Moves) -> F32:
        picture = moves.drawn(source, moves.by)
        self._base = Base(source, moves, picture)
        return picture
