"""Sets for other trainers: what is refused."""

import pytest

from cns_drake.training import ExportOptions, write_pairs
from evaluation.base import InputError


@pytest.mark.parametrize(
    ("drives", "held_out", "fault"),
    [
        (2 * ["riverside_01"], [], "two drives are named riverside_01"),
        (["riverside_01"], ["riverside_01"], "no drive to learn from"),
    ],
)
def test_sets_that_cannot_be(tmp_path, drives, held_out, fault):
    with pytest.raises(InputError, match=fault):
        write_pairs(drives, held_out, tmp_path / "set", ExportOptions(), None)
