import html
import re
import shutil
import subprocess

import numpy as np
import pytest

from evaluation.findings import Finding
from evaluation.maps import voxelise
from evaluation.methods import make_method
from evaluation.page import PageContent, write_page
from evaluation.page_data import Illustration, browser_data, make_drive
from evaluation.place_recognition import judge_retrieval
from evaluation.points import from_xyz
from evaluation.results import (
    RecognitionResult,
    audit_table,
    change_table,
    recognition_table,
)
from evaluation.retrieval import Retrieval
from evaluation.thumbnails import thumbnail

PLACES = 5.0 * np.arange(10)
QUERIES = np.array([0.0, 10.0, 20.0, 30.0, 100.0])
PAIR = ("metropolis", "01", "04")


def make_poses(xs, y, yaw):
    X = np.tile(np.eye(4), (len(xs), 1, 1))
    X[:, :2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    X[:, 0, 3], X[:, 1, 3], X[:, 2, 3] = xs, y, 1.6
    return X


def make_page_drive(name, xs, y, yaw):
    rng = np.random.default_rng(5)
    ground = np.c_[rng.uniform(-60, 160, (4000, 2)), np.zeros(4000)]
    fine, _ = voxelise(from_xyz(ground), 0.5)
    # A wall that is 20 m ahead.
    wall = np.c_[np.full(200, 20.25), np.linspace(-9, 9, 200), np.ones(200)]
    scans = [thumbnail(wall, 1.6, i) for i in range(len(xs))]
    return make_drive(name, fine, make_poses(xs, y, yaw), range(len(xs)), scans)


def make_result(method, best):
    """Scores 0.9 for the best place of each query, 0.2 for its neighbours.

    A query whose best place is None has no candidate.
    """
    scores = np.full((len(QUERIES), len(PLACES)), np.nan)
    for row, place in zip(scores, best, strict=True):
        if place is not None:
            row[:] = 0.2 - 0.001 * np.arange(len(PLACES))
            row[place] = 0.9
    distances = np.hypot(QUERIES[:, None] - PLACES, 2.0)
    retrieval = Retrieval(
        np.arange(len(QUERIES)), np.arange(len(PLACES)), scores, distances
    )
    outcome = judge_retrieval(
        make_method(method, {}), "metropolis_01", "metropolis_04", retrieval
    )
    return RecognitionResult.of(PAIR[0], PAIR[1:], outcome)


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    stem = tmp_path_factory.mktemp("figures") / "pr"
    stem.with_suffix(".svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"></svg>'
    )
    results = [
        make_result("scan-context++", [0, 9, None, 6, 3]),
        make_result("ring++", [1, 2, 4, 0, 3]),
    ]
    return PageContent(
        findings=[Finding("A < B & C.", "does not hold", "1 of 2.")],
        changes=[],
        change=change_table([]),
        recognition=[
            recognition_table(results, [], mode)
            for mode in (None, "all", "filtered")
        ],
        audit=audit_table(results),
        illustrations=[Illustration(stem, 'curves "P" < R', "svg")],
        recognitions=results,
        drives={
            "metropolis_01": make_page_drive("metropolis_01", PLACES, 0, 0.0),
            "metropolis_04": make_page_drive(
                "metropolis_04", QUERIES, 2.0, 0.5 * np.pi
            ),
        },
    )


@pytest.fixture(scope="module")
def page(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_page(path, content)
    return path


def test_page_stands_alone(page):
    text = page.read_text()
    assert "{{" not in text
    # No address but those within the page and of XML's names.
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert sources
    assert all(s.startswith(("data:", "#")) for s in sources)
    assert not re.findall(r"https?://", text)


def test_text_is_escaped(page):
    text = page.read_text()
    assert "A &lt; B &amp; C." in text
    assert "curves &quot;P&quot; &lt; R" in text
    assert 'class="verdict does-not-hold"' in text


def test_browser_data(content):
    data = browser_data(content.recognitions, content.drives, {PAIR: 0.25})
    (pair,) = data["pairs"]
    assert pair["change"] == 0.25
    assert pair["matches"] == [[0, 1], [1, 2, 3], [3, 4, 5], [5, 6, 7], []]
    scan_context, ring = pair["methods"]
    assert scan_context["best"][1] == [9, 0, 1, 2, 3]
    assert scan_context["scores"][1][:2] == [0.9, 0.2]
    assert scan_context["best"][2] == []
    # At (10, 2) places 1, 2, 3 are true, and second to fourth are 0, 1, 2.
    assert scan_context["ranks"] == [1, 3, None, 1, None]
    assert ring["ranks"] == [1, 1, 1, 6, None]
    assert data["drives"]["metropolis_04"]["yaw"] == [1.571] * 5


def test_many_scans_are_thinned(content, monkeypatch):
    monkeypatch.setattr("evaluation.page_data._POINTS_OF_A_PAGE", 150)
    data = browser_data(content.recognitions, content.drives, {})
    assert data["drives"]["metropolis_01"]["counts"] == [10] * 10


def test_page_without_recognition_has_no_browser(content, tmp_path):
    empty = PageContent(
        content.findings, [], content.change, [], audit_table([]), [], [], {}
    )
    write_page(tmp_path / "report.html", empty)
    text = (tmp_path / "report.html").read_text()
    assert "Queries, one by one" not in text
    assert '<script type="application/json" id="data">null</script>' in text


# Handles the page as a reader would, and notes what it then says.
_READER = """<script>
(async () => {
  const notes = [];
  const shown = async (state) => {
    while (document.body.dataset.shown !== state)
      await new Promise((resume) => setTimeout(resume, 20));
    notes.push([state, byId("status").textContent,
      byId("query-caption").textContent, byId("match-caption").textContent,
      byId("all-methods").tBodies[0].innerText].join(" | "));
  };
  const set = (id, value, event) => {
    byId(id).value = value;
    byId(id).dispatchEvent(new Event(event));
  };
  const count = (id, test) => {
    const canvas = byId(id);
    const pixels = canvas.getContext("2d").getImageData(
      0, 0, canvas.width, canvas.height).data;
    let number = 0;
    for (let i = 0; i < pixels.length; i += 4)
      if (pixels[i + 3] > 0 && test(...pixels.slice(i, i + 3))) number += 1;
    return number;
  };
  await shown("0/0/0/0");
  byId("next-wrong").click();
  await shown("0/0/1/0");
  notes.push("orange " + count("map", (r, g, b) =>
    r > 220 && g > 140 && g < 175 && b < 20));
  byId("best").tBodies[0].rows[1].click();
  await shown("0/0/1/1");
  set("query", 2, "input");
  await shown("0/0/2/0");
  set("method", 1, "change");
  await shown("0/1/2/0");
  const blue = (r, g, b) => b > r + 30;
  notes.push("wall " + count("query-scan", blue));
  byId("next").click();
  byId("next").click();
  byId("next").click();
  await shown("0/1/4/0");
  notes.push("too wide by " + (
    document.documentElement.scrollWidth - document.documentElement.clientWidth
  ));
  document.body.dataset.notes = JSON.stringify(notes);
})();
</script></body>"""


def run_chromium(page, tmp_path, *options):
    return subprocess.run(
        [
            "chromium",
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            f"--user-data-dir={tmp_path / 'profile'}",
            *options,
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium")
@pytest.mark.parametrize("size", ["1400,1000", "390,844"])
def test_reader_goes_through_queries(page, tmp_path, size):
    watched = tmp_path / "watched.html"
    watched.write_text(page.read_text().replace("</body>", _READER))
    done = run_chromium(
        watched, tmp_path, f"--window-size={size}", "--dump-dom"
    )
    assert ":CONSOLE" not in done.stderr
    notes = re.search(r'data-notes="([^"]*)"', done.stdout)
    assert notes is not None
    text = html.unescape(notes[1])
    for expected in (
        "0/0/0/0 | Query 1 of 5, Scan Context++: right – best match 2.0 m"
        " away, score 0.9000 | Query: metropolis_04, frame 0 | Match 1:"
        " metropolis_01, frame 0",
        # From (10, 2) to (45, 0).
        "0/0/1/0 | Query 2 of 5, Scan Context++: wrong – best match 35.1 m",
        "Match 2: metropolis_01, frame 0",
        "0/0/2/0 | Query 3 of 5, Scan Context++: no candidate | Query:"
        " metropolis_04, frame 2 | No candidate",
        "0/1/2/0 | Query 3 of 5, RING++: right – best match 2.0 m",
        "0/1/4/0 | Query 5 of 5, RING++: no true place",
    ):
        assert expected in text
    # Wide things scroll by themselves.
    assert "too wide by 0" in text
    # The match and the wall are drawn.
    assert int(re.search(r"orange (\d+)", text)[1]) > 20
    assert int(re.search(r"wall (\d+)", text)[1]) > 20
