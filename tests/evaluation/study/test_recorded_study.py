"""The experiment `stages` on recordings."""

import base64
import io
import json
import re

from helpers import dataset_folders, helipr_drive
from helpers.contradictions import add_images
from helpers.drive_files import T0_NS, make_scan, write_recording, yaw_pose
from helpers.internal import studies
from helpers.internal.eval_program import run
from helpers.measured_pairs import place_outcome
from helpers.small_towns import drive
import numpy as np
from PIL import Image
import pytest

from evaluation.base import Cluster, InputError
from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition import PROTOCOLS, RetrievalProtocol, choose_methods
from evaluation.results import QueryRows, Results
from evaluation.study import drives_by_map, find_recordings, study_recordings

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
    """One of each kind."""
    names = ("btc", "layered-overlap", "scan-context++", "solid")
    with pytest.MonkeyPatch.context() as patch:
        studies.ship_methods(patch, *names)
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
        studies.report(tmp_path / "in", tmp_path / "out")
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


def test_columns_are_the_users_and_what_is_assumed_is_said(tmp_path, capsys):
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
    (tmp_path / "file").write_text("")
    words = ["report", folder, "--output", tmp_path / "file", "--columns", 5]
    status, _, err = run(capsys, *words)
    assert status == 2
    # All notes come before the work, for which there is no folder.
    assert "solid: the LiDAR is not known" in err
    assert err.splitlines()[-1].startswith("cns-eval: error:")
    assert "file" in err.splitlines()[-1]


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
def both_protocols():
    return {name: PROTOCOLS[name] for name in ("random-yaw", "paper")}


