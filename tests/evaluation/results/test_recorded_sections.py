"""Sections with what only recordings have: routes, changes and queries."""

import base64
from dataclasses import replace
import re

from helpers.small_page import make_content
import numpy as np
import pytest

from evaluation.maps import thumbnail
from evaluation.results import browser_section, make_page_drive, routes_section

PAGES = {"metropolis_04": "../pages/metropolis_04.html?a=1&b"}


@pytest.fixture(scope="module")
def content():
    return make_content()


@pytest.fixture(scope="module")
def text(content, tmp_path_factory):
    return content.write(tmp_path_factory.mktemp("page")).read_text()


def test_page_stands_alone(text):
    assert "{{" not in text
    # The only addresses are the tables beside the page, those within the page
    # and XML's names.
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert sources
    beside = [s for s in sources if not s.startswith(("data:", "#"))]
    assert beside == ["results.csv", "queries.csv"]
    assert 'src="http' not in text


def test_links_lead_to_sections(text):
    links = re.findall(r'<a href="#(\w+)">', text)
    assert links == [
        "found", "means", "browser", "routes", "change", "conditions",
        "made_by",
    ]  # fmt: skip
    assert re.findall(r'<section id="(\w+)">', text) == links


def test_names_are_escaped(tmp_path):
    content = make_content(stages=("<b>", "04"))
    text = content.write(tmp_path).read_text()
    assert "What changed in metropolis from &lt;b&gt; to 04" in text
    section = routes_section({"<u>": content.drives.values()}, {})
    assert "<h3>&lt;u&gt;</h3>" in section.body


def view_from_above(points, positions):
    """Returns the extent of a drive's picture; the drive has no scans."""
    X_WS = np.tile(np.eye(4), (len(positions), 1, 1))
    X_WS[:, :3, 3] = positions
    return make_page_drive("a", points, X_WS, [0], []).extent


def test_view_from_above_shows_the_route_and_60_m_around():
    x = np.arange(0.25, 1000.0, 0.5)
    line = np.stack([x, np.full_like(x, 3.0), np.zeros_like(x)], axis=1)
    positions = np.array([[400.0, 3.0, 1.6], [500.0, 3.0, 1.6]])
    left, right, bottom, top = view_from_above(line, positions)
    np.testing.assert_allclose([left, right], [340.0, 560.0], atol=2.0)
    assert bottom <= 3.0 <= top
    # Without a point in view the whole map is shown.
    _, right, _, _ = view_from_above(
        line, positions + np.array([0.0, 500.0, 0.0])
    )
    assert right > 990.0


def test_recordings_are_linked(tmp_path):
    content = make_content(pages=PAGES)
    text = content.write(tmp_path).read_text()
    # The browser makes its own link.
    address = "../pages/metropolis_04.html?a=1&amp;b"
    assert text.count(f'<a href="{address}">') == 1
    data = browser_section(content.outcomes, content.drives, PAGES).data
    assert data["drives"]["metropolis_04"]["page"] == PAGES["metropolis_04"]
    assert data["drives"]["metropolis_01"]["page"] is None


def test_browser_data(content):
    data = browser_section(content.outcomes, content.drives, {}).data
    pair, back = data["pairs"]
    assert pair["label"] == "metropolis_01 → metropolis_04"
    assert back["label"] == "metropolis_04 → metropolis_01"
    assert pair["matches"] == [[0, 1], [1, 2, 3], [3, 4, 5], [5, 6, 7], []]
    scan_context, ring = pair["methods"]
    assert scan_context["best"][1] == [9, 0, 1, 2, 3]
    assert scan_context["scores"][1][:2] == [0.9, 0.2]
    assert scan_context["best"][2] == []
    # At (10, 2) places 1, 2, 3 are true, and second to fourth are 0, 1, 2.
    assert scan_context["ranks"] == [1, 3, None, 1, None]
    assert scan_context["why"] == [
        "",
        "elsewhere",
        "no_candidate",
        "",
        "no_place",
    ]
    assert ring["ranks"] == [1, 1, 1, 6, None]
    assert data["drives"]["metropolis_04"]["yaw"] == [1.571] * 5


def test_reasons_are_offered(text):
    choice = text[text.index('<select id="why">') :]
    choice = choice[: choice.index("</select>")]
    assert re.findall(r'value="(\w*)">([\w ]+)<', choice) == [
        ("", "any reason"),
        ("no_candidate", "no candidate"),
        ("near_miss", "near miss"),
        ("elsewhere", "elsewhere"),
    ]


def test_many_scans_are_thinned(content):
    """A page has 5 million points."""
    name, number = "metropolis_01", 4_000
    points = np.random.default_rng(2).uniform(-60.0, 60.0, (4_000, 3))
    scan = thumbnail(points, 61.0, 0)
    drive = replace(
        content.drives[name],
        frames=np.arange(number),
        X_WS=np.tile(np.eye(4), (number, 1, 1)),
        thumbnails=[scan] * number,
    )
    data = browser_section(
        content.outcomes, {**content.drives, name: drive}, {}
    ).data
    most = 5_000_000 // (number + 5)
    assert len(scan) > most
    assert data["drives"][name]["counts"] == [most] * number


def test_maps_are_held_once(content, text):
    for drive in content.drives.values():
        view = base64.b64encode(drive.view).decode()
        assert text.count(view) == 1


def test_route_has_a_direction(content):
    drive = content.drives["metropolis_04"]
    picture = routes_section({"metropolis": [drive]}, {}).body

    def places(points):
        return [tuple(map(float, p.split(","))) for p in points.split()]

    (route, _) = re.findall(r'<polyline[^>]* points="([^"]*)"', picture)
    # y points down.
    assert places(route)[0] == (0.0, -2.0)
    assert places(route)[-1] == (100.0, -2.0)
    *arrows, _ = re.findall(r'<polygon points="([^"]*)"', picture)
    assert len(arrows) == 11
    for tip, left, right in map(places, arrows):
        assert tip[1] == -2.0
        assert tip[0] > left[0] == right[0]
    # It is not a kilometre long.
    assert " km</text>" not in picture
    left, right, bottom, top = drive.extent
    box = re.search(r'viewBox="([^"]*)"', picture)[1]
    assert [float(value) for value in box.split()] == pytest.approx(
        [left, -top, right - left, top - bottom], abs=0.06
    )
