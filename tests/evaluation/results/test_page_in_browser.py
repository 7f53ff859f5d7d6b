"""The page of an experiment in a browser: it fits, and its table sorts."""

from helpers.browser import chromium, has_chromium
import pytest

from evaluation.results import Results, Row, write_page

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not has_chromium(), reason="no chromium"),
]

COLUMN = """[...document.querySelectorAll("#conditions tbody tr")]
  .map(row => row.children[%d].textContent)"""
CLICK = 'document.querySelectorAll("#conditions th")[%d].click()'


def make_results():
    values = [0.5, 0.25, 0.125, 0.75]
    return Results.of(
        Row(
            "a-rather-long-name-of-an-experiment",
            "town",
            "town_01",
            "town_02",
            1,
            {"query.transient.snow": level},
            "place",
            method,
            False,
            "random-yaw",
            metric,
            value,
        )
        for metric in (
            "auc",
            "relative_auc",
            "r1",
            "with_match",
            "no_candidate",
        )
        for method, level, value in zip(
            ("ring++", "mine", "mine", "ring++"),
            (0, 2, 10, 10),
            values,
            strict=True,
        )
        if (metric, level) != ("relative_auc", 0)
    )


def test_the_page_fits_and_sorts(tmp_path):
    chart = {"kind": "lines", "over": "query.transient.snow", "metric": "auc"}
    page = write_page(
        make_results(),
        None,
        tmp_path / "page",
        title="snow",
        charts=[chart],
        experiment_text="name: snow" + " # a long line" * 20,
    ).as_uri()
    with chromium(tmp_path / "profile") as browser:
        for width in (1440, 390):
            browser.open(page, width, 900)
            browser.evaluate(
                'document.querySelectorAll("details").forEach(d => d.open = 1)'
            )
            assert browser.evaluate("document.body.scrollWidth") <= width
            shown = browser.evaluate(
                '[...document.querySelectorAll(".wide, .narrow")]'
                ".filter(one => one.offsetWidth).map(one => one.className)"
            )
            assert shown == ["wide" if width == 1440 else "narrow"]
        assert browser.evaluate(COLUMN % 1) == ["0", "2", "10", "10"]
        browser.evaluate(CLICK % 2)
        assert browser.evaluate(COLUMN % 2) == [
            "0.75",
            "0.50",
            "0.25",
            "0.12",
        ]
        browser.evaluate(CLICK % 1)
        browser.evaluate(CLICK % 1)
        assert browser.evaluate(COLUMN % 1) == ["0", "2", "10", "10"]
        browser.evaluate(CLICK % 3)
        # What is empty stays last, also the other way round.
        assert browser.evaluate(COLUMN % 3)[-1] == ""
        browser.evaluate(CLICK % 3)
        assert browser.evaluate(COLUMN % 3)[-1] == ""
        assert browser.complaints == []
