"""The long work that the menus begin: each is a verb of the command line in a dialog."""

import contextlib
import functools
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QCheckBox, QFileDialog, QLineEdit

from palette4d import _core
from palette4d.analysis.options import METHODS
from palette4d.common.errors import Palette4dError
from palette4d.common.folders import home
from palette4d.media import clip_sequence
from palette4d.media.frame_writer import FORMATS
from palette4d.shows.manifest import ENDING
from palette4d.studio import texts
from palette4d.studio.former import Former
from palette4d.studio.paths import OWN_FOLDER, beside, place_for
from palette4d.studio.verb_dialog import Field, VerbDialog

if TYPE_CHECKING:
    from palette4d.studio.window import Window


KEEP_EDITS = "--keep-edits"
#: What becomes of the edits of an existing sidecar; texts.EDITS_NAMES has their names.
EDITS = ("", KEEP_EDITS, "--drop-edits")
#: How an edit plays movies of other rates.
CONFORM = ("", "by-rates", "frame-for-frame")
SHAPERS = ("", "auto", "none", "linear", "log")
MATRICES = ("", "601", "709", "2020")
CODECS = ("", "prores422hq", "prores4444", "dnxhr-hqx", "dnxhr-444", "h264", "hevc")
MISSING = ("", "hold", "black", "error")


def spaces(flag: str, dialog: VerbDialog) -> Iterable[str]:
    """Return the colour spaces of the config that a field has, or of the default one."""
    from palette4d.colour.ocio_config import chosen_config

    try:
        config, _ = chosen_config(dialog.value(flag) or None)
    except Palette4dError:  # the verb says why
        return []
    return map(str, config.getColorSpaceNames())


def formats(_: VerbDialog) -> Iterable[str]:
    """Return the formats of LUTs."""
    from palette4d.lut_export.formats import format_names

    return format_names()


def lut_fields(*left_out: str, usual: str = "") -> list[Field]:
    """Return the options that all LUTs have in common, without some; `usual` is the format."""
    config_spaces = functools.partial(spaces, "--ocio-config")
    found = [
        Field("--format", hint=usual or texts.FORMAT_HINT, listed=formats),
        Field("--size", hint=texts.SIZE_HINT, more=True),
        Field("--shaper", "", "choice", "", SHAPERS, texts.SHAPER_HINT, more=True),
        Field("--domain", kind="values", hint=texts.DOMAIN_HINT, more=True),
        Field("--space", hint=texts.LUT_SPACE_HINT, listed=config_spaces, more=True),
        Field("--ocio-config", kind="open", hint="$OCIO", more=True),
        Field("--clip", kind="open", hint=texts.LUT_CLIP_HINT, more=True),
    ]
    return [field for field in found if field.flag not in left_out]


def _make_own_folder() -> None:
    """Make the folder that is proposed; if it cannot be made, the verb says why."""
    with contextlib.suppress(OSError):
        (home() / OWN_FOLDER).mkdir(parents=True, exist_ok=True)


