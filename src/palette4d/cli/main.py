"""The command ``palette4d``: one parser; each verb is one module.

A verb's module has ``add_parser(subparsers)``, which sets ``run`` as the parser's default; ``run``
takes the parsed arguments and returns the exit status.
"""

import argparse
import contextlib
import importlib
import os
import sys
import traceback
from collections.abc import Callable, Sequence

from palette4d._core import __version__
from palette4d.cli import job
from palette4d.cli.confined import confined
from palette4d.cli.terminal import printable_output, tell
from palette4d.common.arguments import Parser, accept_negative_values
from palette4d.common.errors import Palette4dError, SidecarError, in_words

#: The modules of the verbs, in the usual order of work (and of ``palette4d --help``).
VERB_MODULES = (
    "palette4d.cli.sample_clip",
    "palette4d.cli.analyze",
    "palette4d.cli.info",
    "palette4d.cli.slice",
    "palette4d.cli.edit",
    "palette4d.cli.render",
    "palette4d.cli.bake",
    "palette4d.cli.export",
    "palette4d.cli.config",
    "palette4d.cli.plot",
    "palette4d.cli.studio",
    "palette4d.cli.install_plugin",
)

EPILOG = """\
example:
  palette4d sample-clip -o clip/frame.####.png
  palette4d analyze clip/ -o clip.p4d.json
  palette4d info clip.p4d.json
  palette4d edit clip.p4d.json set --near 0.9,0.5,0.2 --frame 40 --rgb 0.7 0.2 0.6
  palette4d render clip.p4d.json clip/ -o graded/frame.####.exr

`palette4d VERB --help` explains a verb and shows an example.
`palette4d VERB --progress FILE` is for programs that wait: progress as JSON lines (docs/files.md).
`palette4d VERB --sandbox on|off`: clips are decoded by a confined process, or by none (SECURITY.md;
default: where the kernel allows it).
"""


def build_parser(verb: str = "") -> argparse.ArgumentParser:
    """Return the parser of the whole command, or, which is quicker, of one verb alone."""
    parser = Parser(
        prog="palette4d",
        description="Time-varying palettes for colour grading: analyse a clip, edit its colours, "
        "render or bake the result.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"palette4d {__version__}")
    subparsers = parser.add_subparsers(title="verbs", metavar="VERB", dest="verb", required=True)
    asked = f"palette4d.cli.{verb.replace('-', '_')}"
    for name in (asked,) if asked in VERB_MODULES else VERB_MODULES:
        importlib.import_module(name).add_parser(subparsers)
    for each in subparsers.choices.values():
        each.add_argument("--progress", metavar="FILE", help=argparse.SUPPRESS)
        each.add_argument("--stop-at-eof", action="store_true", help=argparse.SUPPRESS)
        each.add_argument(
            "--sandbox", choices=("auto", "on", "off"), default="auto", help=argparse.SUPPRESS
        )
    accept_negative_values(subparsers)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    0: done; 1: an error, reported on stderr; 2: wrong usage; 130: interrupted.

    Raises
    ------
    SystemExit
        From argparse: wrong usage (2), ``--help`` and ``--version`` (0).
    """
    # All loops run in threads of palette4d's own. Those of OpenBLAS would only spin beside them,
    # and would not be confined.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    given = sys.argv[1:] if argv is None else argv
    with printable_output(), contextlib.ExitStack() as stack:
        args = build_parser(*given[:1]).parse_args(given)
        # Not for a Python program that calls this: its process would stay confined.
        args.confine = argv is None
        return _run(args, stack)


def _run(args: argparse.Namespace, stack: contextlib.ExitStack) -> int:
    run: Callable[[argparse.Namespace], int] = args.run
    try:
        if args.stop_at_eof:
            job.stop_at_end_of_input()
        stack.enter_context(job.events_to(args.progress))
        if args.confine:
            stack.enter_context(confined(args))
        status = run(args)
        sys.stdout.flush()
        if status == 0:
            job.event(finished=True)
    except BrokenPipeError:
        # The reader of our output has ended (`palette4d info … | head`). This is no error, but
        # Python would report one when it flushes stdout at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Palette4dError, OSError) as error:
        return _report(args, error)
    except KeyboardInterrupt:
        print("palette4d: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        job.event(error=[job.shown(str(error) or type(error).__name__)])
        if not args.confine:
            raise
        traceback.print_exc()  # while names that it quotes are printable
        return 1
    return status


def _report(args: argparse.Namespace, error: Exception) -> int:
    text = in_words(error).marked
    broken = isinstance(error, SidecarError) and (error.pointer or "JSON" in error.expected)
    if isinstance(error, SidecarError) and '"palette4d.shots"' in error.found:
        text += "; this is a manifest of shots: name the sidecar (.p4d.json) of one"
        if not (vars(args).get("dctl") or vars(args).get("glsl")):
            text += ", or use `palette4d export` or `palette4d config`, which take them all"
    elif broken and "update palette4d" not in text:
        text += "; correct it there, take an earlier copy of the file, or analyse the clip again"
    tell(args, "error", text)
    return 1
