"""Words for stages, on maps with many and with few stages."""

from types import SimpleNamespace

import pytest

from cns_drake.base import InputError
from cns_drake.studies.drives.named_stages import MissingError, find_stage


def drive(stages, own):
    """A stand-in for a scenario on a map with some stages."""
    folder = SimpleNamespace(name="town", stages=lambda: dict.fromkeys(stages))
    return SimpleNamespace(stage=own, folder=folder)


NINE = [f"{k:02d}" for k in range(1, 10)]


@pytest.mark.parametrize(
    ("wanted", "found"),
    [
        ("own", "04"),
        ("last", "09"),
        ("first", "01"),
        ("07", "07"),
        ("earlier 1", "08"),
        ("earlier 2", "05"),
        ("earlier 3", "03"),
        ("earlier 4", "01"),
    ],
)
def test_stages_of_a_map_with_many(wanted, found):
    assert find_stage(wanted, drive(NINE, "04"), "09") == found


def test_earlier_stages_of_a_map_with_few():
    few = drive(["01", "02", "03"], "03")
    found = [find_stage(f"earlier {k}", few, "03") for k in (3, 4)]
    assert found == ["02", "01"]
    with pytest.raises(MissingError, match="before 03: 2, so none for"):
        find_stage("earlier 2", few, "03")
    with pytest.raises(MissingError, match="no stage before 01"):
        find_stage("earlier 4", few, "01")


@pytest.mark.parametrize("wanted", ["10", "earlier 5", "earlier", 4, None])
def test_words_that_name_no_stage(wanted):
    with pytest.raises(InputError, match=r"town has 01, .*; or give own, last"):
        find_stage(wanted, drive(NINE, "04"), "09")
