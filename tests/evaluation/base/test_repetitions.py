"""Values that a list contains twice."""

from evaluation.base import repeated


def test_what_is_there_twice():
    assert repeated(iter("abcab")) == ["a", "b"]
    assert repeated([1, True, 1.0, "1"]) == [1, 1]
    assert repeated([{"a": 1, "b": 2}, [1], {"b": 2, "a": 1}, [1, 1]]) == [
        {"b": 2, "a": 1}
    ]
    # Linear in their number: a comparison of all pairs would take minutes.
    assert repeated(range(100_000)) == []
