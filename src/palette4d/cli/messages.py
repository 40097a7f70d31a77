"""What the command line prints on standard error.

Errors and notes of the API name its arguments: ``force=True``, ``frames=…``. Here, and only here,
they become options: ``--force``, ``--frames``. Programs that wait get the names of the fields of
Studio's dialog.
"""

import re
import sys

from palette4d.analysis.options import OPTIONS
from palette4d.cli import job
from palette4d.studio import texts

_ARGUMENT = re.compile(r'\b([a-z][a-z0-9_]*)=(True|…|"[^"\n]*"|-?[0-9][0-9.e+-]*[0-9]|[0-9])')
_SPECIAL = {
    'on_edits="keep"': "--keep-edits",
    'on_edits="drop"': "--drop-edits",
    "analyze_shots()": "--detect-shots",
    "any_value=True": "--float",
    "follow=False": "--no-follow",
    "start=…": "--from",
}


def as_options(text: str) -> str:
    """Return a message of the API in the words of the command line.

    >>> as_options('choose frames=…, method="paper" or lambda_=0.5, or replace it with force=True')
    'choose --frames, --method paper or --set lambda=0.5, or replace it with --force'
    """
    for argument, option in _SPECIAL.items():
        text = text.replace(argument, option)
    return _ARGUMENT.sub(_option, text)


def _option(found: re.Match[str]) -> str:
    name, value = found[1].removesuffix("_"), found[2].strip('"')
    if name in OPTIONS and name != "vertices":
        return f"--set {name}={value}"
    option = f"--{name.replace('_', '-')}"
    return option if value in ("True", "…") else f"{option} {value}"


#: The arguments of `analyze` that have a field in Studio, by name or with their value.
_FIELDS = {
    'on_edits="keep"': f"{texts.EDITS}: {texts.EDITS_NAMES[1]}",
    'on_edits="drop"': f"{texts.EDITS}: {texts.EDITS_NAMES[2]}",
    "analyze_shots()": texts.DETECT_SHOTS,
    "frames": texts.FRAMES,
    "skip_bad_frames": texts.SKIP_BAD,
    "allow_cuts": texts.ALLOW_CUTS,
    "input_space": texts.INPUT_SPACE,
    "palette_space": texts.PALETTE_SPACE,
    "ocio_config": texts.CONFIG,
    "vertices": texts.VERTICES,
    "method": texts.METHOD,
    "like": texts.LIKE,
}


def as_fields(text: str) -> str:
    """Return a message of an analysis in the words of Studio's dialog, which hosts open too.

    >>> as_fields("choose frames=…, or leave such frames out with skip_bad_frames=True.")
    "choose 'Frames', or leave such frames out with 'Skip bad frames'."
    """

    def field(found: re.Match[str]) -> str:
        label, value = _FIELDS.get(found[1]), found[2].strip('"')
        if label is None:
            return _option(found)
        return f"'{label}'" if value in ("True", "…") else f"'{label}' {value}"

    words = text
    for argument, label in _FIELDS.items():
        if not argument.isidentifier():
            words = words.replace(argument, f"'{label}'")
    return _ARGUMENT.sub(field, words)


def tell(kind: str, text: str) -> None:
    """Print a message: `kind` is "error", "warning" or "note"."""
    fields = as_fields(text)
    job.event(**{kind: fields, "fields": fields != text})
    if not job.on_stderr():
        words = as_options(text).encode("utf-8", "backslashreplace").decode("utf-8")
        print(f"palette4d: {kind}: {words}", file=sys.stderr)