@pytest.fixture(scope="module")
def report(recordings, both_protocols, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    studies.report(recordings, folder, protocols=both_protocols)
    return folder


def section(folder, name):
    text = (folder / "index.html").read_text()
    start = text.index(f'<section id="{name}">')
    return text[start : text.index("</section>", start)]


def test_tables_and_pictures_are_all_that_is_written(report):
    """The scatter of two pairs of drives, the second chart, is left out."""
    names = {path.name for path in report.iterdir()}
    assert names - {"parts", "figures"} == {
        "index.html",
        "results.csv",
        "queries.csv",
        *(
            f"chart_{k}.{kind}"
            for k in (1, 3)
            for kind in ("pdf", "png", "svg")
        ),
    }
    assert {path.name for path in (report / "figures").iterdir()} == {
        f"change_metropolis_01_04.{kind}" for kind in ("png", "webp")
    }


def test_each_protocol_is_that_of_the_single_command(
    recordings, report, both_protocols
):
    drives = [open_drive(recordings / f"metropolis_{k}") for k in ("01", "04")]
    results = Results.read(report).where(
        {"both.stage": "own"},
        metric="auc",
        verified=False,
        database="metropolis_01",
    )
    found = {(row.method, row.protocol): row for row in results.rows}
    digests = {(row.protocol, row.protocol_digest) for row in results.rows}
    assert digests == {
        (name, one.digest()) for name, one in both_protocols.items()
    }
    # BTC's places differ between the two, those of SOLiD do not.
    for name in ("btc", "solid"):
        for protocol in both_protocols.values():
            alone = place_outcome(
                *drives, make_method(name, {}), protocol=protocol
            ).outcomes
            expected = alone.curve.auc
            assert found[name, protocol.name].value == expected


def test_the_main_protocol_alone_has_the_control(report):
    results = Results.read(report).where(
        task="place", verified=False, database="metropolis_01"
    )
    further = results.where(protocol="paper")
    assert further.distinct("both.stage") == ["own"]
    assert further.where(metric="relative_auc").rows == ()
    # Layered overlap is none of the paper's methods.
    assert further.distinct("method") == ["btc", "scan-context++", "solid"]
    assert "is measured by the protocol random-yaw only" in (
        report / "index.html"
    ).read_text("utf-8")
    main = results.where(protocol="random-yaw")
    for method in main.distinct("method"):
        last, own, kept = (
            main.where({"both.stage": stage}, metric=metric, method=method).rows
            for stage, metric in (
                ("last", "auc"),
                ("own", "auc"),
                ("own", "relative_auc"),
            )
        )
        if last[0].value > 0.0:
            assert kept[0].value == own[0].value / last[0].value


def test_costs_are_on_the_page_alone(recordings, tmp_path):
    """Two runs differ in nothing else, not even in stored outcomes."""
    found = []
    for shows in (True, False):
        folder = tmp_path / f"{shows}"
        methods = choose_methods(["solid"])
        studies.report(recordings, folder, methods, with_costs=shows)
        files = [*folder.glob("*.csv"), *folder.glob("parts/place/*")]
        found.append({one.name: one.read_bytes() for one in files})
    assert found[0] == found[1]
    assert len(found[0]) > 2
    method, scans, points, *times, places, size = re.findall(
        "<td.*?>(.*?)</td>", section(tmp_path / "True", "costs")
    )
    (of_places, *_) = (
        Results.read(tmp_path / "True").where(metric="places").rows
    )
    assert (method, scans) == ("SOLiD", "1")
    assert int(places) == of_places.value
    assert int(points) > 100
    assert int(size) > 100
    assert min(map(float, times)) >= 0.0
    assert 'id="costs"' not in (tmp_path / "False/index.html").read_text()


@pytest.mark.night
def test_a_protocol_beside_another_changes_no_number(
    recordings, report, tmp_path
):
    studies.report(recordings, tmp_path)
    for kind in (Results, QueryRows):
        alone, both = kind.read(tmp_path), kind.read(report)
        assert alone.factors == ("both.stage",)
        assert both.factors == ("both.stage", "protocol.base")
    alone = Results.read(tmp_path).rows
    both = Results.read(report).where(protocol="random-yaw").rows
    assert len(alone) == len(both)
    for one, other in zip(alone, both, strict=True):
        assert one.without("protocol.base") == other.without("protocol.base")
        np.testing.assert_equal(
            (one.metric, one.value, one.low, one.high, one.n),
            (other.metric, other.value, other.low, other.high, other.n),
        )


def test_change_beside_the_paper(report):
    (row,) = (
        Results.read(report)
        .where(
            {"both.stage": "own"},
            metric="tcr_sym",
            database="metropolis_01",
            protocol="random-yaw",
        )
        .rows
    )
    assert 0.03 < row.value < 0.5
    assert f"{row.value:.3f}" in section(report, "change")
    paper = section(report, "paper")
    assert f"<td>{row.value:.4f}<small>0.2920 / 0.070</small>" in paper


def test_drives_as_they_were_published_give_the_same_tables(
    recordings, report, tmp_path
):
    """Without a scenario: folders name map and stage."""
    for stage in ("01", "04"):
        drive = open_drive(recordings / f"metropolis_{stage}")
        folder = tmp_path / "CNS" / "Metropolis" / stage
        X_WB = drive.X_WS.copy()
        X_WB[:, 2, 3] -= 1.6
        stamps = drive.stamps_ns.tolist()
        dataset_folders.write_quaternions(folder / "gt.csv", stamps, X_WB, ",")
        for frame, stamp in enumerate(stamps):
            scan = drive.scan(frame)
            dataset_folders.write_pcd(
                folder / "pcd" / f"{stamp}.pcd",
                np.stack([scan[axis] for axis in "xyz"], axis=1),
            )
    mount = "translation: [0, 0, 1.6]\nrotation: [0, 0, 0, 1]\n"
    (tmp_path / "CNS" / "transformation_lidar.yaml").write_text(mount)
    studies.report(
        tmp_path / "CNS",
        tmp_path / "tables",
        choose_methods(["scan-context++"]),
        {"paper": PROTOCOLS["paper"]},
    )
    for metric, protocol in (("tcr_sym", "random-yaw"), ("auc", "paper")):
        (before,), (found,) = (
            [
                row.value
                for row in Results.read(folder)
                .where({"both.stage": "own"}, metric=metric, verified=False)
                .rows
                if row.database == "metropolis_01"
                and row.method in ("", "scan-context++")
                and row.protocol == name
            ]
            for folder, name in (
                (report, protocol),
                (tmp_path / "tables", "paper"),
            )
        )
        assert found == pytest.approx(before, abs=1e-6)
    paper = section(tmp_path / "tables", "paper")
    assert "<small>0.2920 / 0.070</small>" in paper
    assert "<small>0.4442 / 0.908</small>" in paper


def test_recognition_beside_the_paper(report):
    (row,) = (
        Results.read(report)
        .where(
            {"both.stage": "own"},
            metric="r1",
            method="scan-context++",
            database="metropolis_01",
            protocol="paper",
            verified=False,
        )
        .rows
    )
    # The paper's Scan Context++ counts all queries.
    assert f"<td>{row.value:.4f}<small>0.2993</small>" in section(
        report, "paper"
    )
    assert "Layered" not in section(report, "paper").split("</table>")[1]


def test_what_a_camera_saw(report):
    page = (report / "index.html").read_text()
    start = page.index(">", page.index('id="data"')) + 1
    data = json.loads(page[start : page.index("</script>", start)])
    assert data["drives"]["metropolis_01"]["images"] is None
    images = data["drives"]["metropolis_04"]["images"]
    assert set(images["nearest"]) == {0}
    picture = base64.b64decode(images["files"][0])
    assert Image.open(io.BytesIO(picture)).size == (320, 240)
    # The main protocol's answers, both ways.
    assert [pair["label"] for pair in data["pairs"]] == [
        "metropolis_01 → metropolis_04",
        "metropolis_04 → metropolis_01",
    ]


def test_finished_jobs_start_no_process(
    recordings, report, both_protocols, monkeypatch
):
    def again():
        return study_recordings(
            find_recordings(recordings),
            report,
            Cluster(),
            choose_methods(),
            both_protocols,
            source="recordings",
        )

    monkeypatch.setattr(Cluster, "connect", None)
    assert again() == report / "index.html"
    picture = report / "figures" / "change_metropolis_01_04.webp"
    picture.rename(report / "aside")
    try:
        with pytest.raises(TypeError):  # A process would draw it.
            again()
    finally:
        (report / "aside").rename(picture)


@pytest.mark.night
@pytest.mark.usefixtures("unrendered_figures")
def test_own_method_beside_the_others(
    recordings, few_methods, tmp_path, monkeypatch, own_methods
):
    path = tmp_path / "counting.py"
    path.write_text(OWN_METHOD)
    choices = choose_methods(["standard", path])
    studies.report(recordings, tmp_path / "out", choices)
    found = Results.read(tmp_path / "out").where(task="place")
    assert found.distinct("method") == [*few_methods, "counting"]
    assert "counting" in (tmp_path / "out" / "index.html").read_text()


@pytest.mark.usefixtures("few_methods")
def test_a_single_stage_is_nothing_to_compare(tmp_path):
    drive(tmp_path / "in" / "metropolis_01", "01", "a")
    said = "in: metropolis: nothing to compare: all drives are through stage 01"
    with pytest.raises(InputError, match=said) as error:
        studies.report(tmp_path / "in", tmp_path / "out")
    assert "--years" in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("unrendered_figures")
def test_a_city_of_one_s_own_without_a_control(tmp_path, few_methods):
    for stage, route in (("01", "a"), ("02", "b")):
        drive(tmp_path / "in" / f"town_{stage}", stage, route, city="town")
    drive(tmp_path / "in" / "alone_01", "01", "a", city="alone")
    notes = []
    path = studies.report(
        tmp_path / "in", tmp_path / "out", on_note=notes.append
    )
    results = Results.read(path.parent)
    assert results.distinct("both.stage") == ["own"]
    assert results.where(metric="relative_auc").rows == ()
    areas = results.where(metric="auc", verified=False).rows
    assert len(areas) == 2 * len(few_methods)  # Both ways.
    text = path.read_text()
    assert "KAIST" not in text
    assert '<section id="paper">' not in text
    said = [one for one in notes if "no drive on the route" in one]
    assert said == [
        "town: no drive on the route of town_01 in the stage of town_02",
        "town: no drive on the route of town_02 in the stage of town_01",
    ]
    (alone,) = (one for one in notes if "nothing to compare" in one)
    assert alone.startswith("alone:")
    # Notes are shown as they are.
    assert "`" not in alone
    assert alone in text


@pytest.mark.usefixtures("unrendered_figures", "few_methods")
def test_drives_that_never_meet(tmp_path):
    """One map's drives meet, and those of the other one do not."""
    for stage in ("01", "02"):
        drive(tmp_path / "in" / f"town_{stage}", stage, "a", city="town")
        pose = yaw_pose(900.0 * int(stage), 0.0, 0.0, 0.0)
        scans = [make_scan(np.array([[5.0, 0.0, 1.0], [9.0, 2.0, 2.0]]))]
        write_recording(tmp_path / "in" / f"apart_{stage}", scans, [pose])
    notes = []
    path = studies.report(
        tmp_path / "in", tmp_path / "out", on_note=notes.append
    )
    assert [one for one in notes if "no query has a match" in one] == [
        f"apart_{query}: no query has a match in apart_{place}"
        for place, query in (("01", "02"), ("02", "01"))
    ]
    rows = Results.read(path.parent).where(metric="with_match", map="apart")
    assert {row.value for row in rows.rows} == {0.0}
    browser = section(path.parent, "browser")
    assert re.findall("apart_0", browser) == []


@pytest.mark.usefixtures("unrendered_figures")
def test_loops_are_in_the_table_of_results(tmp_path, few_methods):
    """A drive beside itself has its rows."""
    protocol = RetrievalProtocol(exclude_recent=0.04, radius=15.0)
    for stage in ("01", "02"):
        drive(tmp_path / "in" / f"town_{stage}", stage, "a", city="town")
    path = studies.report(
        tmp_path / "in", tmp_path / "out", protocols={"recorded": protocol}
    )
    loops = [
        row
        for row in Results.read(path.parent).rows
        if row.database == row.query
    ]
    assert {row.query for row in loops} == {"town_01", "town_02"}
    assert {row["both.stage"] for row in loops} == {"own"}
    assert {row.task for row in loops} <= {"place", "pose"}
    assert {row.method for row in loops} == set(few_methods)
    assert "at least 0.04 s before" in path.read_text()


def test_scans_without_points_are_refused(tmp_path):
    nothing = [make_scan(np.empty((0, 3)))] * 2
    for stage in ("01", "02"):
        write_recording(
            tmp_path / f"town_{stage}",
            nothing,
            [yaw_pose(x, 0, 0, 0) for x in (0, 1)],
        )
    with pytest.raises(InputError, match=r"town_0\d: no (scan|finite)"):
        studies.report(tmp_path, tmp_path / "out")


def test_output_that_cannot_be_written(recordings, tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InputError, match=f"^{tmp_path / 'out'}"):
        studies.report(recordings, tmp_path / "out")
