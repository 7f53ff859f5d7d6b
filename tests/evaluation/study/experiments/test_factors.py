"""Nested fields and their paths."""

from evaluation.base import merged


def test_mappings_are_merged_and_all_else_is_replaced():
    values = {"a": {"b": 1, "c": [1, 2]}, "d": 3}
    changes = {"a": {"c": [4], "e": {}}, "d": {"f": 5}}
    assert merged(values, changes) == {
        "a": {"b": 1, "c": [4], "e": {}},
        "d": {"f": 5},
    }
    assert values == {"a": {"b": 1, "c": [1, 2]}, "d": 3}
