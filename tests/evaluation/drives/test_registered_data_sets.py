"""Mistakes of others' data sets and causes are told when they are made."""

import dataclasses
import re

from helpers.towns import TownDrive
import numpy as np
import pytest

from cns_drake.base import InputError
from evaluation import (
    DataSet,
    data_set_checks,
    register_cause,
    register_data_set,
)


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


def test_poses_are_finite():
    lost = TownDrive("lost", [None], np.full((1, 4, 4), np.nan))
    with pytest.raises(InputError, match="lost: X_WS: values that are not"):
        data_set_checks[0](lost)
