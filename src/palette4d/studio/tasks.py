"""The long work that the menus begin: each is a verb of the command line in a dialog."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QFileDialog

from palette4d.studio import texts
from palette4d.studio.jobs import Job
from palette4d.studio.work import Field, WorkDialog, beside

if TYPE_CHECKING:
    from palette4d.studio.window import Window


class Tasks:
    """The work of a window."""

    def __init__(self, window: "Window") -> None:
        self.window, self.session = window, window.session
        self.dialogs: list[WorkDialog] = []

    def _work(
        self,
        title: str,
        verb: str,
        fields: list[Field],
        done: Callable[[Job], object] | None = None,
    ) -> WorkDialog:
        self.session.save()
        dialog = WorkDialog(self.window, title, verb, fields, self.session.post, done)
        dialog.show()
        self.dialogs.append(dialog)
        dialog.destroyed.connect(lambda: self.dialogs.remove(dialog))
        return dialog

    @property
    def _clip_source(self) -> str:
        return "" if self.session.clip is None else self.session.clip.source

    def analyze(self) -> WorkDialog:
        """Find the palette of a clip."""
        source = self._clip_source
        out = ""
        if source:
            path = Path(source)
            # The name by which the node finds it, see docs/node.md.
            stem = path.name.split("#")[0].rstrip("._-") or path.absolute().parent.name
            stem = Path(stem).stem if "#" not in source else stem
            out = str(path.with_name(f"{stem}.p4d.json"))
        return self._analyze(texts.ANALYZE, source, out, "--drop-edits" if out else "")

    def analyze_again(self) -> WorkDialog:
        """Find the palette of the document's clip again."""
        return self._analyze(
            texts.ANALYZE_AGAIN, self._clip_source, str(self.session.path or ""), "--keep-edits"
        )

    def _analyze(self, title: str, clip: str, out: str, edits: str) -> WorkDialog:
        fields = [
            Field("", texts.CLIP, "open", clip, hint=texts.CLIP_HINT),
            Field("-o", texts.SIDECAR, "save", out),
            Field("--frames", texts.FRAMES, hint=texts.FRAMES_HINT),
            Field("--vertices", texts.VERTICES, hint=texts.VERTICES_HINT),
            Field("--input-space", texts.INPUT_SPACE, hint=texts.SPACE_HINT),
            Field("--palette-space", texts.PALETTE_SPACE, hint=texts.SPACE_HINT),
            Field("--ocio-config", texts.CONFIG, "open", hint="$OCIO"),
        ]
        if edits == "--keep-edits":
            fields.append(Field("--keep-edits", texts.KEEP_EDITS, "check", "yes"))
        fields.append(Field("--skip-bad-frames", texts.SKIP_BAD, "check"))
        fields.append(Field("--allow-cuts", texts.ALLOW_CUTS, "check"))

        def done(_: Job) -> None:
            self.window.open_path(dialog.value("-o"), dialog.value("") or None)
            dialog.close()

        dialog = self._work(title, "analyze", fields, done)
        return dialog

    def render(self) -> WorkDialog:
        """Write the recoloured clip."""
        path = self.session.path
        assert path is not None
        stem = path.name.removesuffix(".p4d.json")
        marks = self.session.marks
        return self._work(
            texts.RENDER,
            "render",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("", texts.CLIP, "open", self._clip_source),
                Field("-o", texts.OUTPUT, "save", str(path.with_name(f"{stem}_graded.mp4"))),
                Field("--frames", texts.FRAMES, value="{}-{}".format(*marks) if marks else ""),
                Field(
                    "--compare",
                    texts.COMPARE_LABEL,
                    "choice",
                    "",
                    ("", "wipe", "side"),
                    texts.NO_COMPARE,
                ),
                Field("--bits", texts.BITS, "choice", "", ("", "8", "16", "32"), texts.BITS_HINT),
                Field("--half", texts.HALF, "check"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def bake(self) -> WorkDialog:
        """Write a LUT of this frame."""
        path = self.session.path
        assert path is not None
        frame = self.session.frame
        return self._work(
            texts.BAKE,
            "bake",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("--frame", texts.FRAME_FIELD, value=str(frame)),
                Field("-o", texts.OUTPUT, "save", beside(path, f"_{frame}.cube")),
                Field("--size", texts.GRID, hint="33"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def export(self) -> WorkDialog:
        """Write LUTs over time."""
        path = self.session.path
        assert path is not None
        return self._work(
            texts.EXPORT,
            "export",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("--every", texts.EVERY, value="1"),
                Field("-o", texts.FOLDER, "folder", beside(path, "_luts")),
                Field("--format", texts.FORMAT, hint="cube"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def config(self) -> WorkDialog:
        """Write an OpenColorIO config with the looks."""
        path = self.session.path
        assert path is not None
        return self._work(
            texts.CONFIG_WORK,
            "config",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("-o", texts.FOLDER, "folder", beside(path, "_config")),
                Field("--base", texts.BASE_CONFIG, "open"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def install(self) -> WorkDialog:
        """Install the OpenFX node."""
        return self._work(
            texts.INSTALL,
            "install-plugin",
            [
                Field("--dest", texts.FOLDER, "folder", str(Path.home() / "OFX")),
                Field("--link", texts.LINK, "check"),
                Field("--kdenlive", "Kdenlive", "check"),
                Field("--shotcut", "Shotcut", "check"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def copy_grade(self) -> WorkDialog | None:
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
        return self._work(texts.COPY_GRADE, "edit", fields)
