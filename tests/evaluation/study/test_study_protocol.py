"""Reports by another protocol than the paper's."""

import csv

from helpers import studies
from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.small_towns import ROUTES, drive, make_town
import numpy as np
import pytest

from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("unrendered_figures"),
]

SOLID = (MethodChoice("solid"),)


def read(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def drive_and_return(folder, stage):
    """Writes a drive of 80 m along the street of the town, and back."""
    points = make_town(stage)
    places = [10.0 * k for k in range(9)]
    poses = [yaw_pose(x, 2.0, 0.0, 0.0) for x in places]
    poses += [yaw_pose(x, -2.0, 0.0, np.pi) for x in places[::-1]]
    scans = []
    for X_WB in poses:
        p = (points - X_WB[:3, 3]) @ X_WB[:3, :3]
        near = p[np.linalg.norm(p, axis=1) < 60.0]
        scans.append(make_scan(near - [0.0, 0.0, 1.6]))
    scenario = {"map": "metropolis", "stage": stage, "route": ROUTES["a"]}
    write_recording(
        folder, scans, poses, attachments={"scenario.json": scenario}
    )


@pytest.mark.night
def test_loop_closure_beside_the_pairs(tmp_path, capsys):
    drive(tmp_path / "in" / "metropolis_01", "01", "a")
    drive_and_return(tmp_path / "in" / "metropolis_04", "04")
    protocol = RetrievalProtocol(exclude_recent=0.2)
    out = tmp_path / "out"
    path = studies.report(tmp_path / "in", out, SOLID, protocol)
    rows = [
        r for r in read(out / "place_recognition.csv") if r["mode"] == "all"
    ]
    # The straight drive closes no loop, and is left out.
    pairs = ["01 → 04", "04 → 01", "04 → 04"]
    assert [row["DB → query"] for row in rows] == pairs
    assert {row["exclude_recent"] for row in rows} == {"0.2"}
    # The paper has values for the pair, but none for a loop.
    assert rows[0]["paper's AUC"] == "0.2582"
    assert rows[2]["paper's AUC"] == ""
    queries = [
        row
        for row in read(out / "query_details.csv")
        if row["db"] == row["query"] == "04"
    ]
    for row in queries:
        if row["match_stamp_ns"]:
            age = int(row["query_stamp_ns"]) - int(row["match_stamp_ns"])
            assert age >= 200_000_000
    assert sum(row["has_match"] == "1" for row in queries) >= 6
    survival = read(out / "survival.csv")
    assert [row["db"] for row in survival] == ["01", "04"]
    text = path.with_name("report.md").read_text()
    assert "places passed at least 0.2 s before" in text


def test_numbers_of_another_protocol_stand_without_the_papers(tmp_path):
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    protocol = RetrievalProtocol(radius=12.0)
    out = tmp_path / "out"
    path = studies.report(tmp_path / "in", out, SOLID, protocol)
    for row in read(out / "place_recognition.csv"):
        assert row["paper's AUC"] == ""
        assert row["radius"] == "12.0"
    text = path.with_name("report.md").read_text()
    assert "a match within 12 m" in text
    assert "as the paper seems" not in text


def test_another_protocol_measures_anew(tmp_path):
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    out = tmp_path / "out"
    seen = []
    for protocol in (
        RetrievalProtocol(),
        RetrievalProtocol(place_spacing=20.0),
        RetrievalProtocol(place_spacing=20.0, radius=12.0),
    ):
        studies.report(tmp_path / "in", out, SOLID, protocol)
        (first, *_) = read(out / "query_details.csv")
        recognised = read(out / "place_recognition.csv")[0]
        seen.append((first["places"], recognised["N (with a match)"]))
    assert [places for places, _ in seen] == ["9", "5", "5"]
    assert len({number for _, number in seen}) > 1
