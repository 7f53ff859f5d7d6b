"""The times of messages, against an explicit list."""

from fractions import Fraction

import pytest

from cns_drake.recording import make_schedule

RATES = {"scan": 10, "rear": 20, "imu": 400, "pose": 100}


def test_every_stream_has_its_own_times():
    schedule = make_schedule({name: 1 / rate for name, rate in RATES.items()})
    assert schedule.exact_period == Fraction(1, 400)
    found = {name: [] for name in RATES}
    for tick in range(401):
        for name in schedule.due(tick):
            found[name].append(schedule.time_ns(tick))
    for name, rate in RATES.items():
        expected = [k * 10**9 // rate for k in range(rate + 1)]
        assert found[name] == expected


@pytest.mark.parametrize("period", [0.05, 0.1, 1 / 30, 0.3, 0.0125])
def test_one_period_is_the_tick_to_the_last_bit(period):
    schedule = make_schedule({"a": period, "b": period})
    assert schedule.period == period
    assert set(schedule.steps.values()) == {1}
    assert schedule.time_ns(10**6) == round(10**6 * period * 1e9)


def test_periods_that_do_not_divide_each_other():
    schedule = make_schedule({"a": 1 / 128, "b": 0.05})
    assert schedule.exact_period == Fraction(1, 640)
    assert schedule.steps == {"a": 5, "b": 32}
    assert schedule.due(160) == ["a", "b"]


def test_a_stream_ends_with_its_last_message():
    schedule = make_schedule({"a": 0.01, "b": 0.05}, {"b": 0.1, "a": 0.13})
    assert schedule.due(10) == ["a", "b"]
    assert schedule.due(13) == ["a"]
    assert schedule.due(14) == []
    assert schedule.due(15) == []
