"""Dates: the whole text has a documented form, or it is not understood."""

import pytest

from cns_drake.imports.building_years import (
    construction_year,
    demolition_year,
    year_of_date,
)
from cns_drake.imports.faults import ImportFaults


@pytest.mark.parametrize(
    ("text", "year"),
    [
        ("1890", 1890),
        ("79", 79),
        ("0079", 79),
        ("1890-05", 1890),
        ("1890-05-31", 1890),
        ("2010-06-09T12:00:00Z", 2010),
        ("~1890", 1890),
        ("circa 1890", 1890),
        ("before 1890", 1890),
        ("1890..1894", 1894),
        ("1890s", 1895),
        ("late 1890s", 1898),
        ("C19", 1850),
        ("early C19", 1820),
        ("221 BC", -220),
        ("-0220-09-10", -220),
        ("jd:2455511", 2010),
        # Not documented: a number is not searched in them.
        ("1890-1894", None),
        ("1890/1894", None),
        ("189X", None),
        ("1890?", None),
        ("1890-13", None),
        ("1890-05-32", None),
        ("built 1890", None),
        ("house 1890", None),
        ("18900", None),
        ("1890 or 1895", None),
        ("", None),
    ],
)
def test_dates_match_as_a_whole(text, year):
    assert year_of_date(text) == year


@pytest.mark.parametrize("read", ["built", "demolished"])
def test_dates_that_are_not_understood_are_counted(read):
    faults = ImportFaults()
    if read == "built":
        key = "start_date"
        year = construction_year({key: "1890-1894"}, None, "w1", faults)
    else:
        key = "end_date"
        year = demolition_year({key: "1890-1894"}, "w1", faults)
    assert year is None
    assert faults.rows() == [(f"date in {key} that is not understood", 1, "w1")]


def test_no_date_and_placeholders_are_no_faults():
    faults = ImportFaults()
    for value in (None, "", "0", 0, "0000", False):
        assert construction_year({"bouwjaar": value}, None, "a", faults) is None
    assert faults.rows() == []
