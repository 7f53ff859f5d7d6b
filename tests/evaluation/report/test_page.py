import base64
from dataclasses import replace
import itertools
import math
from math import nan
import re
from types import SimpleNamespace

from helpers.small_page import make_content, make_result, make_results
import numpy as np
import pytest

from evaluation.recognition.fault_names import FAULT_KINDS
from evaluation.report.illustrations import Illustration
from evaluation.report.page import write_page, write_report
from evaluation.report.page_data import browser_data
from evaluation.report.ranking import further_columns, ranked_methods
from evaluation.report.reference import Reference
from evaluation.report.route_pictures import route_picture
from evaluation.report.tables.differences import MethodDifference
from evaluation.report.tables.recognition import recognition_table
from evaluation.results.charts.markers import marker_corners
from evaluation.results.keys import LAST, OWN, STAGE
from evaluation.results.styles import method_styles
from evaluation.results.table import Results, Row

PAIR = ("metropolis", "01", "04")
PAGES = {"metropolis_04": "../pages/metropolis_04.html?a=1&b"}


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    return make_content(tmp_path_factory.mktemp("figures"))


@pytest.fixture(scope="module")
def text(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_page(path, content)
    return path.read_text()


def test_page_stands_alone(text):
    assert "{{" not in text
    # The only addresses are those within the page and XML's names.
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert sources
    assert all(s.startswith(("data:", "#")) for s in sources)
    assert not re.findall(r"https?://", text)


def test_links_lead_to_sections(text):
    links = re.findall(r'<a href="#(\w+)">', text)
    assert links == [
        # It is at the top, and among all tables.
        "browser",
        "summary", "survival", "maps", "change", "recognition", "figures",
        "browser",
    ]  # fmt: skip
    assert re.findall(r'<section id="(\w+)">', text) == links[1:]


def test_the_ranking_comes_first(text):
    section = text[text.index('<section id="summary">') :]
    section = section[: section.index("</section>")]
    cell = r"(?:<small>.*?</small>)?</td>\s*<td>([\d.–]+)"
    rows = re.findall(
        rf'<th scope="row">(.*?)</th>\s*<td>([\d.]+){3 * cell}</td>', section
    )
    # By hand: on the pair that both have, RING++ is right on three of four
    # queries with a match, and Scan Context++ on two. Neither has poses.
    assert [(name, *beside) for name, _, *beside in rows] == [
        ("RING++", "0.750", "0.000", "–"),
        ("Scan Context++", "0.500", "0.000", "–"),
    ]
    (_, first, *_), (_, second, *_) = rows
    assert (
        f"RING++ has the greatest mean AUC of 2 methods, {first} over one pair;"
        f" its lead over Scan Context++ ({second}) is significant on no pair."
    ) in section
    assert "<details" not in section
    # Its colour in all pictures.
    assert 'fill="#0072B2"' in section


@pytest.mark.parametrize(
    ("aucs", "words"),
    [
        ({}, "No pair of drives has an AUC of every method"),
        ({"btc": [0.5, nan], "solid": [nan, 0.5]}, "No pair of drives"),
        ({"btc": [0.5, 0.7]}, "BTC has a mean AUC of 0.600 over 2 pairs"),
        (
            {"btc": [0.5, 0.7], "solid": [0.7, 0.5], "x": [0.1, 0.1]},
            "BTC and SOLiD tie at a mean AUC of 0.600 (2 pairs of drives).",
        ),
        (
            {"btc": [0.9, nan], "solid": [0.2, 0.9]},
            "BTC has the greatest mean AUC of 2 methods, 0.900 over one pair;"
            " its lead over SOLiD (0.200) is significant on no pair.",
        ),
        (
            {"btc": [0.9, 0.8], "solid": [0.2, 0.1]},
            "2 pairs of drives; its lead over SOLiD (0.150) is significant",
        ),
    ],
)
def test_a_headline_is_true(aucs, words):
    place = {"experiment": "stages", "database": "a", "seed": 1}
    place |= {"factors": {STAGE: OWN}, "task": "place", "gate": False}
    rows = [
        Row(
            **place,
            map="town",
            query=str(k),
            method=method,
            protocol="fair",
            metric="auc",
            value=value,
        )
        for method, values in aucs.items()
        for k, value in enumerate(values)
    ]
    # The names of factors come from the rows.
    rows.append(
        Row(
            **{**place, "factors": {STAGE: LAST}},
            map="town",
            query="0",
            method="btc",
            protocol="fair",
            metric="auc",
            value=0.0,
        )
    )
    _, headline = ranked_methods(Results.of(rows))
    assert words in headline


@pytest.mark.parametrize(
    ("p_values", "words"),
    [
        # On each of two pairs: BTC and SOLiD, BTC and x, SOLiD and x.
        (
            ((0.01, 0.02, 0.9), (0.04, 0.049, 0.9)),
            "its lead over all others is significant on each pair.",
        ),
        (
            ((0.11, 0.98, 0.42), (0.05, nan, 0.01)),
            "its lead over SOLiD (0.150) and x (0.100) is significant"
            " on no pair.",
        ),
        (
            ((0.11, 0.01, 0.42), (0.05, 0.01, 0.01)),
            "its lead over SOLiD (0.150) is significant on no pair.",
        ),
        (
            ((0.11, 0.01, 0.42), (0.01, 0.06, 0.01)),
            "its lead over SOLiD (1 of 2) and x (1 of 2) is significant"
            " on some pairs only.",
        ),
        (
            ((0.11, 0.06, 0.42), (0.01, 0.06, 0.01)),
            "its lead over x (0.100) is significant on no pair, and"
            " over SOLiD (1 of 2) on some pairs only.",
        ),
    ],
)
def test_a_headline_says_which_methods_differ_significantly(p_values, words):
    aucs = {"btc": (0.9, 0.8), "solid": (0.2, 0.1), "x": (0.1, 0.1)}
    place = ("stages", "town", "a")
    rest = (1, {STAGE: OWN}, "place")
    rows = [
        Row(*place, str(k), *rest, method, False, "fair", "auc", value)
        for method, values in aucs.items()
        for k, value in enumerate(values)
    ]
    differences = [
        MethodDifference(
            *(
                SimpleNamespace(method=method, pair=("town", "a", str(k)))
                for method in both
            ),
            None,
            p,
        )
        for k, some in enumerate(p_values)
        for both, p in zip(itertools.combinations(aucs, 2), some, strict=True)
    ]
    _, headline = ranked_methods(Results.of(rows), differences)
    assert headline == (
        "BTC has the greatest mean AUC of 3 methods, 0.850 over 2 pairs of"
        f" drives; {words}"
    )


def test_answers_that_are_only_too_far_stand_beside_the_ranking():
    """Two pairs: 3 of 10 and 9 of 30 wrong answers are within two radii."""
    values = {
        "auc": (0.4, 0.6),
        "r1": (0.5, 0.7),
        "too_far": (3.0, 9.0),
        "with_match": (10.0, 30.0),
        "pose_success": (0.8, 1.0),
    }
    rows = [
        Row(
            experiment="stages",
            map="town",
            database="a",
            query=str(pair),
            seed=1,
            factors={STAGE: stage},
            task="pose" if metric == "pose_success" else "place",
            method="btc",
            gate=False,
            protocol="fair",
            metric=metric,
            # Without the change all is well.
            value=both[pair] if stage == OWN else 100.0,
        )
        for metric, both in values.items()
        for pair in (0, 1)
        for stage in (LAST, OWN)
    ]
    means = {
        name: {method: one.value for method, one in found.items()}
        for name, found in further_columns(Results.of(rows)).items()
    }
    assert means == {
        "R@1": {"btc": pytest.approx(0.6)},
        "near miss": {"btc": pytest.approx(0.3)},
        "pose success": {"btc": pytest.approx(0.9)},
    }


def test_visible_change_stands_beside_that_of_the_control(tmp_path):
    """Half of 0.4 is parallax; a query without a match does not count."""
    content = make_content(tmp_path)
    (pair,) = content.evidence
    known = replace(
        content.evidence[pair],
        overlaps=np.array([0.5, 0.7, 0.6, 0.6, nan]),
        unchanged=np.array([0.8, 0.8, 0.8, 0.8, nan]),
    )
    results = make_results(content.pairs, {pair: known})
    found = {
        (row[STAGE], row.metric): row.value
        for row in results.where(method="scan-context++").rows
        if row.metric.startswith("visible_change")
    }
    assert found == {
        (LAST, "visible_change"): pytest.approx(0.2),
        (LAST, "visible_change_added"): 0.0,
        (OWN, "visible_change"): pytest.approx(0.4),
        (OWN, "visible_change_added"): pytest.approx(0.2),
    }
    table = recognition_table(content.recognitions, (), evidence={pair: known})
    shown = table.rows[0][table.header.index("visible change")]
    assert (shown.value, shown.printed) == pytest.approx((0.4, 0.2))
    # Other queries are no baseline.
    other = replace(known, unchanged=np.array([0.8]))
    assert math.isnan(other.visible_change_added)


def test_survival_comes_next(text):
    section = text[text.index('<section id="survival">') :]
    section = section[: section.index("</section>")]
    # One pair has a control. By hand: of four queries with a match two are
    # right with the change, four without.
    body = section[section.index('<th scope="col">R@1</th>') :]
    row = re.search(
        r"Scan Context\+\+</th><td>(.*?)</td><td>(.*?)</td><td><b>(.*?)</b>",
        body,
    )
    assert row.groups() == ("1.000", "0.500", "50 %")
    assert "For 1 of 2 pairs no control was driven" in text
    assert section.count("<td>no control</td>") == 4
    assert 'alt="kept"' in section


def test_text_is_escaped(text):
    assert "A &lt; B &amp; C." in text
    assert "curves &#34;P&#34; &lt; R" in text
    assert "gone &lt; new" in text
    assert 'class="verdict does-not-hold"' in text


def test_figures_stand_in_their_sections(text):
    change = text[text.index('<section id="change">') :]
    change = change[: change.index("</section>")]
    assert "before and after" in change
    assert "--panels:2" in change
    assert "background:rgb(200, 0, 0)" in change
    assert "curves" not in change
    assert "curves" in text[text.index('<section id="figures">') :]
    assert "not for the page" not in text


def test_legends_of_charts_have_their_markers(tmp_path):
    (tmp_path / "chart.svg").write_text("<svg/>")
    styles = method_styles(["solid", "btc"])
    one = Illustration(tmp_path / "chart", "a chart", "svg", methods=styles)
    content = make_content(tmp_path, illustrations=[one])
    write_page(tmp_path / "report.html", content)
    text = (tmp_path / "report.html").read_text()
    text = text[text.index('<section id="figures">') :]
    for name, (colour, _, marker) in styles.items():
        shape = f'<polygon points="{marker_corners(marker)}" fill="{colour}"/>'
        assert f"{shape}</svg>{name}</span>" in text


def test_means_without_intervals_are_explained(tmp_path):
    content = make_content(tmp_path)
    for low, is_told in ((0.0, False), (nan, True)):
        rows = [
            replace(row, low=low, high=low) if row.metric == "auc" else row
            for row in content.results.rows
        ]
        changed = make_content(tmp_path, results=Results.of(rows))
        write_page(tmp_path / "report.html", changed)
        text = (tmp_path / "report.html").read_text()
        assert ("The means have no intervals" in text) == is_told
        assert ("95&nbsp;% intervals" in text) != is_told


def test_recordings_are_linked(tmp_path):
    content = make_content(tmp_path, pages=PAGES)
    write_page(tmp_path / "report.html", content)
    text = (tmp_path / "report.html").read_text()
    # The picture is in the summary and with the map; the browser draws its own.
    address = "../pages/metropolis_04.html?a=1&amp;b"
    assert text.count(f'<a href="{address}">') == 2
    data = browser_data(content.recognitions, content.drives, {}, PAGES, {})
    assert data["drives"]["metropolis_04"]["page"] == PAGES["metropolis_04"]
    assert data["drives"]["metropolis_01"]["page"] is None


def test_browser_data(content):
    data = browser_data(
        content.recognitions,
        content.drives,
        {PAIR: 0.25},
        {},
        content.evidence,
    )
    pair, back = data["pairs"]
    assert pair["change"] == 0.25
    assert back["change"] is None
    assert pair["matches"] == [[0, 1], [1, 2, 3], [3, 4, 5], [5, 6, 7], []]
    scan_context, ring = pair["methods"]
    assert scan_context["best"][1] == [9, 0, 1, 2, 3]
    assert scan_context["scores"][1][:2] == [0.9, 0.2]
    assert scan_context["best"][2] == []
    # At (10, 2) places 1, 2, 3 are true, and second to fourth are 0, 1, 2.
    assert scan_context["ranks"] == [1, 3, None, 1, None]
    assert scan_context["why"] == [
        "",
        "twin",
        "no_candidate",
        "",
        "no_place",
    ]
    assert [one["why"] for one in back["methods"]] == [None]
    assert ring["ranks"] == [1, 1, 1, 6, None]
    assert data["drives"]["metropolis_04"]["yaw"] == [1.571] * 5


def test_reasons_are_offered_and_counted(text):
    choice = text[text.index('<select id="why">') :]
    choice = choice[: choice.index("</select>")]
    assert re.findall(r'value="(\w*)"', choice) == ["", *FAULT_KINDS[1:]]
    section = text[text.index("Why top-ranked places are wrong") :]
    row = re.search(r"<tr>.*?Scan Context\+\+.*?</tr>", section, re.S).group()
    # Two that have a place are wrong: perceptual aliasing, and no candidate.
    assert "<td>2</td>" in row
    assert re.findall(r"(\d+) %", row) == ["50", "50"]


def test_many_scans_are_thinned(content, monkeypatch):
    monkeypatch.setattr("evaluation.report.page_data._POINTS_OF_A_PAGE", 150)
    data = browser_data(content.recognitions, content.drives, {}, {}, {})
    assert data["drives"]["metropolis_01"]["counts"] == [10] * 10


def test_maps_are_held_once(content, text):
    for drive in content.drives.values():
        view = base64.b64encode(drive.view).decode()
        assert text.count(view) == 1


def test_route_from_red_to_blue(content):
    drive = content.drives["metropolis_04"]
    picture = route_picture(drive)
    pieces = re.findall(
        r'<polyline stroke="#(..)(..)(..)" points="([^"]*)"', picture
    )
    lines = [
        [tuple(map(float, p.split(","))) for p in points.split()]
        for *_, points in pieces
    ]
    # Each piece begins at the end of the one before; y points down.
    assert all(a[-1] == b[0] for a, b in itertools.pairwise(lines))
    assert lines[0][0] == (0.0, -2.0)
    assert lines[-1][-1] == (100.0, -2.0)
    first, last = (
        [int(value, 16) for value in piece[:3]]
        for piece in (pieces[0], pieces[-1])
    )
    assert first[0] > 2 * first[2]
    assert last[2] > 1.1 * last[0]
    left, right, bottom, top = drive.extent
    box = re.search(r'viewBox="([^"]*)"', picture)[1]
    assert [float(value) for value in box.split()] == pytest.approx(
        [left, -top, right - left, top - bottom], abs=0.06
    )


def test_page_without_recognition_has_no_browser(content, tmp_path):
    empty = make_content(
        tmp_path,
        recognitions=[],
        pairs=[],
        illustrations=[],
    )
    write_page(tmp_path / "report.html", empty)
    text = (tmp_path / "report.html").read_text()
    assert "Queries, one by one" not in text
    assert '<script type="application/json" id="data">null</script>' in text
    # Drives are shown nevertheless, each under its own name.
    assert "<h3>metropolis_01</h3>" in text
    assert re.findall(r'<a href="#(\w+)">', text) == ["summary", "maps"]


def test_a_page_without_pairs_has_no_ranking(tmp_path):
    empty = make_content(
        tmp_path,
        recognitions=[],
        pairs=[],
        illustrations=[],
        reference=Reference(),
    )
    write_page(tmp_path / "report.html", empty)
    text = (tmp_path / "report.html").read_text()
    assert re.findall(r'<a href="#(\w+)">', text) == ["maps"]
    assert '<details class="part"' not in text


def test_a_page_says_what_made_it(tmp_path):
    words = ["cns-drake 9.9", "solid rings=8 & more"]
    content = make_content(tmp_path, made_by=words)
    write_page(tmp_path / "report.html", content)
    text = (tmp_path / "report.html").read_text()
    assert "Made by cns-drake 9.9; solid rings=8 &amp; more" in text


def test_tables_of_two_protocols_are_apart(tmp_path):
    fair = replace(make_result("ring++", [1, 2, 4, 0, 3]), protocol_name="fair")
    again = make_result("ring++", [0, 2, 4, 6, 3])
    content = make_content(
        tmp_path,
        recognitions=[fair],
        pairs=[(fair, None)],
        evidence={},
        repeated=[again],
        reference=Reference("the paper"),
    )
    write_report(content, tmp_path)
    text = (tmp_path / "report.html").read_text()
    headings = [
        "Protocol of this report: fair",
        "Protocol of the paper: paper",
    ]
    assert re.findall(r"<h3>(Protocol .*?)</h3>", text) == headings
    tables = text.split("<h3>Protocol ")[1:]
    for table, result in zip(tables, (fair, again), strict=True):
        body = table[: table.index("</table>")]
        # A row for each mode.
        assert body.count("<tr>") == 3
        assert f"{result.by_mode['all'].auc:.4f}" in body
        assert body.count(f">{result.protocol_name}</td>") == 2
    lines = (tmp_path / "report.md").read_text().splitlines()
    assert [line[4:] for line in lines if line.startswith("### ")] == headings
