"""Configs: what a viewer shows at several frames, against the core; bases; refusals."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from palette4d.lut_export import config, series
from palette4d.lut_export.config import WrittenConfig, write_config
from palette4d.lut_export.frame_edit import frame_edit
from palette4d.lut_export.measured_write import BakeSettings
from posix_files import links

from palette4d import Palette4dError, _core
from palette4d.colour.difference import delta_e_2000, viewing_of
from palette4d.colour.ocio_config import BUILT_IN
from palette4d.jobs.workers import Workers

F32 = NDArray[np.float32]


def growing(path: Path) -> Path:
    """Let only the end of a cube's sidecar be edited: the edit grows from frame 0 to 10."""
    document = json.loads(path.read_text("utf-8"))
    document["edits"]["vertices"] = document["edits"]["vertices"][8:]
    path.write_text(json.dumps(document), "utf-8")
    return path


@pytest.fixture
def shot(warm_sidecar: Path) -> Path:
    return growing(warm_sidecar)


@pytest.fixture
def two_shots(write_sidecar: Callable[..., Path], tmp_path: Path) -> list[Path]:
    """shot010 turns white warm, shot020 turns it cold."""
    paths = []
    for name, white in (("shot010", (1.0, 0.8, 0.55)), ("shot020", (0.6, 0.8, 1.0))):
        path = growing(
            write_sidecar(lambda c, w=white: w if c == (1.0, 1.0, 1.0) else c, name=name)
        )
        paths.append(path.rename(tmp_path / f"{name}.p4d.json"))
    return paths


def options(step: int = 1, size: int = 9, **changes: object) -> dict[str, Any]:
    return {
        "settings": BakeSettings(size=size, format="clf"),
        "choose": lambda sidecar: series.every(sidecar, step),
        "workers": Workers(1),
        "anyway": True,
        **changes,
    }


def colours() -> F32:
    return np.random.default_rng(3).random((1, 500, 3), dtype=np.float32)


def shown(path: Path, variables: dict[str, str], transform: ocio.Transform) -> F32:
    """What a viewer with these context variables makes of `colours`."""
    ocio.ClearAllCaches()
    config = ocio.Config.CreateFromFile(str(path))
    config.validate()
    context = config.getCurrentContext()
    for name, value in variables.items():
        context[name] = value
    processor = config.getProcessor(context, transform, ocio.TRANSFORM_DIR_FORWARD)
    result = colours()
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(result)
    return result


def look(name: str, space: str = "sRGB - Texture") -> ocio.LookTransform:
    return ocio.LookTransform(src=space, dst=space, looks=name)


def core(sidecar: Path, frame: float) -> NDArray[np.float64]:
    edit = frame_edit(_core.read_sidecar(str(sidecar)), frame)
    return edit.exact(colours().reshape(-1, 3)).reshape(1, -1, 3)


def test_a_viewer_shows_the_look_of_its_frame(two_shots: list[Path], tmp_path: Path) -> None:
    done = write_config(two_shots, tmp_path / "show", **options())
    assert [s.name for s in done.shots] == ["shot010", "shot020"]
    assert [s.process_space for s in done.shots] == ["sRGB - Texture"] * 2
    assert done.notes == []
    seen = []
    for frame in (0, 1, 5, 10):
        for name, sidecar in zip(("shot010", "shot020"), two_shots, strict=True):
            want = core(sidecar, frame)
            variables = {"SHOT": name, "FRAME": str(frame)}
            # The shot's own look needs no SHOT, the look for all shots does.
            own = shown(done.path, {"FRAME": str(frame)}, look(name))
            np.testing.assert_allclose(own, want, atol=0.02)
            any_shot = shown(done.path, variables, look("palette4d"))
            np.testing.assert_array_equal(any_shot, own)
            seen.append(own)
    assert np.abs(seen[0] - colours()).max() < 1e-6  # nothing yet at frame 0
    assert np.abs(seen[-2] - seen[-1]).max() > 0.2  # the shots differ
    assert np.abs(seen[-2] - seen[-4]).max() > 0.05  # the frames differ


