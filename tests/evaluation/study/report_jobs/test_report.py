import base64
import csv
import io
import json

from helpers import dataset_folders, helipr_drive, studies
from helpers.contradictions import add_images
from helpers.drive_files import T0_NS, make_scan, write_recording, yaw_pose
from helpers.measured_pairs import place_outcome
from helpers.small_towns import drive
import numpy as np
from PIL import Image
import pytest

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster, choose_cluster
from cns_drake.base.jobs.running import run_jobs
from evaluation.drives import open_drive
from evaluation.methods import make_method, registry
from evaluation.paper import reference_for
from evaluation.recognition.protocol import (
    FAIR_PROTOCOL,
    PAPER_PROTOCOL,
    RetrievalProtocol,
)
from evaluation.study import chosen_methods
from evaluation.study.chosen_methods import choose_methods
from evaluation.study.recordings.map_drives import drives_by_map
from evaluation.study.recordings.recording_search import find_recordings
from evaluation.study.report_jobs.stages_report import (
    StagesReport,
    report_on_recordings,
)

pytestmark = pytest.mark.slow

# Describes a scan by its number of points.
OWN_METHOD = """
from dataclasses import dataclass

import numpy as np

from evaluation.methods import Method, register


@dataclass
class Count:
    points: int


@register("counting")
class Counting(Method):
    def describe(self, points):
        return Count(len(points))

    def build_database(self, places):
        return np.array([place.points for place in places])

    def score(self, query, database, *, exhaustive=False):
        return -np.abs(database - query.points).astype(float)
"""


@pytest.fixture(scope="module", autouse=True)
def some_methods():
    """One of each kind; `test_method_costs` compares all that ship."""
    names = ("btc", "layered-overlap", "scan-context++", "solid")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chosen_methods, "shipped_methods", lambda: names)
        yield


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings")
    drive(folder / "metropolis_01", "01", "a")
    drive(folder / "metropolis_04", "04", "b")
    drive(folder / "metropolis_04_control", "04", "a")
    stream = io.BytesIO()
    Image.new("RGB", (640, 480)).save(stream, "JPEG")
    add_images(
        folder / "metropolis_04" / "metropolis_04_0.mcap",
        "/front/image",
        {T0_NS: stream.getvalue()},
    )
    (folder / "notes.txt").write_text("no recording")
    return folder


def find_cities(folder):
    return drives_by_map(find_recordings(folder))


def test_recordings_find_their_roles(recordings):
    (city,) = find_cities(recordings)
    assert city.name == "metropolis"
    assert list(city.stages) == ["01", "04"]
    assert city.stages["04"].name == "metropolis_04"
    (pair,) = city.change_pairs()
    assert [one.stage for one in pair] == ["01", "04"]
    database, _ = city.unchanged_pair(*pair)
    assert database.name == "metropolis_04_control"


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
    assert city.unchanged_pair(*city.change_pairs()[0]) is None


def test_what_cannot_be_placed_is_left_out(tmp_path):
    drive(tmp_path / "unnamed", "01", "a", scenario=False)
    with pytest.raises(InputError, match="unnamed: map and stage are unknown"):
        find_cities(tmp_path)
    drive(tmp_path / "town_1", "01", "a", scenario=False)
    notes = []
    (found,) = find_recordings(tmp_path, notes.append)
    assert found.name == "town_1"
    (note,) = notes
    assert note.startswith(f"{tmp_path / 'unnamed'}: left out: map and")


@pytest.mark.parametrize(
    ("names", "stages"),
    [
        (("rosbag2_2024_01_15-10_32_11", "rosbag2_2024_03_02-09_05_47"), None),
        (("town_2012-2-4", "town_2012-10-28"), ["2012-2-4", "2012-10-28"]),
        (("old_town_1", "old_town_2"), ["1", "2"]),
        (("KAIST9", "KAIST10"), ["9", "10"]),
    ],
)
def test_names_with_dates_and_numbers(tmp_path, names, stages):
    for name in names:
        drive(tmp_path / name, "01", "a", scenario=False)
    (city,) = find_cities(tmp_path)
    ((first, second),) = city.change_pairs()
    assert (first.name, second.name) == names
    if stages:
        assert list(city.stages) == stages