class VerbMenu:
    """The work of a window."""

    def __init__(self, window: "Window") -> None:
        self.window, self.session = window, window.session
        self.dialogs: list[VerbDialog] = []
        self.former = Former(self.session, lambda: self.window.banner.drop("notes"))

    def _verb(
        self,
        title: str,
        verb: str,
        fields: list[Field],
        done: Callable[[VerbDialog], object] | None = None,
    ) -> VerbDialog:
        session = self.session
        session.save()
        dialog = VerbDialog(self.window, title, verb, fields, session.post, done, self._unsaved)
        own = home() / OWN_FOLDER
        for field in fields:
            if field.kind in ("save", "folder") and own == Path(field.value).parent:
                dialog.started.connect(_make_own_folder)
                self.session.say(texts.ELSEWHERE.format(folder=own), "warning")
        dialog.show()
        self.dialogs.append(dialog)
        dialog.destroyed.connect(lambda: self.dialogs.remove(dialog))
        return dialog

    def _unsaved(self) -> str:
        """Return why the edits of the window are not in the file that a verb reads; else ""."""
        if self.session.following:
            return texts.STILL_FOLLOWING
        return "" if self.session.save() else self.session.status.text

    @property
    def _clip_source(self) -> str:
        return "" if self.session.clip is None else self.session.clip.source

    def analyze(self) -> VerbDialog:
        """Find the palette of a clip."""
        source = self._clip_source
        out = ""
        if source:
            path = Path(source)
            # The name by which the node finds it, see docs/node.md.
            stem = _core.clip_name(path.name) or path.absolute().parent.name
            out = str(place_for(path.with_name(f"{stem}.p4d.json")))
        return self._analyze(texts.ANALYZE, source, out)

    def try_sample(self) -> None:
        """Open the sample clip with its palette; the first time they are made, with progress."""
        folder = home() / OWN_FOLDER / "sample"
        clip, sidecar = folder / "sample.####.png", folder / "sample.p4d.json"
        if sidecar.is_file():
            self.window.open_path(str(sidecar))
            return

        def analyze(dialog: VerbDialog) -> None:
            dialog.close()
            self.window.open_path(str(clip))
            self.dialogs[-1].start()

        fields = [
            Field("-o", texts.CLIP, "save", str(clip)),
            Field("--force", kind="check", value="yes"),
        ]
        self._verb(texts.TRY_SAMPLE, "sample-clip", fields, analyze).start()

    def choose_space(self) -> VerbDialog:
        """Ask for the clip's colour space, and find the palette in it."""
        dialog = self.analyze() if self.session.document is None else self.analyze_again()
        dialog.go_to("--input-space")
        return dialog

    def analyze_show(self, path: str) -> VerbDialog:
        """Find the palettes of the shots of an edit (.otio, .edl)."""
        folder = place_for(Path(f"{Path(path).with_suffix('')}_shots"))
        return self._verb(
            texts.ANALYZE,
            "analyze",
            [
                Field("", texts.SHOW, "open", path),
                Field("-o", texts.FOLDER, "folder", str(folder)),
                Field("--media", kind="folder", hint=texts.MEDIA_HINT),
                Field("--rate", hint=texts.EDL_RATE_HINT),
                Field("--conform", "", "choice", "", CONFORM, texts.CONFORM_HINT, more=True),
                Field("--force", texts.ALSO_DONE, "check", more=True),
                self._input_space(more=True),
                *self._search_fields(),
            ],
            self._open_result,
        )

    def analyze_again(self) -> VerbDialog:
        """Find the palette of the document's clip again."""
        return self._analyze(
            texts.ANALYZE_AGAIN, self._clip_source, str(self.session.path or ""), KEEP_EDITS
        )

    def _analyze(self, title: str, clip: str, out: str, edits: str = "") -> VerbDialog:
        again = bool(edits)
        dialog = self._verb(
            title,
            "analyze",
            [
                Field("", texts.CLIP, "open", clip, hint=texts.CLIP_HINT),
                Field("-o", texts.SIDECAR, "save", out),
                Field("--frames", hint=texts.FRAMES_HINT.format(1001, 1100), more=again),
                self._input_space(),
                Field(
                    "", texts.EDITS, "choice", edits, EDITS, names=texts.EDITS_NAMES, more=not again
                ),
                Field("--like", kind="open", hint=texts.LIKE_HINT, more=True),
                Field("--rate", hint=texts.RATE_HINT, more=True),
                *self._search_fields(),
                Field("--matrix", "", "choice", "", MATRICES, texts.MATRIX_HINT, more=True),
                Field("--layer", hint=texts.LAYER_HINT, more=True),
                Field("--detect-shots", kind="check", more=True),
            ],
            self._open_result,
        )
        dialog.started.connect(lambda: self.former.keep(Path(dialog.value("-o"))))
        shots = dialog.entry("--detect-shots")
        assert isinstance(shots, QCheckBox)
        shots.toggled.connect(functools.partial(self._name_output, dialog, out))
        return dialog

    @staticmethod
    def _input_space(*, more: bool = False) -> Field:
        listed = functools.partial(spaces, "--ocio-config")
        return Field("--input-space", hint=texts.SPACE_HINT, listed=listed, more=more)

    @classmethod
    def _search_fields(cls) -> list[Field]:
        """Return the options that a clip and an edit have in common."""
        listed = functools.partial(spaces, "--ocio-config")
        return [
            Field("--vertices", hint=texts.VERTICES_HINT, more=True),
            Field("--palette-space", hint=texts.SPACE_HINT, listed=listed, more=True),
            Field("--ocio-config", kind="open", hint="$OCIO", more=True),
            Field("--method", "", "choice", "", ("", *METHODS), texts.METHOD_HINT, more=True),
            Field("--set", texts.SETTINGS, "words", hint=texts.SETTINGS_HINT, more=True),
            Field("--skip-bad-frames", kind="check", more=True),
            Field("--allow-cuts", kind="check", more=True),
            Field("--handles", hint=texts.HEAD_TAIL_HINT, more=True),
            Field("--only", hint=texts.ONLY_HINT, more=True),
        ]

    @staticmethod
    def _name_output(dialog: VerbDialog, sidecar: str, shots: bool) -> None:
        """Name the sidecar, or the folder for the sidecars of many shots."""
        folder = sidecar.removesuffix(".p4d.json") + "_shots"
        wanted, other = (folder, sidecar) if shots else (sidecar, folder)
        output = dialog.entry("-o")
        if isinstance(output, QLineEdit) and sidecar and output.text() == other:
            output.setText(wanted)

    def _open_result(self, dialog: VerbDialog) -> None:
        """Open the sidecar or the manifest that was written; what was noted stays in sight."""
        out, notes = Path(dialog.value("-o")), dialog.notes
        if out.is_dir():
            written = max(out.glob(f"*{ENDING}"), key=lambda path: path.stat().st_mtime)
            self.window.open_path(str(written))
        else:
            frame = self.session.frame
            self.window.open_path(str(out), dialog.value("") or None)
            self.session.go(frame)
            self.former.written(out)
        if notes:
            options, helps = dialog.advised, bool(dialog.advised) and not out.is_dir()
            again = {f"{texts.ANALYZE_AGAIN}…": lambda: self.analyze_again().offer(options)}
            self.window.banner.tell("notes", notes, "warning", again if helps else {})
        dialog.close()

    def render(self) -> VerbDialog:
        """Write the recoloured clip."""
        marks, clip = self.session.marks, self.session.clip
        own = self.session.frames[:2]
        if marks is None and clip is not None and own != (clip.frames[0], clip.frames[-1]):
            marks = own  # the palette is for these alone
        compared = ("", "wipe", "side")
        bits = ("", "8", "10", "16", "32")
        out = self._beside("_graded.mp4")
        if clip is not None and not clip.is_movie and len(clip.frames) > 1:
            kind = clip_sequence.extension(clip.file(clip.frames[0]))
            name = f"frame.####.{kind if kind in FORMATS else 'png'}"
            out = str(Path(self._beside("_graded")) / name)
        document = self.session.document
        used = () if document is None else document.grade.same_edits
        what = texts.A_VERSION.format(name=", ".join(used)) if used else texts.THE_GRADE
        return self._from_sidecar(
            f"{texts.RENDER} {what}",
            "render",
            Field("", texts.CLIP, "open", self._clip_source),
            Field("-o", texts.OUTPUT, "save", out),
            Field(
                "--frames",
                value="{}-{}".format(*marks) if marks else "",
                hint=texts.FRAMES_HINT.format(*own),
            ),
            Field("--compare", texts.COMPARE_LABEL, "choice", "", compared, texts.NO_COMPARE),
            Field("--codec", "", "choice", "", CODECS, texts.CODEC_HINT, more=True),
            Field("--crf", hint=texts.CRF_HINT, more=True),
            Field("--bits", "", "choice", "", bits, texts.BITS_HINT, more=True),
            Field("--half", kind="check", more=True),
            Field("--space", "", "choice", "", ("", "palette"), texts.LUT_SPACE_HINT, more=True),
            Field("--missing", texts.MISSING, "choice", "", MISSING, texts.MISSING_HINT, more=True),
            Field("--skip-bad-frames", kind="check", more=True),
            Field("--skip-existing", kind="check", more=True),
        )

    def _from_sidecar(self, title: str, verb: str, *fields: Field) -> VerbDialog:
        sidecar = Field("", texts.SIDECAR, "open", str(self.session.path))
        return self._verb(title, verb, [sidecar, *fields, Field("--force", kind="check")])

    def _beside(self, ending: str) -> str:
        assert self.session.path is not None
        return str(place_for(Path(beside(self.session.path, ending))))

    def bake(self) -> VerbDialog:
        """Write a LUT of this frame."""
        frame = str(self.session.frame)
        return self._from_sidecar(
            texts.BAKE,
            "bake",
            Field("--frame", texts.FRAME_FIELD, value=frame),
            Field("-o", texts.OUTPUT, "save", self._beside(f"_{frame}.cube")),
            *lut_fields(),
        )

    def export(self) -> VerbDialog:
        """Write LUTs over time."""
        return self._from_sidecar(
            texts.EXPORT,
            "export",
            Field("--every", value="1"),
            Field("--frames", hint=texts.NO_EVERY_HINT, more=True),
            Field("--stops", kind="check", more=True),
            Field("-o", texts.FOLDER, "folder", self._beside("_luts")),
            *lut_fields(usual="resolve_cube"),
        )

    def config(self) -> VerbDialog:
        """Write an OpenColorIO config with the looks."""
        return self._from_sidecar(
            texts.CONFIG_WORK,
            "config",
            Field("-o", texts.FOLDER, "folder", self._beside("_config")),
            Field("--base", kind="open", hint=texts.BASE_HINT),
            Field(
                "--process-space",
                hint=texts.PROCESS_SPACE_HINT,
                listed=functools.partial(spaces, "--base"),
            ),
            Field("--every", hint=texts.MIDDLE_HINT),
            Field("--frames", hint=texts.NO_EVERY_HINT, more=True),
            Field("--stops", kind="check", more=True),
            Field("--names", hint=texts.NAMES_HINT, more=True),
            Field("--anyway", kind="check", more=True),
            *lut_fields("--space", "--ocio-config", usual="clf"),
        )

    def install(self) -> VerbDialog:
        """Install the OpenFX node."""
        return self._verb(
            texts.INSTALL,
            "install-plugin",
            [
                Field("--dest", texts.FOLDER, "folder", str(home() / "OFX")),
                Field("--link", texts.LINK, "check"),
                Field("--kdenlive", "Kdenlive", "check"),
                Field("--shotcut", "Shotcut", "check"),
                Field("--force", kind="check"),
            ],
        )

    def copy_grade(self) -> VerbDialog | None:
        """Copy this grade to another shot, or to all shots of the list."""
        own = self.session.path
        show = self.window.shots.path
        if show is None:
            name, _ = QFileDialog.getOpenFileName(
                self.window, texts.COPY_TITLE, "", texts.SIDECAR_FILTER
            )
        if own is None or (show is None and not name):
            return None
        fields = [
            Field("", texts.TO_SHOT, "open", name if show is None else str(show)),
            Field("", texts.ACTION, "choice", "copy", ("copy",)),
            Field("", texts.FROM_SHOT, "open", str(own)),
        ]
        if show is not None:
            fields.append(Field("--shots", texts.SHOT_NAMES, value="*"))

        def done(_: VerbDialog) -> None:
            self.window.shots.draw()

        return self._verb(texts.COPY_GRADE, "edit", fields, done)
