import csv

from drive_files import make_scan, write_recording, yaw_pose
import numpy as np
import pytest

from evaluation import paper
from evaluation.collection import find_cities
from evaluation.errors import InputError
from evaluation.figures import judge_points
from evaluation.report import write_report
from evaluation.tables import Table

ROUTES = {"a": {"lanes": [1]}, "b": {"lanes": [2]}}


def make_town(stage):
    rng = np.random.default_rng(3)
    ground = rng.uniform([-40, -40], [120, 40], (4000, 2))
    parts = [np.c_[ground, np.zeros(4000)]]
    for block in range(6):
        box = rng.uniform(size=(500, 3)) * [12.0, 10.0, 20.0]
        box += np.array([-30.0 + 25.0 * block, 15.0, 0.0])
        if stage != "01" or block % 2:
            parts.append(box)
    return np.concatenate(parts)


def drive(folder, stage, route, *, city="metropolis", scenario=True):
    points = make_town(stage)
    scans, X_WBs = [], []
    for i in range(9):
        X_WB = yaw_pose(10.0 * i, 2.0 if route == "a" else -2.0, 0.0, 0.05)
        p = (points - X_WB[:3, 3]) @ X_WB[:3, :3]
        near = p[np.linalg.norm(p, axis=1) < 60.0]
        scans.append(make_scan(near - [0.0, 0.0, 1.6]))
        X_WBs.append(X_WB)
    attachments = {
        "scenario.json": {"map": city, "stage": stage, "route": ROUTES[route]}
    }
    write_recording(
        folder, scans, X_WBs, attachments=attachments if scenario else None
    )


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings")
    drive(folder / "metropolis_01", "01", "a")
    drive(folder / "metropolis_04", "04", "b")
    drive(folder / "metropolis_04_control", "04", "a")
    (folder / "notes.txt").write_text("no recording")
    return folder


def test_recordings_find_their_roles(recordings):
    (city,) = find_cities(recordings)
    assert city.name == "metropolis"
    assert list(city.stages) == ["01", "04"]
    assert city.stages["04"].name == "metropolis_04"
    (pair,) = city.change_pairs()
    assert [one.stage for one in pair] == ["01", "04"]
    assert city.control(*pair).name == "metropolis_04_control"


def test_both_directions_where_the_paper_has_them(tmp_path):
    for stage in ("01", "02"):
        drive(tmp_path / f"riverside_{stage}", stage, "a", city="riverside")
    (city,) = find_cities(tmp_path)
    assert [
        (database.stage, query.stage)
        for database, query in city.recognition_pairs()
    ] == [("01", "02"), ("02", "01")]


def test_names_serve_without_scenarios(tmp_path):
    for name in ("old_town_1", "old_town_2"):
        drive(tmp_path / name, name[-1:], "a", scenario=False)
    (city,) = find_cities(tmp_path)
    assert city.name == "old_town"
    assert list(city.stages) == ["1", "2"]
    assert city.control(*city.change_pairs()[0]) is None
    drive(tmp_path / "unnamed", "01", "a", scenario=False)
    with pytest.raises(InputError, match="unnamed: neither a scenario nor"):
        find_cities(tmp_path)


