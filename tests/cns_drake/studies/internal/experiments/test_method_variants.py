"""Settings of methods as factors."""

import pytest

from cns_drake.studies.experiments.method_variants import method_variants


def test_settings_of_methods_are_factors():
    plain, *varied = method_variants(
        {
            "btc": {},
            "solid": {"ranges": [20, 40], "place": "first"},
            "ring++": {"crop": 3.5},
        }
    )
    assert plain == ("btc", (), {})
    *solid, ring = varied
    assert [settings for _, settings, _ in solid] == [
        (("place", "first"), ("ranges", "20")),
        (("place", "first"), ("ranges", "40")),
    ]
    assert [factors for *_, factors in solid] == [
        {"methods.solid.place": "first", "methods.solid.ranges": ranges}
        for ranges in (20, 40)
    ]
    fixed = {"methods.ring++.crop": 3.5}
    assert ring == ("ring++", (("crop", "3.5"),), fixed)


def test_there_are_at_most_a_thousand_variants():
    solid = {"ranges": [*range(20)], "elevations": [*range(50)]}
    assert len(method_variants({"solid": solid})) == 1000
    with pytest.raises(ValueError, match=r"methods.btc: 1001 variants"):
        method_variants({"solid": solid, "btc": {}})
    many = [*range(10_000)]
    with pytest.raises(ValueError, match=r"solid: 100000000 variants"):
        method_variants({"solid": {"ranges": many, "elevations": many}})