def test_frames_between_state_their_error(
    shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = write_config([shot], tmp_path / "every", **options())
    assert every.shots[0].between is None
    done = write_config([shot], tmp_path / "show", **options(5, size=17))
    between = done.shots[0].between
    assert between is not None
    assert not between.on_clip
    # The palette moves evenly over the frames: two frames away from a look is the worst.
    assert abs(between.frame - between.look) == 2
    # The look that is shown there, against the edit.
    got = shown(done.path, {"FRAME": str(between.frame)}, look("cube"))
    seen, wanted = (viewing_of("sRGB").lab(c[0]) for c in (got, core(shot, between.frame)))
    found = delta_e_2000(seen, wanted).max()
    assert 0.3 * between.delta_e < found < 1.1 * between.delta_e

    monkeypatch.setattr("palette4d.lut_export.config.LARGEST_DELTA_E", 0.9 * between.delta_e)
    with pytest.raises(Palette4dError, match=rf"frame {between.frame}.*every=….*anyway=True"):
        write_config([shot], tmp_path / "no", **options(5, anyway=False))
    assert not (tmp_path / "no").exists()
    finer = write_config([shot], tmp_path / "finer", **options(2, anyway=False)).shots[0].between
    assert finer is not None
    assert finer.delta_e < 0.9 * between.delta_e


def test_a_config_is_of_the_grade_of_its_start(
    shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Studio may save an edit while the frames between are looked at."""
    done = write_config([shot], tmp_path / "whole", **options(4))
    document, between = json.loads(shot.read_text("utf-8")), config.between_error

    def slow(*arguments: Any) -> Any:
        document["edits"] = {"vertices": [], "stops": []}
        shot.write_text(json.dumps(document), "utf-8")
        return between(*arguments)

    monkeypatch.setattr(config, "between_error", slow)
    edited = write_config([shot], tmp_path / "edited", **options(4))
    (one,), (other,) = done.shots, edited.shots
    assert one.between == other.between
    for frame in (0, 5, 10):
        seen = [shown(each.path, {"FRAME": str(frame)}, look("cube")) for each in (done, edited)]
        np.testing.assert_array_equal(*seen)


def test_a_stop_between_two_looks_is_found(
    write_sidecar: Callable[..., Path], tmp_path: Path
) -> None:
    """Both looks and the middle between them change nothing: only the stop's frame does."""
    path = write_sidecar()
    document = json.loads(path.read_text("utf-8"))
    white = [1.0, 1.0, 1.0]
    document["edits"]["stops"] = [
        {"id": f"s{k}", "edge": "e8", "frame": frame, "rgb": rgb}
        for k, (frame, rgb) in enumerate(((1, white), (2, [1.0, 0.6, 0.4]), (3, white)))
    ]
    path.write_text(json.dumps(document), "utf-8")
    with pytest.raises(Palette4dError, match="frame 2: deltaE"):
        write_config([path], tmp_path / "show", **options(10, anyway=False))


def test_views_apply_the_look(shot: Path, tmp_path: Path) -> None:
    done = write_config([shot], tmp_path / "show", **options(5))
    assert ("sRGB - Display", "Un-tone-mapped + palette4d") in done.views
    config = ocio.Config.CreateFromFile(str(done.path))
    base = ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
    assert config.getDefaultDisplay() == base.getDefaultDisplay()
    display = "sRGB - Display"
    assert config.getDefaultView(display) == base.getDefaultView(display)
    for view, edited in (("Un-tone-mapped", False), ("Un-tone-mapped + palette4d", True)):
        got = shown(
            done.path,
            {"SHOT": "cube", "FRAME": "10"},
            ocio.DisplayViewTransform(src="sRGB - Texture", display=display, view=view),
        )
        # An sRGB picture on an sRGB display without a tone curve: what is shown are its numbers.
        want = core(shot, 10) if edited else colours()
        np.testing.assert_allclose(got, want, atol=0.02)
        assert (np.abs(got - colours()).max() > 0.1) == edited


def test_without_variables_the_middle_is_shown(
    shot: Path, tmp_path: Path, ocio_tool: Callable[..., str]
) -> None:
    done = write_config([shot], tmp_path / "show", **options())
    assert "ERROR" not in ocio_tool("ociocheck", "--iconfig", done.path)
    got = shown(done.path, {}, look("palette4d"))
    np.testing.assert_array_equal(got, shown(done.path, {"FRAME": "5"}, look("cube")))
    assert np.abs(got - colours()).max() > 0.01


def test_variables_of_the_environment(
    shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a viewer does that is started with OCIO, SHOT and FRAME set."""
    done = write_config([shot], tmp_path / "show", **options(5))
    monkeypatch.setenv("OCIO", str(done.path))
    monkeypatch.setenv("SHOT", "cube")
    monkeypatch.setenv("FRAME", "10")
    ocio.ClearAllCaches()
    config = ocio.Config.CreateFromEnv()
    got = colours()
    config.getProcessor(look("palette4d")).getDefaultCPUProcessor().applyRGB(got)
    np.testing.assert_allclose(got, core(shot, 10), atol=0.02)
    assert np.abs(got - colours()).max() > 0.1


def test_frames_between_take_the_nearest_table(shot: Path, tmp_path: Path) -> None:
    done = write_config([shot], tmp_path / "show", **options(4))
    tables = tmp_path / "show" / "luts" / "cube"
    if os.name != "nt":  # copies there
        baked = sorted(p.name for p in tables.glob("*.clf") if not p.is_symlink())
        assert baked == ["cube.0.clf", "cube.4.clf", "cube.8.clf"]
    for frame, nearest in ((1, 0), (2, 0), (3, 4), (6, 4), (7, 8), (10, 8)):
        got = shown(done.path, {"FRAME": str(frame)}, look("cube"))
        want = shown(done.path, {"FRAME": str(nearest)}, look("cube"))
        np.testing.assert_array_equal(got, want)
    # The folder can be moved: links and paths are relative.
    moved = (tmp_path / "show").rename(tmp_path / "moved") / "config.ocio"
    np.testing.assert_array_equal(shown(moved, {"FRAME": "10"}, look("cube")), got)


@links
def test_files_that_config_did_not_make_stay(shot: Path, tmp_path: Path) -> None:
    tables = tmp_path / "show" / "luts" / "cube"
    tables.mkdir(parents=True)
    own, link = tables / "cube.7.clf", tables / "reference"
    own.write_text("made by hand")
    link.symlink_to("elsewhere")
    with pytest.raises(Palette4dError, match=r"cube\.7\.clf: found a file there already"):
        write_config([shot], tmp_path / "show", **options(4))
    assert own.read_text() == "made by hand"
    write_config([shot], tmp_path / "show", **options(4, force=True))
    assert own.is_symlink()
    assert link.readlink() == Path("elsewhere")


@links
def test_more_tables_replace_links(shot: Path, tmp_path: Path) -> None:
    write_config([shot], tmp_path / "show", **options(4))
    done = write_config([shot], tmp_path / "show", **options(2, force=True))
    (written,) = done.shots
    assert (written.baked.kept, written.baked.baked) == ([0, 4, 8], [2, 6, 10])
    tables = tmp_path / "show" / "luts" / "cube"
    assert sum(not p.is_symlink() for p in tables.glob("*.clf")) == 6
    assert len(list(tables.glob("*.clf"))) == 12  # 0 to 10, and the default


@links
def test_the_earlier_config_works_where_a_new_one_fails(shot: Path, tmp_path: Path) -> None:
    done = write_config([shot], tmp_path / "show", **options(4))
    frames = ["default", *map(str, range(11))]
    before = [shown(done.path, {"FRAME": frame}, look("cube")) for frame in frames]

    def interrupt(*_: int) -> None:
        raise KeyboardInterrupt

    for every in (2, 5):
        with pytest.raises(KeyboardInterrupt):
            write_config(
                [shot], tmp_path / "show", **options(every, force=True), progress=interrupt
            )
        after = [shown(done.path, {"FRAME": frame}, look("cube")) for frame in frames]
        # Looks that were baked before the end are the new ones already.
        same = [np.array_equal(*pair) for pair in zip(before, after, strict=True)]
        assert sum(same) >= len(frames) - 2
    write_config([shot], tmp_path / "show", **options(10, force=True))
    names = {p.name: p.is_symlink() for p in (tmp_path / "show/luts/cube").glob("*.clf")}
    assert [names[f"cube.{frame}.clf"] for frame in (0, 1, 9)] == [False, True, True]


@links
def test_looks_take_nothing_from_other_links(shot: Path, tmp_path: Path) -> None:
    """In a shared folder they may be a colleague's, who chooses content and mode of what they show.

    They are replaced, never written through nor read.
    """
    show, private = tmp_path / "show", tmp_path / "private"
    write_config([shot], show, **options(4))
    private.write_text("mine")
    private.chmod(0o4755)
    for frame in (2, 3, 4):
        (show / f"luts/cube/cube.{frame}.clf").unlink()
        (show / f"luts/cube/cube.{frame}.clf").symlink_to(private)
    made = write_config([shot], show, **options(2, force=True)).shots[0].baked
    assert (made.kept, made.baked) == ([0, 8], [2, 4, 6, 10])
    looks = {frame: show / f"luts/cube/cube.{frame}.clf" for frame in range(11)}
    assert [looks[frame].is_symlink() for frame in (2, 3, 4)] == [False, True, False]
    assert looks[3].readlink() == Path("cube.2.clf")
    assert all(path.stat().st_mode & 0o7111 == 0 for path in looks.values())
    assert private.read_text() == "mine"


class TestBase:
    def own(self, tmp_path: Path, *, environment: bool = False, files: str = "files") -> Path:
        """A small config with a file of its own in a search path."""
        folder = tmp_path / "base"
        (folder / files).mkdir(parents=True)
        (folder / files / "half.spi1d").write_text(
            "Version 1\nFrom 0.0 1.0\nLength 2\nComponents 1\n{\n0.0\n0.5\n}\n", "utf-8"
        )
        config = ocio.Config.CreateRaw()
        config.addSearchPath(files)
        if environment:
            config.addEnvironmentVar("SHOT", "theirs")
        config.addColorSpace(ocio.ColorSpace(name="srgb_tx"))
        half = ocio.ColorSpace(name="half")
        half.setTransform(ocio.FileTransform(src="half.spi1d"), ocio.COLORSPACE_DIR_FROM_REFERENCE)
        config.addColorSpace(half)
        config.addDisplayView("screen", "Half", "half", "")
        path = folder / "config.ocio"
        path.write_text(config.serialize(), "utf-8")
        return path

    @pytest.mark.parametrize("files", ["files", "luts"])
    def test_its_own_files_are_still_found(self, files: str, shot: Path, tmp_path: Path) -> None:
        base = self.own(tmp_path, files=files)
        before = base.read_bytes()
        done = write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        assert base.read_bytes() == before
        assert any("still read from" in note for note in done.notes)
        transform = ocio.DisplayViewTransform(
            src="srgb_tx", display="screen", view="Half + palette4d"
        )
        got = shown(done.path, {"SHOT": "cube", "FRAME": "10"}, transform)
        np.testing.assert_allclose(got, core(shot, 10) / 2, atol=0.02)

    def test_one_of_palette4d(self, two_shots: list[Path], tmp_path: Path) -> None:
        """A second shot is added, and the first one changed, from another folder."""
        first = write_config(two_shots[:1], tmp_path / "first", **options(10))
        with pytest.raises(Palette4dError, match=r"has a look 'palette4d' already.*force=True"):
            write_config(two_shots[1:], tmp_path / "show", **options(10, base=str(first.path)))
        names = [_core.read_sidecar(str(path)).clip["name"] for path in two_shots]
        found = options(10, base=str(first.path), force=True)
        done = write_config(two_shots[1:], tmp_path / "show", **found)
        for name, path in zip(names, two_shots, strict=True):
            got = shown(done.path, {"SHOT": name, "FRAME": "10"}, look("palette4d"))
            np.testing.assert_allclose(got, core(path, 10), atol=0.02)
        document = json.loads(two_shots[0].read_text("utf-8"))
        document["edits"]["vertices"] = [{"vertex": "v16", "rgb": [0.2, 0.9, 0.4]}]
        two_shots[0].write_text(json.dumps(document), "utf-8")
        done = write_config(two_shots[:1], tmp_path / "again", **found)
        got = shown(done.path, {"SHOT": names[0], "FRAME": "10"}, look("palette4d"))
        np.testing.assert_allclose(got, core(two_shots[0], 10), atol=0.02)

    def test_files_that_it_lacks(self, shot: Path, tmp_path: Path) -> None:
        base = self.own(tmp_path)
        (tmp_path / "base" / "files" / "half.spi1d").unlink()
        with pytest.raises(
            Palette4dError, match=r"OpenColorIO refuses .*'half.spi1d' could not be"
        ):
            write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        assert not (tmp_path / "show" / "config.ocio").exists()

    def test_an_archive(self, shot: Path, tmp_path: Path) -> None:
        base = ocio.Config.CreateFromFile(str(self.own(tmp_path)))
        base.archive(str(tmp_path / "base.ocioz"))
        done = write_config(
            [shot], tmp_path / "show", **options(5, base=str(tmp_path / "base.ocioz"))
        )
        assert done.notes == []
        (tmp_path / "base.ocioz").unlink()
        (tmp_path / "base").rename(tmp_path / "gone")
        transform = ocio.DisplayViewTransform(
            src="srgb_tx", display="screen", view="Half + palette4d"
        )
        got = shown(done.path, {"SHOT": "cube", "FRAME": "10"}, transform)
        np.testing.assert_allclose(got, core(shot, 10) / 2, atol=0.02)

    def test_its_variables_keep_working(
        self, shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        base = self.own(tmp_path)
        text = base.read_text("utf-8").replace("environment:\n  {}\n", "")
        assert "environment" not in text
        base.write_text(text.replace("search_path: files", "search_path: $WHERE"), "utf-8")
        monkeypatch.setenv("WHERE", str(base.parent / "files"))
        done = write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        assert any("WHERE" in note for note in done.notes)
        monkeypatch.delenv("WHERE")
        got = shown(done.path, {}, ocio.ColorSpaceTransform(src="srgb_tx", dst="half"))
        np.testing.assert_allclose(got, colours() / 2, atol=1e-6)

    def test_a_variable_may_hold_a_folder_beside_the_base(self, shot: Path, tmp_path: Path) -> None:
        base = self.own(tmp_path)
        text = base.read_text("utf-8").replace("search_path: files", "search_path: $WHERE")
        text = text.replace("environment:\n  {}\n", "")
        line = next(line for line in text.splitlines() if line.startswith("search_path"))
        base.write_text(text.replace(line, f"environment: {{WHERE: files}}\n{line}"), "utf-8")
        done = write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        got = shown(done.path, {}, ocio.ColorSpaceTransform(src="srgb_tx", dst="half"))
        np.testing.assert_allclose(got, colours() / 2, atol=1e-6)

    def test_the_value_of_a_variable_that_is_no_path_stays_out(
        self, shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        base = self.own(tmp_path)
        text = base.read_text("utf-8").replace("environment:\n  {}\n", "")
        base.write_text(text.replace("search_path: files", "search_path: files:$TOKEN"), "utf-8")
        monkeypatch.setenv("TOKEN", "tulip")
        done = write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        assert any("TOKEN" in note for note in done.notes)
        assert "tulip" not in done.path.read_text("utf-8") + " ".join(done.notes)

    @links
    def test_links_in_the_place_of_its_folders_lead_nowhere(
        self, shot: Path, tmp_path: Path
    ) -> None:
        base = ocio.Config.CreateFromFile(str(self.own(tmp_path)))
        base.archive(str(tmp_path / "base.ocioz"))
        victim = tmp_path / "victim"
        victim.mkdir()
        (victim / "link").symlink_to("somewhere")
        for name in ("luts", "luts/cube", "base"):
            folder = tmp_path / ("of_" + name.replace("/", "_"))
            place = folder / name
            place.parent.mkdir(parents=True)
            place.symlink_to(victim)
            with pytest.raises(Palette4dError, match="found a link"):
                write_config([shot], folder, **options(5, base=str(tmp_path / "base.ocioz")))
            assert [path.name for path in victim.iterdir()] == ["link"]

    def test_a_declared_variable_is_kept(self, shot: Path, tmp_path: Path) -> None:
        base = self.own(tmp_path, environment=True)
        done = write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        assert done.notes[-1] == "the base's default of the variable SHOT is kept"
        got = shown(done.path, {"SHOT": "cube", "FRAME": "10"}, look("palette4d", "srgb_tx"))
        np.testing.assert_allclose(got, core(shot, 10), atol=0.02)

    def test_found_by_what_it_does(self, shot: Path, tmp_path: Path) -> None:
        """No name says sRGB, but the roles lead there."""
        config = ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
        space = config.getColorSpace("srgb_tx")
        config.removeColorSpace("sRGB - Texture")
        for alias in list(space.getAliases()):
            space.removeAlias(alias)
        space.setName("monitor stuff")
        for role in ("color_picking", "matte_paint"):
            config.setRole(role, "monitor stuff")
        config.addColorSpace(space)
        base = tmp_path / "base.ocio"
        base.write_text(config.serialize(), "utf-8")
        done = write_config([shot], tmp_path / "show", **options(5, base=str(base)))
        assert done.shots[0].process_space == "monitor stuff"


def test_shots_in_two_encodings(write_sidecar: Callable[..., Path], tmp_path: Path) -> None:
    paths = []
    for name, encoding in (("a", "sRGB"), ("b", "ACEScct")):
        path = write_sidecar(lambda c: (c[0], c[1] * 0.8, c[2]), name=name, encoding=encoding)
        paths.append(path.rename(tmp_path / f"{name}.p4d.json"))
    done = write_config(paths, tmp_path / "show", **options(10))
    assert [s.process_space for s in done.shots] == ["sRGB - Texture", "ACEScct"]
    assert done.views == []
    assert any("2 encodings" in note for note in done.notes)
    for name, path, space in zip("ab", paths, ("sRGB - Texture", "ACEScct"), strict=True):
        got = shown(done.path, {"FRAME": "10"}, look(name, space))
        np.testing.assert_allclose(got, core(path, 10), atol=1e-5)
    # One whose encoding nobody knows gets the colour space that is given, the others keep theirs.
    unknown = write_sidecar(lambda c: c, name="c", encoding="unknown")
    given = options(10, process_space="Linear Rec.709 (sRGB)")
    done = write_config([*paths, unknown], tmp_path / "three", **given)
    spaces = ["sRGB - Texture", "ACEScct", "Linear Rec.709 (sRGB)"]
    assert [s.process_space for s in done.shots] == spaces
    assert sum("the config knows its encoding" in note for note in done.notes) == 2


class TestRefusals:
    def refused(
        self, sidecars: list[Path], tmp_path: Path, word: str, chosen: dict[str, Any] | None = None
    ) -> None:
        before = sorted(tmp_path.rglob("*"))
        with pytest.raises(Palette4dError, match=word):
            write_config(sidecars, tmp_path / "show", **(chosen or options()))
        assert sorted(tmp_path.rglob("*")) == before

    def test_two_shots_of_one_name(self, two_shots: list[Path], tmp_path: Path) -> None:
        copy = tmp_path / "copy.p4d.json"
        copy.write_bytes(two_shots[0].read_bytes())
        self.refused([two_shots[0], copy], tmp_path, "two shots have the name 'shot010'.*names=…")
        self.refused(two_shots, tmp_path, "two shots", options(names=("a", "A")))
        self.refused(two_shots, tmp_path, "1 names for 2", options(names=("a",)))
        self.refused(two_shots, tmp_path, "expected letters", options(names=("a", "b/c")))
        self.refused(two_shots, tmp_path, "for all shots", options(names=("a", "palette4d")))

    def test_names_mend_it(self, two_shots: list[Path], tmp_path: Path) -> None:
        copies = [two_shots[0], tmp_path / "copy.p4d.json"]
        copies[1].write_bytes(two_shots[0].read_bytes())
        done = write_config(copies, tmp_path / "show", **options(10, names=("a", "b")))
        assert [s.name for s in done.shots] == ["a", "b"]

    def test_no_such_base(self, shot: Path, tmp_path: Path) -> None:
        self.refused([shot], tmp_path, "found no config there", options(base="no.ocio"))
        self.refused([shot], tmp_path, "has no such config", options(base="ocio://no"))
        self.refused([shot], tmp_path, "cannot use it as a config", options(base=str(shot)))

    def test_a_base_without_the_space_and_the_roles(self, shot: Path, tmp_path: Path) -> None:
        config = ocio.Config.CreateRaw()
        config.addColorSpace(ocio.ColorSpace(name="film log", aliases=["flog"]))
        base = tmp_path / "base.ocio"
        base.write_text(config.serialize(), "utf-8")
        word = "no colour space for 'sRGB'; it lacks the role.*process_space=….*film log"
        self.refused([shot], tmp_path, word, options(base=str(base)))
        for near, expected in (
            ("film lgo", "no such colour space .* such as 'film log'$"),
            ("fl0g", "such as 'film log'$"),
            ("raw", "holds data, not colours"),
        ):
            found = options(base=str(base), process_space=near)
            self.refused([shot], tmp_path, f'process_space="{near}": .*{expected}', found)
        chosen = options(10, base=str(base), process_space="film log")
        assert write_config([shot], tmp_path / "s", **chosen).shots[0].process_space == "film log"

    def test_an_unknown_encoding(self, write_sidecar: Callable[..., Path], tmp_path: Path) -> None:
        self.refused([write_sidecar(encoding="")], tmp_path, "does not say in which encoding")
        self.refused([write_sidecar(encoding="MyLog")], tmp_path, "no colour space for 'MyLog'")

    def test_a_config_that_is_there(self, shot: Path, tmp_path: Path) -> None:
        (tmp_path / "show").mkdir()
        (tmp_path / "show" / "config.ocio").write_text("mine", "utf-8")
        self.refused([shot], tmp_path, "force=True")

    def test_a_look_that_is_there(self, shot: Path, tmp_path: Path) -> None:
        first = write_config([shot], tmp_path / "first", **options(10))
        self.refused([shot], tmp_path, "has a look", options(base=str(first.path)))

    def test_a_frame_that_fails_leaves_no_config(self, shot: Path, tmp_path: Path) -> None:
        settings = BakeSettings(size=5, format="cc", max_error=1e-9)
        chosen = options(10, settings=settings)
        with pytest.raises(Palette4dError, match="shot cube, 1 frame:"):
            write_config([shot], tmp_path / "show", **chosen)
        assert not (tmp_path / "show" / "config.ocio").exists()


def test_adding_to_itself(two_shots: list[Path], tmp_path: Path) -> None:
    """A show grows: the second shot joins the config that the first is in."""
    first = write_config(two_shots[:1], tmp_path / "show", **options(10))
    second: WrittenConfig = write_config(
        two_shots[1:], tmp_path / "show", **options(10, base=str(first.path), force=True)
    )
    for name, sidecar in zip(("shot010", "shot020"), two_shots, strict=True):
        got = shown(second.path, {"SHOT": name, "FRAME": "10"}, look("palette4d"))
        np.testing.assert_allclose(got, core(sidecar, 10), atol=0.02)
        np.testing.assert_array_equal(got, shown(second.path, {"FRAME": "10"}, look(name)))
    views = list(ocio.Config.CreateFromFile(str(second.path)).getViews("sRGB - Display"))
    assert len(views) == len(set(views))
    assert not any(view.count("palette4d") > 1 for view in views)