def test_no_recordings_or_too_many(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        find_cities(tmp_path / "none")
    with pytest.raises(InputError, match="no recorded sequence"):
        find_cities(tmp_path)
    drive(tmp_path / "first", "01", "a")
    drive(tmp_path / "second", "01", "a")
    with pytest.raises(InputError, match="2 recordings of metropolis at"):
        find_cities(tmp_path)


def test_report(recordings, tmp_path):
    path = write_report(recordings, tmp_path / "out")
    text = path.read_text()
    with (tmp_path / "out" / "tcr.csv").open(newline="") as stream:
        (change,) = csv.DictReader(stream)
    assert change["map"] == "metropolis"
    assert change["stages"] == "01 <-> 04"
    assert float(change["paper"]) == 0.2920
    assert 0.03 < float(change["TCR_sym"]) < 0.5
    assert float(change["same stage, both routes"]) < 0.02
    assert f"{float(change['TCR_sym']):.4f}" in text
    with (tmp_path / "out" / "place_recognition.csv").open(
        newline=""
    ) as stream:
        every, filtered = (
            row
            for row in csv.DictReader(stream)
            if row["method"] == "scan-context++"
        )
    assert [every["mode"], filtered["mode"]] == ["all", "filtered"]
    # The paper's Scan Context++ counts all queries.
    assert float(every["paper's R@1"]) == 0.2993
    assert filtered["paper's R@1"] == ""
    assert every["N (with a match)"] == "9"
    figures = {p.name for p in (tmp_path / "out" / "figures").iterdir()}
    assert figures == {
        "change_metropolis_01_04.png",
        "route_metropolis_01.png",
        "route_metropolis_04.png",
        "pr_metropolis.pdf",
        "pr_metropolis.png",
    }
    for name in figures - {"pr_metropolis.pdf"}:
        assert f"](figures/{name})" in text


def test_report_is_the_same_every_time(recordings, tmp_path):
    for name in ("first", "second"):
        write_report(recordings, tmp_path / name)
    for path in sorted((tmp_path / "first").rglob("*.*")):
        other = tmp_path / "second" / path.relative_to(tmp_path / "first")
        assert path.read_bytes() == other.read_bytes(), path.name


def test_report_of_a_single_stage(tmp_path):
    drive(tmp_path / "in" / "metropolis_01", "01", "a")
    text = write_report(tmp_path / "in", tmp_path / "out").read_text()
    assert "route_metropolis_01.png" in text
    assert "Temporal change ratio" not in text


def test_scans_without_points_are_refused(tmp_path):
    nothing = [make_scan(np.empty((0, 3)))] * 2
    write_recording(
        tmp_path / "town_01", nothing, [yaw_pose(x, 0, 0, 0) for x in (0, 1)]
    )
    with pytest.raises(InputError, match="town_01: no scan holds a point"):
        write_report(tmp_path, tmp_path / "out")


def test_output_that_cannot_be_written(recordings, tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InputError, match=f"^{tmp_path / 'out'}"):
        write_report(recordings, tmp_path / "out")


def test_change_picture_asks_the_metric():
    other = np.array(
        [[x, y, z] for x in (0, 20) for y in (0, 20) for z in (0, 20)], float
    )
    points = np.array(
        [
            [0.0, 0.0, 4.4],
            [0.0, 0.0, 4.6],
            [10.0, 10.0, 10.0],
            [40.0, 0.0, 0.0],
            [24.0, 0.0, 0.0],
        ]
    )
    absent, in_hull = judge_points(points, other)
    assert absent.tolist() == [False, True, True, True, False]
    assert in_hull.tolist() == [True, True, True, False, False]


def test_table():
    table = Table(
        ("name", "value", "count"),
        (("a", 0.123456, 3), ("b", None, 4), ("c", float("nan"), 5)),
    )
    assert table.to_csv() == "name,value,count\na,0.123456,3\nb,,4\nc,,5\n"
    assert table.to_markdown() == (
        "| name | value | count |\n| --- | --- | --- |\n"
        "| a | 0.1235 | 3 |\n| b | – | 4 |\n| c | – | 5 |\n"
    )


def test_paper_values():
    change = paper.tcr_values()
    assert len(change) == 9
    # The first misprint: Table I prints 0.1120 here.
    assert change["downtown", "01", "04"] == 0.1674
    recognition = paper.recognition_values()
    assert len(recognition) == 40
    # The second: R@1 is printed as 0.9626.
    value = recognition["riverside", "02", "01", "ring++", "filtered"]
    assert value.recall_at_1 == 0.7626
    # All of RING++ then obeys F1 = 2 R / (1 + R), to the printed digits.
    for key, value in recognition.items():
        if key[3] == "ring++":
            r = value.recall_at_1
            assert value.f1_max == pytest.approx(2 * r / (1 + r), abs=1.1e-4)
