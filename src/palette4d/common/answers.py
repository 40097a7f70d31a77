"""The answers of a process that may have been taken over: data, and no code.

A pickle may name any function for its reader to call. These name none but the one that makes
palette4d's own dataclasses and errors; it runs nothing of theirs.
"""

from __future__ import annotations

import builtins
import dataclasses
import io
import pickle
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.common.message import Message

#: Bytes of an answer: the largest LUT takes some 100 MB. Parts of it, each counted as often as it
#: is met: lists of one list twice, forty deep, are few bytes.
LARGEST, MOST_PARTS = 1 << 30, 10_000_000

_MADE = ("palette4d.common.answers", "made")


def written(value: object) -> bytes:
    """Return a value as an answer.

    Raises
    ------
    TypeError
        It has a part that is neither data nor a dataclass or error of palette4d.
    """
    stream = io.BytesIO()
    _Writer(stream, protocol=5).dump(value)
    return stream.getvalue()


def read(data: bytes) -> tuple[Any, Exception | None]:
    """Return a result and an error, of which one is None.

    Raises
    ------
    Palette4dError
        It is no answer that `written` makes of these.
    """
    try:
        result, problem = _Reader(io.BytesIO(data)).load()
        # Those two would end this process, or a loop in it, without a word.
        ends = isinstance(problem, BrokenPipeError | StopIteration)
        if ends or not isinstance(problem, Exception | None):
            raise TypeError("no error")
        _check_parts(result)
        return result, problem
    except Exception as error:
        raise Palette4dError(
            f"the process that reads files answered what it must not ({error}); was a file made "
            "to take it over?"
        ) from error


def _check_parts(value: object) -> None:
    """Refuse a value that would take too long to go through."""
    left, parts = MOST_PARTS, [value]
    while parts:
        part = parts.pop()
        left -= 1
        if left < 0:
            raise TypeError("too many parts")
        if isinstance(part, dict):
            parts += [*part, *part.values()]
        elif isinstance(part, list | tuple | set | frozenset):
            parts += part
        elif dataclasses.is_dataclass(part) and not isinstance(part, type):
            parts += [getattr(part, each.name) for each in dataclasses.fields(part)]


class _Writer(pickle.Pickler):
    def reducer_override(self, obj: Any) -> Any:
        """Name a class and its data; numbers of NumPy are those of Python."""
        kind = type(obj)
        name = (kind.__module__, kind.__qualname__)
        if isinstance(obj, BaseException):
            return made, (*name, obj.args, vars(obj))
        if isinstance(obj, Message):
            return made, (*name, obj.parts, {})
        if isinstance(obj, Path):
            return made, ("pathlib", "Path", (str(obj),), {})
        if isinstance(obj, Fraction):
            return made, (*name, (obj.numerator, obj.denominator), {})
        if isinstance(obj, (float, int)):
            plain = float(obj) if isinstance(obj, float) else int(obj)
            return made, ("builtins", type(plain).__name__, (plain,), {})
        if dataclasses.is_dataclass(obj) and not isinstance(obj, type):
            found = {field.name: getattr(obj, field.name) for field in dataclasses.fields(obj)}
            return made, (*name, (), found)
        if obj is ... or obj is made:
            return NotImplemented
        raise TypeError(f"{kind.__module__}.{kind.__qualname__} is no answer")


class _Reader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        """Return the only names that there are."""
        if (module, name) == _MADE:
            # A new one: a pickle can set attributes of what it names.
            return lambda *given: made(*given)
        if (module, name) == ("builtins", "Ellipsis"):
            return ...
        raise TypeError(f"{module}.{name}")


def made(module: str, name: str, arguments: tuple[Any, ...], values: dict[str, Any]) -> Any:
    """Return an object with these values; no method of its class is called."""
    if (module, name) in _SIMPLE:
        return _SIMPLE[module, name](*arguments)
    found = getattr(sys.modules.get(module), name, None)
    if not isinstance(found, type) or (found.__module__, found.__qualname__) != (module, name):
        raise TypeError(f"{module}.{name}")
    own = module.startswith("palette4d.")
    result: Any
    if found is Message:
        result = str.__new__(Message, "".join(map(str, arguments)))
        result.parts = tuple(arguments)
    elif issubclass(found, Exception) and (own or module == builtins.__name__):
        result = found.__new__(found, *arguments)
        result.args = arguments
        vars(result).update(values)
    elif own and dataclasses.is_dataclass(found):
        result = object.__new__(found)
        for field in dataclasses.fields(found):
            object.__setattr__(result, field.name, values[field.name])
    else:
        raise TypeError(f"{module}.{name}")
    return result


_SIMPLE: dict[tuple[str, str], Callable[..., Any]] = {
    ("pathlib", "Path"): lambda path: Path(str(path)),
    ("fractions", "Fraction"): lambda over, under: Fraction(int(over), int(under)),
    ("builtins", "float"): float,
    ("builtins", "int"): int,
}
