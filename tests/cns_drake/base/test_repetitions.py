"""Values that a list contains twice."""

import pytest

from cns_drake.base import check_once, repeated


def test_what_is_there_twice():
    assert repeated(iter("abcab")) == ["a", "b"]
    assert repeated([1, True, 1.0, "1"]) == [1, 1]
    assert repeated([{"a": 1, "b": 2}, [1], {"b": 2, "a": 1}, [1, 1]]) == [
        {"b": 2, "a": 1}
    ]
    # Linear in their number: a comparison of all pairs would take minutes.
    assert repeated(range(100_000)) == []


def test_a_value_that_is_there_twice_is_named():
    check_once(["a", 1, {"b": 2}])
    with pytest.raises(ValueError, match=r"^'a' is there twice$"):
        check_once(["a", "b", "a"])
