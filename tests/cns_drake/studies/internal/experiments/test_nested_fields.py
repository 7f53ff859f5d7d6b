"""Nested fields and their paths."""

import pytest

from cns_drake.base import merged, nested
from cns_drake.studies.experiments.nested_fields import set_field


def test_mappings_are_merged_and_all_else_is_replaced():
    values = {"a": {"b": 1, "c": [1, 2]}, "d": 3}
    changes = {"a": {"c": [4], "e": {}}, "d": {"f": 5}}
    assert merged(values, changes) == {
        "a": {"b": 1, "c": [4], "e": {}},
        "d": {"f": 5},
    }
    assert values == {"a": {"b": 1, "c": [1, 2]}, "d": 3}


@pytest.mark.parametrize("path", ["a", "a.b", "a.b.c", "d.e", "f"])
@pytest.mark.parametrize("value", [7, {"b": 8}])
def test_a_field_is_set_in_place_as_it_is_merged(path, value):
    fields = {"a": {"b": {"c": 1}, "g": 2}, "d": 3}
    expected = merged(fields, nested(path, value))
    set_field(fields, path, value)
    assert fields == expected
