"""Mistakes of others' data sets and causes are told when they are made."""

import dataclasses
import re

from helpers.towns import TownDrive, route
import numpy as np
import pytest

from evaluation import (
    DataSet,
    data_set_checks,
    register_cause,
    register_data_set,
)
from evaluation.base import InputError

SCAN = np.zeros(3, [(axis, "<f4") for axis in "xyz"])


@pytest.mark.parametrize(
    ("field", "value", "fault"),
    [
        ("title", 3, "title: no text"),
        ("files", None, "files: no text"),
        ("holds", "mine.txt", "holds: no function"),
        ("open", "MineDrive", "open: no function"),
    ],
)
def test_fields_of_a_data_set(field, value, fault):
    mine = DataSet("Mine", lambda _: False, lambda *_: None, "`mine.txt`")
    wrong = dataclasses.replace(mine, **{field: value})
    with pytest.raises(InputError, match=f"^data set .*: {re.escape(fault)}$"):
        register_data_set(wrong)


def test_a_cause_is_a_mapping_or_a_file():
    with pytest.raises(InputError, match="42 is neither a cause nor its file"):
        register_cause(42)


def test_sets_of_levels_are_known():
    cause = {"name": "c", "title": "", "about": ""}
    fields = {"query": {"transient": {"snow": [0.1]}}}
    with pytest.raises(InputError, match=r"laddr: .*; did you mean ladder\?"):
        register_cause({**cause, "strengths": {"laddr": fields}})


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (np.diag([np.nan, 1, 1, 1]), "not finite"),
        (np.diag([1.1, 1.1, 1.1, 1]), "the axes have other lengths than 1"),
        (np.diag([1, -1, 1, 1]), "a mirror, not a rotation"),
        (np.diag([1, 1, 1, 2]), "the last row is not 0, 0, 0, 1"),
        (
            [[1, 0.6, 0, 0], [0, 0.8, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
            "the axes are not orthogonal",
        ),
    ],
)
def test_poses_are_rigid(change, fault):
    X_WS = route(3)
    data_set_checks[0](TownDrive("good", [SCAN] * 3, X_WS))
    X_WS[1] = X_WS[1] @ change
    with pytest.raises(InputError, match=f"^bad: .*X_WS: pose 1: {fault}$"):
        data_set_checks[0](TownDrive("bad", [SCAN] * 3, X_WS))