def test_sessions_of_helipr_are_stages(tmp_path):
    for name in ("KAIST04", "KAIST05"):
        helipr_drive.write_drive(tmp_path / name)
    notes = []
    found = find_recordings(tmp_path, notes.append)
    assert [(one.map_name, one.stage) for one in found] == [
        ("KAIST", "04"),
        ("KAIST", "05"),
    ]
    assert len(notes) == 2
    assert "the scans of Ouster are read (--lidar reads" in notes[0]
    assert len(find_recordings(tmp_path, notes.append, lidar="Avia")) == 2
    assert len(notes) == 2


def test_a_wrong_guess_makes_no_empty_report(tmp_path):
    for name in ("walk_dry", "night_wet"):
        drive(tmp_path / "in" / name, "01", "a", scenario=False)
    with pytest.raises(InputError, match=r"in: night: nothing to .*guessed"):
        report_on_recordings(tmp_path / "in", tmp_path / "out", Cluster(1))
    assert not (tmp_path / "out").exists()


def test_drives_in_deeper_folders_are_told(tmp_path):
    for place in ("town_01", "night/town_02", "a/b/town_03", ".old/town_04"):
        folder = tmp_path / place
        folder.parent.mkdir(parents=True, exist_ok=True)
        drive(folder, folder.name[-2:], "a", city="town")
    notes = []
    (found,) = find_recordings(tmp_path, notes.append)
    assert found.name == "town_01"
    assert [
        note.partition(": left out: not directly")[0] for note in notes
    ] == [
        str(tmp_path / "a/b/town_03"),
        str(tmp_path / "night/town_02"),
    ]


def test_sequences_of_kitti_need_a_scenario(tmp_path):
    for number in ("05", "11"):
        (tmp_path / "sequences" / number / "velodyne").mkdir(parents=True)
    with pytest.raises(InputError, match=r"05: no scenario\.yaml.*2 drives"):
        find_recordings(tmp_path)
    drive(tmp_path / "town_01", "01", "a", city="town")
    notes = []
    find_recordings(tmp_path, notes.append)
    (note,) = notes
    assert note.endswith("(2 drives have none); left out")


def test_columns_are_the_users_and_what_is_assumed_is_said(tmp_path):
    folder = tmp_path / "kitti"
    for number in ("01", "02"):
        path = folder / "sequences" / number
        X = dataset_folders.make_poses(2)
        dataset_folders.write_matrices(path / "poses.txt", None, X, " ")
        (path / "times.txt").write_text("0\n1\n")
        text = f"name: town_{number}\nmap: town\nstage: '{number}'\n"
        (path / "scenario.yaml").write_text(f"{text}lidars: {{}}\n")
        for k in range(2):
            file = path / "velodyne" / f"{k:06d}.bin"
            file.parent.mkdir(exist_ok=True)
            np.ones(60, "<f4").tofile(file)
    # Other sequences of the benchmark, without a map, are passed over.
    (folder / "sequences/11/velodyne").mkdir(parents=True)
    found = find_recordings(folder, columns=5)
    assert len(find_recordings(folder / "sequences", columns=5)) == 2
    assert [len(one.source().scan(0)) for one in found] == [12, 12]
    others = find_recordings(folder, columns=4)
    assert [len(one.source().scan(0)) for one in others] == [15, 15]
    assert found[0].source.identity() != others[0].source.identity()
    notes = []
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        # All notes come before the work, for which there is no folder.
        report_on_recordings(
            folder,
            tmp_path / "file",
            choose_cluster(1, None),
            on_note=notes.append,
            columns=5,
        )
    (note,) = (one for one in notes if one.startswith("solid: "))
    assert "the LiDAR is not known" in note


