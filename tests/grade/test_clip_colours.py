"""How much of the picture each track moves."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palette4d.cli.info import info_of
from palette4d.grade.clip_colours import ClipColours, track_shares
from palette4d.grade.document import Document

SPLIT = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_split.p4d.json"


def with_colours(colours: dict[int, list[list[float]]]) -> Document:
    fields: dict[str, Any] = json.loads(SPLIT.read_text(encoding="utf-8"))
    fields["colours"] = [{"frame": frame, "rgbw": rgbw} for frame, rgbw in colours.items()]
    return Document(fields)


def test_shares_are_the_mean_barycentric_weights() -> None:
    # Until frame 9 the palette is a tetrahedron, in which weights are barycentric.
    plain = Document.load(SPLIT)
    random, colours, expected = np.random.default_rng(3), {}, {}
    for frame in (0, 4, 8):
        palette = plain.grade.palette(frame)
        assert len(palette.rgb) == 4
        weights, pixels = random.dirichlet(np.ones(4), 5), random.dirichlet(np.ones(5))
        colours[frame] = np.column_stack([weights @ palette.rgb, pixels]).tolist()
        solved = np.linalg.solve(
            np.vstack([palette.rgb.T, np.ones(4)]), np.vstack([palette.rgb.T @ weights.T, [1] * 5])
        )
        for id_, share in zip(palette.ids, solved @ pixels, strict=True):
            track = next(t for t in plain.grade.tracks if id_ in (*t.vertices, *t.edges))
            expected.setdefault(track.name, {})[frame] = share
    document = with_colours(colours)
    found = track_shares(
        ClipColours(document.grade.core.polytope, document.fields()), document.grade.tracks
    )
    assert [*found] == [track.name for track in document.grade.tracks]
    for name, shares in expected.items():
        assert found[name].mean == pytest.approx(np.mean([*shares.values()]), abs=1e-3)
        assert found[name].most == pytest.approx(max(shares.values()), abs=1e-3)
        assert found[name].frame == max(shares, key=lambda frame: shares[frame])
    later = [share for name, share in found.items() if name not in expected]
    assert later
    assert all(share.mean == share.most == 0 for share in later)


def test_between_two_frames_the_colours_of_both_count_in_proportion() -> None:
    document = with_colours({0: [[0.1, 0.2, 0.3, 0.4]], 8: [[0.4, 0.5, 0.6, 0.8]]})
    clip = ClipColours(document.grade.core.polytope, document.fields())
    expected = [[0.1, 0.2, 0.3, 0.3], [0.4, 0.5, 0.6, 0.2]]
    np.testing.assert_allclose(clip.colours_at(2), expected, atol=1e-9)


def test_only_frames_that_have_the_track_count() -> None:
    # The light grey track begins after frame 9.
    grey = [[0.4, 0.4, 0.45, 1.0]]
    shares = [
        track_shares(
            ClipColours(document.grade.core.polytope, document.fields()), document.grade.tracks
        )
        for document in (with_colours({0: grey, 5: grey, 15: grey}), with_colours({15: grey}))
    ]
    assert shares[0]["v13"] == shares[1]["v13"]
    assert shares[0]["v13"].mean > 0.1
    assert shares[0]["v1"].mean != shares[1]["v1"].mean


def test_info_has_the_shares(capsys: pytest.CaptureFixture[str]) -> None:
    from palette4d.cli.info import _print_tracks

    document = with_colours(
        {0: [[0.5, 0.4, 0.3, 0.5], [0.3, 0.3, 0.3, 0.5]], 20: [[0.4] * 3 + [1]]}
    )
    info = info_of(document)
    assert all(0 <= track["share"] <= track["largest_share"] for track in info["tracks"])
    _print_tracks(info)
    assert capsys.readouterr().out.count(" % ") == len(info["tracks"])
    without = info_of(Document.load(SPLIT))
    assert {track["share"] for track in without["tracks"]} == {None}
    _print_tracks(without)
    assert "share" not in capsys.readouterr().out.lower()


def test_a_frame_whose_colours_have_no_pixels_counts_for_nothing() -> None:
    rows = {0: [[0.5, 0.4, 0.3, 1.0]], 10: [[0.3, 0.3, 0.3, 0.0]]}
    shares = [
        track_shares(
            ClipColours(document.grade.core.polytope, document.fields()), document.grade.tracks
        )
        for document in (with_colours(rows), with_colours({0: rows[0]}))
    ]
    assert shares[0] == shares[1]
