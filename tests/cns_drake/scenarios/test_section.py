"""The text of sections of a scenario."""

import pytest

from cns_drake.sensors import field_off_by_default
from evaluation.base import InputError, Section, validated


class Weather(Section):
    rain: float = 0.0
    fog: float = field_off_by_default(0.0, ge=0.0)


class Drive(Section):
    weather: Weather = Weather()


def test_a_field_without_effect_is_not_written():
    assert Drive().model_dump(mode="json") == {"weather": {"rain": 0.0}}
    drive = Drive(weather=Weather(fog=2.0))
    written = {"weather": {"rain": 0.0, "fog": 2.0}}
    assert drive.model_dump(mode="json", exclude_none=True) == written
    assert Drive.model_validate(written) == drive


class Switch(Section):
    number: float = 0.0
    count: int | None = None
    flag: bool = False
    either: bool | int = 0


@pytest.mark.parametrize("name", ["number", "count"])
def test_yes_is_no_number(name):
    with pytest.raises(InputError, match=f"file: {name}: True is no number"):
        validated(Switch, {name: True}, "file")


def test_yes_is_a_truth_value():
    values = {"number": 1, "count": 1, "flag": True, "either": True}
    switch = validated(Switch, values, "file")
    assert switch.flag is switch.either is True
