"""A child process with limits: whatever happens in it, the parent says so and goes on."""

from collections.abc import Callable, Iterator

import pytest
from child_calls import crash, fault, grow, hang, refuse, well

from palette4d.common.child import Child, ChildError
from palette4d.common.errors import Palette4dError, SidecarError


@pytest.fixture(scope="module")
def child() -> Iterator[Child]:
    with Child(20, 2048) as one:
        yield one


def test_one_process_serves_many_calls(child: Child) -> None:
    first, second = child.call(well, 1, 2), child.call(well, 3, 4)
    assert (first[:2], second[:2]) == ((1, 2), (3, 4))
    assert first[2] == second[2]


@pytest.mark.parametrize(
    ("call", "words"), [(crash, "crashed .SIGABRT"), (grow, "more than 2048 MB")]
)
def test_a_call_that_goes_wrong_costs_one_call(
    child: Child, call: Callable[[], object], words: str
) -> None:
    with pytest.raises(ChildError, match=words):
        child.call(call)
    assert child.call(well, 5, 6)[:2] == (5, 6)


def test_a_call_without_end_is_ended() -> None:
    with Child(0.5, 2048) as child, pytest.raises(ChildError, match=r"longer than 0\.5 seconds"):
        child.call(hang)


def test_errors_come_back(child: Child) -> None:
    with pytest.raises(SidecarError) as caught:
        child.call(refuse)
    assert caught.value.pointer == "/clip"
    with pytest.raises(Palette4dError, match="by zero"):
        child.call(fault)