def test_no_recordings_or_too_many(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        find_cities(tmp_path / "none")
    with pytest.raises(InputError, match="no recorded drive"):
        find_cities(tmp_path)
    drive(tmp_path / "first", "01", "a")
    drive(tmp_path / "second", "01", "a")
    with pytest.raises(InputError, match="2 recordings of metropolis at"):
        find_cities(tmp_path)


@pytest.fixture(scope="module")
def report(recordings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    studies.report(recordings, folder)
    return folder


def read_csv(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def forward(path):
    """Rows of the pair whose query is the later drive; a report has both."""
    return [
        row
        for row in read_csv(path)
        if row.get("db", "01") == "01"
        and row.get("DB → query", "01 → 04") == "01 → 04"
        and row.get("database", "metropolis_01") == "metropolis_01"
    ]


def test_change_beside_the_paper(report):
    change, real = read_csv(report / "tcr.csv")
    assert change["map"] == "metropolis"
    assert change["stages"] == "01 ↔ 04"
    assert float(change["paper"]) == 0.2920
    assert 0.03 < float(change["TCR_sym"]) < 0.5
    assert float(change["same stage, both routes"]) < 0.02
    # Visible change: the mean of the queries' own.
    seen = {
        row["query_frame"]: row["overlap"]
        for row in forward(report / "query_details.csv")
        if row["overlap"]
    }
    shares = np.array(list(seen.values()), dtype=float)
    assert int(change["queries"]) == len(shares) > 0
    assert float(change["visible change"]) == pytest.approx(1 - shares.mean())
    assert float(change["visible change"]) > 0.0
    assert (real["visible change"], real["queries"]) == ("", "")
    # Nor does the control's best match show all.
    seen = {
        (row["both.stage"], row["metric"]): float(row["value"])
        for row in forward(report / "results.csv")
        if row["metric"].startswith("visible_change")
    }
    assert 0.0 < seen["last", "visible_change"] < 1 - shares.mean()
    added = float(change["minus the control's"])
    assert added == pytest.approx(seen["own", "visible_change_added"])
    assert added == pytest.approx(
        1 - shares.mean() - seen["last", "visible_change"], abs=0.05
    )
    assert float(change["share left"]) == pytest.approx(
        added / (1 - shares.mean())
    )
    assert float(real["paper"]) == 0.1819
    assert real["TCR_sym"] == ""
    shown = f"{float(change['TCR_sym']):.4f}"
    for name in ("report.md", "tcr.md", "tcr.tex", "report.html"):
        assert shown in (report / name).read_text(), name


def test_recognition_beside_the_paper(report):
    fair, _, every, filtered = (
        row
        for row in forward(report / "place_recognition.csv")
        if row["method"] == "scan-context++"
    )
    assert (fair["protocol"], every["protocol"]) == ("fair", "paper")
    assert fair["paper's AUC"] == ""
    assert [every["mode"], filtered["mode"]] == ["all", "filtered"]
    # The paper's Scan Context++ counts all queries.
    assert float(every["paper's R@1"]) == 0.2993
    assert filtered["paper's R@1"] == ""
    assert every["N (with a match)"] == "9"
    assert float(every["AUC low"]) <= float(every["AUC"])
    assert float(every["AUC"]) <= float(every["AUC high"])
    shown = f"{float(every['AUC']):.4f}"
    for name in ("place_recognition.md", "place_recognition.tex"):
        text = (report / name).read_text()
        assert shown in text
        assert "0.2993" in text


def test_each_protocol_is_that_of_the_single_command(recordings, report):
    drives = [open_drive(recordings / f"metropolis_{k}") for k in ("01", "04")]
    found = {
        (row["method"], row["protocol"]): float(row["AUC"])
        for row in forward(report / "place_recognition.csv")
        if row["mode"] == "all"
    }
    # BTC's places differ between the two, those of SOLiD do not.
    for name in ("btc", "solid"):
        for protocol in (FAIR_PROTOCOL, PAPER_PROTOCOL):
            alone = place_outcome(
                *drives, make_method(name, {}), protocol=protocol
            )
            assert found[name, protocol.name] == alone.by_mode["all"].auc
    assert ("layered-overlap", "paper") not in found
    for name in ("survival", "differences", "query_details_unchanged"):
        rows = forward(report / f"{name}.csv")
        assert {row["protocol"] for row in rows} == {"fair"}


def test_numbers_by_the_protocol_of_the_paper_are_rows(report):
    kept = {
        (row["database"], row["method"]): row
        for row in read_csv(report / "published_protocol.csv")
        if row["metric"] == "auc" and row["gate"] == "0"
    }
    assert {row["protocol"] for row in kept.values()} == {"paper"}
    assert {row["experiment"] for row in kept.values()} == {"stages"}
    printed = {
        row["method"]: row["AUC"]
        for row in forward(report / "place_recognition.csv")
        if (row["mode"], row["protocol"]) == ("all", "paper")
    }
    assert printed == {
        method: row["value"]
        for (database, method), row in kept.items()
        if database == "metropolis_01"
    }
    protocols = {row["protocol"] for row in read_csv(report / "results.csv")}
    assert "paper" not in protocols


def test_metrics_of_other_benchmarks(report):
    rows = forward(report / "metrics.csv")
    audit = {
        (row["method"], row["protocol"]): row
        for row in forward(report / "place_recognition.csv")
        if row["mode"] == "all"
    }
    assert {(row["method"], row["protocol"]) for row in rows} == audit.keys()
    for row in rows:
        whole = audit[row["method"], row["protocol"]]
        assert row["recall_at_1"] == whole["R@1"]
        assert row["recall_at_1_percent"] == whole["R@1%"]
        assert row["auc_within_7.5_m"] == whole["AUC"]
        assert float(row["mean_reciprocal_rank"]) >= float(row["recall_at_1"])


def test_figures_for_print_and_page(report):
    stems = {
        "auc_over_tcr": "svg",
        "auc_over_tcr_published": "svg",
        "change_metropolis_01_04": "webp",
        "pr_metropolis": "svg",
        "routes_metropolis": "webp",
        "sets_metropolis_01_04": "webp",
        "survival": "svg",
    }
    names = {path.name for path in (report / "figures").iterdir()}
    assert names == {
        f"{stem}.{kind}"
        for stem, page_kind in stems.items()
        for kind in ("png", page_kind, *(["pdf"] if page_kind == "svg" else []))
    }
    text = (report / "report.md").read_text()
    for stem in stems:
        assert f"](figures/{stem}.png)" in text


def test_what_a_camera_saw(report):
    page = (report / "report.html").read_text()
    start = page.index(">", page.index('id="data"')) + 1
    data = json.loads(page[start : page.index("</script>", start)])
    assert data["drives"]["metropolis_01"]["images"] is None
    images = data["drives"]["metropolis_04"]["images"]
    assert set(images["nearest"]) == {0}
    picture = base64.b64decode(images["files"][0])
    assert Image.open(io.BytesIO(picture)).size == (320, 240)


def test_differences_of_every_two_methods(report):
    rows = forward(report / "differences.csv")
    survival = forward(report / "survival.csv")
    areas = {one["method"]: float(one["auc_changed"]) for one in survival}
    assert len(rows) == len(areas) * (len(areas) - 1) // 2
    for row in rows:
        expected = areas[row["method_a"]] - areas[row["method_b"]]
        assert float(row["difference"]) == pytest.approx(expected, abs=1e-12)
        assert row["gate"] == "0"


@pytest.mark.night
def test_report_is_the_same_for_any_number_of_workers(
    recordings, report, tmp_path
):
    report_on_recordings(
        recordings,
        tmp_path,
        Cluster(num_workers=2),
        reference_for=reference_for,
        with_tables=True,
    )
    files = studies.report_files(tmp_path)
    assert {"results.csv", "queries.csv"} < set(files)
    assert len(files) == 21 + 18
    assert files == studies.report_files(report)


def test_finished_jobs_start_no_process(recordings, report, monkeypatch):
    jobs = StagesReport(find_recordings(recordings), report).jobs()
    monkeypatch.setattr(Cluster, "connect", None)
    run_jobs(jobs, Cluster())
    (report / "figures" / "routes_metropolis.webp").rename(report / "aside")
    try:
        assert [j.name for j in jobs if not j.step.is_done()] == [
            "draw metropolis"
        ]
    finally:
        (report / "aside").rename(report / "figures/routes_metropolis.webp")


@pytest.mark.usefixtures("unrendered_figures")
def test_own_method_beside_the_others(
    recordings, few_methods, tmp_path, monkeypatch
):
    # Other tests do not find the method registered.
    monkeypatch.setattr(registry, "_METHODS", dict(registry._METHODS))
    path = tmp_path / "counting.py"
    path.write_text(OWN_METHOD)
    choices = choose_methods(["standard", path])
    studies.report(recordings, tmp_path / "out", choices)
    rows = read_csv(tmp_path / "out" / "place_recognition.csv")
    methods = list(dict.fromkeys(row["method"] for row in rows))
    assert methods == [*few_methods, "counting"]
    for name in ("report.md", "report.html"):
        assert "counting" in (tmp_path / "out" / name).read_text()


@pytest.mark.usefixtures("unrendered_figures", "few_methods")
def test_report_of_a_single_stage(tmp_path):
    drive(tmp_path / "in" / "metropolis_01", "01", "a")
    path = studies.report(tmp_path / "in", tmp_path / "out")
    assert path == tmp_path / "out" / "report.html"
    text = path.with_name("report.md").read_text()
    assert "routes_metropolis.png" in text
    said = "metropolis: nothing to compare: all drives are through stage 01"
    for name in ("report.md", "report.html"):
        assert said in path.with_name(name).read_text()
    notes = []
    report_on_recordings(
        tmp_path / "in", tmp_path / "out", Cluster(1), on_note=notes.append
    )
    (note,) = notes
    assert note.startswith(said)
    assert "--years" in note
    assert "a drive through another stage" in note
    # Notes are shown as they are.
    assert "`" not in note
    assert "Temporal change ratio" not in text
    page = path.read_text()
    assert "Queries, one by one" not in page
    assert "Which method survives" not in page
    tables = ("survival", "query_details", "query_details_unchanged")
    for name in (*tables, "results", "queries"):
        assert read_csv(tmp_path / "out" / f"{name}.csv") == []
    assert not (tmp_path / "out" / "published_protocol.csv").exists()


@pytest.mark.usefixtures("unrendered_figures")
def test_a_city_of_one_s_own_without_a_control(tmp_path, few_methods):
    for stage, route in (("01", "a"), ("02", "b")):
        drive(tmp_path / "in" / f"town_{stage}", stage, route, city="town")
    path = studies.report(tmp_path / "in", tmp_path / "out")
    rows = read_csv(path.with_name("survival.csv"))
    assert len(rows) == 2 * len(few_methods)  # Both ways.
    for row in rows:
        assert row["auc_unchanged"] == row["kept"] == ""
        assert 0.0 <= float(row["auc_changed"]) <= 1.0
    (change,) = read_csv(path.with_name("tcr.csv"))
    assert change["map"] == "town"
    for name in ("report.md", "report.html"):
        text = path.with_name(name).read_text()
        assert "Here no control was driven" in text
        assert "KAIST" not in text
        assert "City that Never Settles" not in text
        assert "as the paper seems" not in text
    assert not (path.parent / "figures" / "survival.png").exists()


@pytest.mark.night
@pytest.mark.usefixtures("unrendered_figures", "few_methods")
def test_several_cities(tmp_path):
    for stage in ("01", "02"):
        drive(
            tmp_path / "in" / f"riverside_{stage}", stage, "a", city="riverside"
        )
    drive(tmp_path / "in" / "metropolis_04", "04", "b")
    studies.report(tmp_path / "in", tmp_path / "out")
    rows = read_csv(tmp_path / "out" / "place_recognition.csv")
    pairs = dict.fromkeys((row["map"], row["DB → query"]) for row in rows)
    assert list(pairs) == [("riverside", "01 → 02"), ("riverside", "02 → 01")]
    change, _ = read_csv(tmp_path / "out" / "tcr.csv")
    assert change["map"] == "riverside"
    figures = {path.stem for path in (tmp_path / "out" / "figures").iterdir()}
    assert {"routes_metropolis", "routes_riverside"} <= figures


@pytest.mark.usefixtures("unrendered_figures", "few_methods")
def test_drives_that_never_meet(tmp_path):
    """One map's drives meet, and those of the other one do not."""
    for stage in ("01", "02"):
        drive(tmp_path / "in" / f"town_{stage}", stage, "a", city="town")
        pose = yaw_pose(900.0 * int(stage), 0.0, 0.0, 0.0)
        scans = [make_scan(np.array([[5.0, 0.0, 1.0], [9.0, 2.0, 2.0]]))]
        write_recording(tmp_path / "in" / f"apart_{stage}", scans, [pose])
    notes = []
    path = report_on_recordings(
        tmp_path / "in",
        tmp_path / "out",
        Cluster(1),
        on_note=notes.append,
        with_tables=True,
    )
    said = [one for one in notes if "no query lies within 7.5 m" in one]
    assert said == [
        f"apart_{query}: no query lies within 7.5 m of a place of apart_{place}"
        for place, query in (("01", "02"), ("02", "01"))
    ]
    for name in ("survival", "place_recognition", "why", "query_details"):
        rows = read_csv(path.with_name(f"{name}.csv"))
        assert {row["map"] for row in rows} == {"town"}
    found = {
        row["map"]: row["value"]
        for row in read_csv(path.with_name("results.csv"))
        if row["metric"] == "with_match"
    }
    assert found["apart"] == "0.0"


@pytest.mark.usefixtures("unrendered_figures")
def test_several_drives_of_a_stage_are_a_database(tmp_path, few_methods):
    """A control, which follows the route of another stage, is none of them."""
    for name, stage, route in (
        ("town_01", "01", "a"),
        ("town_01_again", "01", "c"),
        ("town_01_control", "01", "b"),
        ("town_02", "02", "b"),
    ):
        drive(tmp_path / "in" / name, stage, route, city="town")
    path = studies.report(tmp_path / "in", tmp_path / "out")
    rows = read_csv(path.with_name("results.csv"))
    databases = {row["database"] for row in rows if row["query"] == "town_02"}
    assert databases == {"town_01", "town_01+town_01_again"}
    found = {
        (row["database"], row["metric"]): float(row["value"])
        for row in rows
        if (row["query"], row["method"]) == ("town_02", few_methods[0])
        and (row["task"], row["gate"]) == ("place", "0")
        and row["both.stage"] == "own"
    }
    alone, together = ("town_01", "town_01+town_01_again")
    assert found[together, "with_match"] >= found[alone, "with_match"]
    assert (together, "kept") not in found
    for name in ("report.md", "report.html"):
        text = path.with_name(name).read_text()
        assert "Several drives in a database" in text
        assert "01 (2 drives) → 02" in text
    # The other tables and the ranking compare single drives.
    pairs = {
        row["DB → query"]
        for row in read_csv(path.with_name("place_recognition.csv"))
    }
    assert pairs == {"01 → 02", "02 → 01"}


def test_drives_of_a_stage_in_two_worlds_are_refused(tmp_path):
    scans = [make_scan(np.array([[5.0, 0.0, 1.0], [9.0, 2.0, 2.0]]))]
    for name, world in (
        ("town_01", "map"),
        ("town_01_again", "elsewhere"),
        ("town_02", "map"),
    ):
        said = {"map": "town", "stage": name[5:7]}
        write_recording(
            tmp_path / "in" / name,
            scans,
            [yaw_pose(0.0, 0.0, 0.0, 0.0)],
            world_frame=world,
            attachments={"scenario.json": said},
        )
    with pytest.raises(InputError, match=r"^town_01_again: poses in frame"):
        report_on_recordings(tmp_path / "in", tmp_path / "out", Cluster(1))


@pytest.mark.usefixtures("unrendered_figures")
def test_loops_are_in_the_table_of_results(tmp_path, few_methods):
    """A drive beside itself has its rows, which the ranking leaves out."""
    protocol = RetrievalProtocol(exclude_recent=0.04, radius=15.0)
    for stage in ("01", "02"):
        drive(tmp_path / "in" / f"town_{stage}", stage, "a", city="town")
    path = studies.report(tmp_path / "in", tmp_path / "out", protocol=protocol)
    rows = read_csv(path.with_name("results.csv"))
    loops = [row for row in rows if row["database"] == row["query"]]
    assert {row["query"] for row in loops} == {"town_01", "town_02"}
    assert {row["both.stage"] for row in loops} == {"own"}
    assert {row["task"] for row in loops} <= {"place", "pose"}
    assert {row["method"] for row in loops} == set(few_methods)
    wide = {
        row["method"]: row["AUC"]
        for row in read_csv(path.with_name("place_recognition.csv"))
        if row["DB → query"] == "01 → 01" and row["mode"] == "all"
    }
    assert wide == {
        row["method"]: row["value"]
        for row in loops
        if (row["query"], row["metric"], row["gate"]) == ("town_01", "auc", "0")
    }


def test_scans_without_points_are_refused(tmp_path):
    nothing = [make_scan(np.empty((0, 3)))] * 2
    write_recording(
        tmp_path / "town_01", nothing, [yaw_pose(x, 0, 0, 0) for x in (0, 1)]
    )
    with pytest.raises(InputError, match="town_01: no scan holds a point"):
        studies.report(tmp_path, tmp_path / "out")


def test_output_that_cannot_be_written(recordings, tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InputError, match=f"^{tmp_path / 'out'}"):
        report_on_recordings(recordings, tmp_path / "out", Cluster())
