"""Messages name arguments of the API, and each surface says them in its own words."""

from __future__ import annotations

import argparse
import ast
import inspect
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from palette4d.analysis.options import OPTIONS

import palette4d
from palette4d import analysis, lut_export
from palette4d.cli.main import build_parser
from palette4d.cli.terminal import option_of
from palette4d.common.errors import Arg, Message, Palette4dError, SidecarError
from palette4d.grade.handle_edits import How
from palette4d.grade.pick_edits import Asked

FRAMES, FORCE = Arg("frames"), Arg("force", True)


def test_python_says_it_as_a_call() -> None:
    error = Palette4dError(f"choose {FRAMES}, {Arg('method', 'paper')} or {Arg('reach', 0.25)}")
    assert str(error) == 'choose frames=…, method="paper" or reach=0.25'
    assert error.message.remedies == (FRAMES, Arg("method", "paper"), Arg("reach", 0.25))


def test_a_message_keeps_its_arguments_when_it_travels_and_when_it_is_a_part() -> None:
    error = Palette4dError(f"choose {FRAMES}.", f"Or {FORCE}")
    for same in (error, pickle.loads(pickle.dumps(error))):
        assert str(same) == "choose frames=…. Or force=True"
        assert same.message.remedies == (FRAMES, FORCE)
    outer = Message(f"a.exr: {error.message.marked}")
    assert outer == "a.exr: choose frames=…. Or force=True"
    assert outer.remedies == (FRAMES, FORCE)


def test_text_of_a_file_is_no_argument() -> None:
    text = Message("\0rm=True\0 and \0")
    assert text.remedies == ()
    assert text.said(lambda arg: "!") == "rm=True and "
    broken = SidecarError("x\0force=True", "/a", "1", "2")
    assert pickle.loads(pickle.dumps(broken)).args == broken.args


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from parsers(below)


@pytest.mark.parametrize(
    ("verb", "arg", "option"),
    [
        ("analyze", FRAMES, "--frames"),
        ("analyze", Arg("on_edits", "keep"), "--keep-edits"),
        ("analyze", Arg("on_edits", "drop"), "--drop-edits"),
        ("analyze", Arg("method", "paper"), "--method paper"),
        ("analyze", Arg("lambda_", 0.5), "--set lambda=0.5"),
        ("analyze", Arg("detect_shots", True, "analyze_shots()"), "--detect-shots"),
        ("analyze", Arg("vertices"), "--vertices"),
        ("render", FORCE, "--force"),
        ("pick", Arg("follow", False), "--no-follow"),
        ("pick", Arg("any_value", True), "--float"),
        ("pick", Arg("start"), "--from"),
    ],
)
def test_the_command_line_says_the_options_of_the_verb(verb: str, arg: Arg, option: str) -> None:
    parser = next(each for each in parsers(build_parser()) if each.prog.split()[-1] == verb)
    assert option_of(arg, parser) == option


def sources() -> list[Path]:
    root = Path(palette4d.__file__).parent
    folders = (root, Path(analysis.__file__).parent, Path(lut_export.__file__).parent)
    return [path for folder in folders for path in folder.rglob("*.py")]


def test_no_message_spells_an_argument_out() -> None:
    for path in sources():
        tree = ast.parse(path.read_text("utf-8"))
        docs = {each.value for each in ast.walk(tree) if isinstance(each, ast.Expr)}
        for each in ast.walk(tree):
            if isinstance(each, ast.Constant) and isinstance(each.value, str) and each not in docs:
                assert not re.search(r"\b[a-z_]+=(…|True\b)", each.value), f"{path}:{each.lineno}"


def test_messages_name_arguments_that_the_api_has() -> None:
    texts = [path.read_text("utf-8") for path in sources()]
    named = {name for text in texts for name in re.findall(r"\bArg\([\"'](\w+)[\"']", text)}
    calls = [getattr(palette4d, name) for name in palette4d.__all__ if name != "__version__"]
    calls += [call for name, call in inspect.getmembers(palette4d.Document, inspect.isroutine)]
    public = [call for call in calls if not call.__name__.startswith("_")]
    known = {name for call in public for name in inspect.signature(call).parameters}
    known |= {
        *How.__annotations__,
        *Asked.__annotations__,
        *(option.field for option in OPTIONS.values()),
    }
    assert len(named) > 40
    assert named - known == {"detect_shots"}
