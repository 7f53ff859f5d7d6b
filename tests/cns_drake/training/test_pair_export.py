"""Sets for other trainers: what is refused."""

from helpers.tiny_drive import tiny_scenario
import pytest

from cns_drake.base import InputError
from cns_drake.training import ExportOptions, export_pairs


def test_two_drives_of_one_name_are_refused(tmp_path):
    both = [tiny_scenario(tmp_path)] * 2
    with pytest.raises(InputError, match="two drives are named tiny_01"):
        export_pairs(both, [], tmp_path / "set", ExportOptions(), None)


def test_a_set_without_drives_to_learn_from(tmp_path):
    with pytest.raises(InputError, match="no drive to learn from"):
        export_pairs([], [tiny_scenario(tmp_path)], tmp_path, None, None)
