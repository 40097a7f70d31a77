"""Shots: names, splitting at cuts, handles that end at cuts."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from analysis_frames import mixture
from clip_files import write_image
from edits import movie, picture, sequence

from palette4d.common.errors import Palette4dError
from palette4d.media.clip import open_clip
from palette4d.shows import shots
from palette4d.shows.shots import Shot

CORNERS = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])


def shot(name: str, first: int = 0, last: int = 9) -> Shot:
    return Shot(name, "a.mov", first, last, (first, last))


def test_names_are_unlike_and_stay() -> None:
    named, changed = shots.numbered([shot("A"), shot("a", 5), shot("B"), shot("A", 5)])
    assert [one.name for one in named] == ["A", "a_f5", "B", "A_f5_2"]
    assert changed == ["a_f5", "A_f5_2"]
    # Another shot in between leaves the names of the others alone.
    more, _ = shots.numbered([shot("A"), shot("A", 3), shot("a", 5), shot("B")])
    assert [one.name for one in more] == ["A", "A_f3", "a_f5", "B"]


def test_names_of_an_earlier_run_stay_with_their_frames() -> None:
    former = [shot("A"), shot("a_f20", 20, 29), shot("A_f40", 40, 49), shot("A_f3", 3, 4)]
    former.append(shot("B"))

    def names(*firsts: int) -> list[str]:
        listed = [shot("A", at, at + 9) for at in firsts]
        return [one.name for one in shots.numbered(listed, former)[0]]

    assert names(40, 20, 0) == ["A_f40", "a_f20", "A"]
    # The same frames go before those that share some; most of them before fewer.
    assert names(21, 20, 45, 42) == ["A", "a_f20", "A_f45", "A_f40"]
    # One of other frames may have a name that is free.
    assert names(70, 80) == ["A", "A_f80"]


def test_names_go_with_the_media_where_several_have_one_name() -> None:
    def of(clip: str, first: int, name: str = "A") -> shots.Shot:
        return dataclasses.replace(shot(name, first, first + 9), clip=clip)

    former = [of("x/a.mov", 0), of("y/a.mov", 0, "A_f0"), of("y/a.mov", 50, "A_f50")]
    now = [of("y/a.mov", 1), of("y/a.mov", 50), of("z/a.mov", 0), of("x/a.mov", 5)]
    assert [one.name for one in shots.numbered(now, former)[0]] == ["A_f0", "A_f50", "A_f0_2", "A"]
    # Media that moved keep names by their frames.
    moved = [of("new/a.mov", 51), of("new/a.mov", 1)]
    assert [one.name for one in shots.numbered(moved, former)[0]] == ["A_f50", "A"]


def test_very_many_shots_of_one_name_are_named_at_once() -> None:
    many = [shot("A", at % 50, at % 50) for at in range(20_000)]
    named, _ = shots.numbered(many)
    again, _ = shots.numbered([dataclasses.replace(one, name="A") for one in named], named)
    assert {one.name for one in again} == {one.name for one in named}
    # A film that was cut from one movie, each shot trimmed since.
    film, _ = shots.numbered([shot("A", 100 * at, 100 * at + 90) for at in range(3000)])
    trimmed = [shot("A", 100 * at + 1, 100 * at + 90) for at in range(3000)]
    assert [one.name for one in shots.numbered(trimmed, film)[0]] == [one.name for one in film]


def test_a_movie_is_split_at_its_cut(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    clip = open_clip(str(movie(tmp_path / "a b.mov", 10, cut=6)))
    found = shots.detect(clip, lambda done, total: told.append((done, total)))
    assert [(one.name, one.frames, one.count) for one in found] == [
        ("a_b_s001", "0-5", 6),
        ("a_b_s002", "6-9", 4),
    ]
    assert told == [(i, 10) for i in range(1, 11)]


def test_bad_frames_are_passed_over(tmp_path: Path) -> None:
    pattern = sequence(tmp_path, "a", 1, 8)
    (tmp_path / "a.0004.png").unlink()
    clip = open_clip(str(pattern), skip_bad_frames=True)
    assert [one.frames for one in shots.detect(clip)] == ["1-8"]


def test_frames_of_which_nothing_shows_are_no_shots(tmp_path: Path) -> None:
    shown = np.concatenate([mixture(CORNERS, 1), np.ones((20, 30, 1), np.float32)], axis=2)
    black = np.zeros_like(shown)
    for i, pixels in enumerate([black] * 4 + [shown] * 5 + [black] * 4 + [shown] * 5, start=1):
        write_image(tmp_path / "fades" / f"a.{i}.exr", pixels)
    assert [one.frames for one in shots.detect(open_clip(str(tmp_path / "fades")))] == ["1-18"]
    # Where none shows anywhere alpha is not used, and colours alone tell.
    shown[..., 3] = 0
    for i, pixels in enumerate([black] * 5 + [shown] * 5, start=1):
        write_image(tmp_path / "cut" / f"a.{i}.exr", pixels)
    found = shots.detect(open_clip(str(tmp_path / "cut")))
    assert [one.frames for one in found] == ["1-5", "6-10"]


def test_frames_that_are_not_even_are_refused(tmp_path: Path) -> None:
    pattern = sequence(tmp_path, "a", 1, 8)
    with pytest.raises(Palette4dError, match="not evenly spaced"):
        shots.detect(open_clip(str(pattern), frames="1,2,4"))


@pytest.mark.parametrize(
    ("asked", "used", "left"),
    [
        ((0, 9), (1, 4), (0, 5)),
        ((0, 9), (7, 8), (6, 9)),
        ((2, 7), (3, 5), (2, 5)),
        ((2, 7), (6, 7), (6, 7)),
    ],
)
def test_handles_end_at_cuts(
    asked: tuple[int, int], used: tuple[int, int], left: tuple[int, int], tmp_path: Path
) -> None:
    path = movie(tmp_path / "a.mov", 10, cut=6)
    one = Shot("a", str(path), *asked, used=used)
    found = shots.trimmed(one, open_clip(str(path), frames=one.frames))
    assert (found.first, found.last) == left


@pytest.mark.parametrize("used", [(4, 7), (0, 9), (5, 6)])
def test_a_cut_inside_of_what_is_shown_is_refused(used: tuple[int, int], tmp_path: Path) -> None:
    path = movie(tmp_path / "a.mov", 10, cut=6)
    with pytest.raises(Palette4dError, match=r"begins at frame 6; .* Blade the edit there"):
        shots.trimmed(Shot("a", str(path), 0, 9, used), open_clip(str(path)))


def test_the_pictures_differ() -> None:
    assert (picture(0) != picture(1)).any()
