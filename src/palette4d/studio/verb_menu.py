"""The long work that the menus begin: each is a verb of the command line in a dialog."""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QCheckBox, QFileDialog, QLineEdit

from palette4d import _core
from palette4d.analysis.options import METHODS
from palette4d.shows.manifest import ENDING
from palette4d.studio import texts
from palette4d.studio.paths import beside
from palette4d.studio.verb_dialog import Field, VerbDialog

if TYPE_CHECKING:
    from palette4d.studio.window import Window


KEEP_EDITS = "--keep-edits"
#: What becomes of the edits of an existing sidecar; texts.EDITS_NAMES has their names.
EDITS = ("", KEEP_EDITS, "--drop-edits")


class VerbMenu:
    """The work of a window."""

    def __init__(self, window: "Window") -> None:
        self.window, self.session = window, window.session
        self.dialogs: list[VerbDialog] = []

    def _verb(
        self,
        title: str,
        verb: str,
        fields: list[Field],
        done: Callable[[VerbDialog], object] | None = None,
    ) -> VerbDialog:
        self.session.save()
        dialog = VerbDialog(self.window, title, verb, fields, self.session.post, done)
        dialog.show()
        self.dialogs.append(dialog)
        dialog.destroyed.connect(lambda: self.dialogs.remove(dialog))
        return dialog

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
            out = str(path.with_name(f"{stem}.p4d.json"))
        return self._analyze(texts.ANALYZE, source, out)

    def analyze_show(self, path: str) -> VerbDialog:
        """Find the palettes of the shots of an edit (.otio, .edl)."""
        return self._verb(
            texts.ANALYZE,
            "analyze",
            [
                Field("", texts.SHOW, "open", path),
                Field("-o", texts.FOLDER, "folder", str(Path(path).with_suffix("")) + "_shots"),
                Field("--media", kind="folder", hint=texts.MEDIA_HINT),
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
        dialog = self._verb(
            title,
            "analyze",
            [
                Field("", texts.CLIP, "open", clip, hint=texts.CLIP_HINT),
                Field("-o", texts.SIDECAR, "save", out),
                Field("--frames", hint=texts.FRAMES_HINT),
                Field("--like", kind="open", hint=texts.LIKE_HINT),
                *self._search_fields(),
                Field("", texts.EDITS, "choice", edits, EDITS, names=texts.EDITS_NAMES),
                Field("--detect-shots", kind="check"),
            ],
            self._open_result,
        )
        shots = dialog.entry("--detect-shots")
        assert isinstance(shots, QCheckBox)
        shots.toggled.connect(functools.partial(self._name_output, dialog, out))
        return dialog

    @staticmethod
    def _search_fields() -> list[Field]:
        """Return the options that a clip and an edit have in common."""
        return [
            Field("--vertices", hint=texts.VERTICES_HINT),
            Field("--input-space", hint=texts.SPACE_HINT),
            Field("--palette-space", hint=texts.SPACE_HINT),
            Field("--ocio-config", kind="open", hint="$OCIO"),
            Field("--method", "", "choice", "", ("", *METHODS), texts.METHOD_HINT),
            Field("--set", texts.SETTINGS, "words", hint=texts.SETTINGS_HINT),
            Field("--skip-bad-frames", kind="check"),
            Field("--allow-cuts", kind="check"),
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
        """Open the sidecar or the manifest that was written."""
        out = Path(dialog.value("-o"))
        if out.is_dir():
            written = max(out.glob(f"*{ENDING}"), key=lambda path: path.stat().st_mtime)
            self.window.open_path(str(written))
        else:
            frame = self.session.frame
            self.window.open_path(str(out), dialog.value("") or None)
            self.session.go(frame)
        dialog.close()

    def render(self) -> VerbDialog:
        """Write the recoloured clip."""
        marks = self.session.marks
        compared = ("", "wipe", "side")
        return self._from_sidecar(
            texts.RENDER,
            "render",
            Field("", texts.CLIP, "open", self._clip_source),
            Field("-o", texts.OUTPUT, "save", self._beside("_graded.mp4")),
            Field("--frames", value="{}-{}".format(*marks) if marks else ""),
            Field("--compare", texts.COMPARE_LABEL, "choice", "", compared, texts.NO_COMPARE),
            Field("--bits", texts.BITS, "choice", "", ("", "8", "16", "32"), texts.BITS_HINT),
            Field("--half", kind="check"),
        )

    def _from_sidecar(self, title: str, verb: str, *fields: Field) -> VerbDialog:
        sidecar = Field("", texts.SIDECAR, "open", str(self.session.path))
        return self._verb(title, verb, [sidecar, *fields, Field("--force", kind="check")])

    def _beside(self, ending: str) -> str:
        assert self.session.path is not None
        return beside(self.session.path, ending)

    def bake(self) -> VerbDialog:
        """Write a LUT of this frame."""
        frame = str(self.session.frame)
        return self._from_sidecar(
            texts.BAKE,
            "bake",
            Field("--frame", texts.FRAME_FIELD, value=frame),
            Field("-o", texts.OUTPUT, "save", self._beside(f"_{frame}.cube")),
            Field("--size", hint="33"),
        )

    def export(self) -> VerbDialog:
        """Write LUTs over time."""
        return self._from_sidecar(
            texts.EXPORT,
            "export",
            Field("--every", value="1"),
            Field("-o", texts.FOLDER, "folder", self._beside("_luts")),
            Field("--format", texts.FORMAT, hint="cube"),
        )

    def config(self) -> VerbDialog:
        """Write an OpenColorIO config with the looks."""
        return self._from_sidecar(
            texts.CONFIG_WORK,
            "config",
            Field("-o", texts.FOLDER, "folder", self._beside("_config")),
            Field("--base", kind="open"),
        )

    def install(self) -> VerbDialog:
        """Install the OpenFX node."""
        return self._verb(
            texts.INSTALL,
            "install-plugin",
            [
                Field("--dest", texts.FOLDER, "folder", str(Path.home() / "OFX")),
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
