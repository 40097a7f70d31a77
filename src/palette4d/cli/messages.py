"""What the command line prints on standard error.

Errors and notes of the API name its arguments: ``force=True``, ``frames=…``. Here, and only here,
they become options: ``--force``, ``--frames``.
"""

import re
import sys

from palette4d.analysis.options import OPTIONS

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


def tell(kind: str, text: str) -> None:
    """Print a message: `kind` is "error", "warning" or "note"."""
    words = as_options(text).encode("utf-8", "backslashreplace").decode("utf-8")
    print(f"palette4d: {kind}: {words}", file=sys.stderr)
