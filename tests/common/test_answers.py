"""Answers of a process that may have been taken over are data, whatever its pickles name."""

import pickle
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from palette4d.common import answers
from palette4d.common.errors import Arg, Palette4dError, SidecarError
from palette4d.jobs.pool import Failed


def back(value: object) -> object:
    return answers.read(answers.written((value, None)))[0]


def test_data_and_values_of_palette4d_come_back() -> None:
    data = {"a": [1, 2.5, None, True], "b": (b"x", "y", {1}), "c": ...}
    assert back(data) == data
    assert back([Failed("why"), Fraction(24000, 1001), Path("a/b")]) == [
        Failed("why"),
        Fraction(24000, 1001),
        Path("a/b"),
    ]
    number = back(np.float64(0.25))
    assert (number, type(number)) == (0.25, float)


def test_errors_come_back_with_what_they_advise() -> None:
    _, error = answers.read(answers.written((None, Palette4dError(f"use {Arg('force', True)}"))))
    assert isinstance(error, Palette4dError)
    assert (str(error), error.message.remedies) == ("use force=True", (Arg("force", True),))
    problem = SidecarError("a", "/b", "c", "d")
    _, error = answers.read(answers.written((None, problem)))
    assert (type(error), str(error)) == (SidecarError, str(problem))
    fault = ZeroDivisionError("by zero")
    fault.add_note("where")
    _, error = answers.read(answers.written((None, fault)))
    assert isinstance(error, ZeroDivisionError)
    assert error.__notes__ == ["where"]


@dataclass
class Strange:
    a: int = 1


class Calls:
    """A pickle that calls something."""

    def __init__(self, *call: object) -> None:
        self.call = call

    def __reduce__(self) -> tuple[object, object]:
        return self.call[0], self.call[1:]


@pytest.mark.parametrize(
    "value",
    [
        Calls(print, "ran"),
        Calls(Path.cwd),
        Calls(answers.made, "os", "system", ("true",), {}),
        Calls(answers.made, "palette4d.common.answers", "sys.exit", (), {}),
        Calls(answers.made, "palette4d.common.files", "make_folder", (Path("x"),), {}),
        Calls(answers.made, "palette4d.grade.document", "Document", ({},), {}),
        Calls(answers.made, "builtins", "SystemExit", (), {}),
        Strange(),
        print,
        Palette4dError,
    ],
)
def test_nothing_else_is_made(value: object, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Palette4dError, match="take it over"):
        answers.read(pickle.dumps((value, None)))
    assert not capsys.readouterr().out


@pytest.mark.parametrize("data", [b"", b"\x80", b"junk", pickle.dumps(1), pickle.dumps((1, 2))])
def test_what_is_no_answer_is_an_error(data: bytes) -> None:
    with pytest.raises(Palette4dError, match="take it over"):
        answers.read(data)


@pytest.mark.parametrize("value", [Strange, object(), print])
def test_what_cannot_be_answered_is_an_error_there(value: object) -> None:
    with pytest.raises(TypeError, match="no answer"):
        answers.written(value)


def test_few_bytes_of_very_many_parts_are_no_answer() -> None:
    nested: object = 1
    for _ in range(40):
        nested = [nested, nested]
    with pytest.raises(Palette4dError, match="too many parts"):
        back(nested)


@pytest.mark.parametrize("problem", [BrokenPipeError(), StopIteration()])
def test_an_error_that_would_end_the_reader_is_no_answer(problem: Exception) -> None:
    with pytest.raises(Palette4dError, match="must not"):
        answers.read(answers.written((None, problem)))
