"""`cns-drake ladder`: the changes of its rungs, and its files."""

import csv
from dataclasses import replace
from pathlib import Path
import shutil

from helpers import documents, studies
from helpers.eval_program import run_program
from helpers.small_map import write_town
import numpy as np
import pytest
import shapely

from cns_drake.__main__ import main
from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario_files import load_scenario, map_folder
from cns_drake.simulation.loaded_drive import (
    EGO_BOX,
    load_ways,
    plan_scenario_traffic,
)
from cns_drake.simulation.simulated_drive import DriveSimulation
from cns_drake.studies import ladder, map_pairs
from cns_drake.studies.ladder import (
    climb_ladder,
    distracting_drives,
    rung_pairs,
)
from cns_drake.studies.ladder_rungs import (
    CAUSES,
    STRENGTHS,
    Extent,
    plan_pairs,
    plan_rungs,
)
from cns_drake.studies.map_pairs import update_pairs
from cns_drake.studies.reproduction import stage_pairs
from cns_drake.traffic.lane_file import lane_text
from cns_drake.traffic.overlaps import find_overlaps
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study import localisation
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.localisation import SHIPPED, localise_pairs

METHODS = (MethodChoice("solid"), MethodChoice("layered-overlap"))
# Fields that a cause may change, apart from the drive's name.
CHANGED = {
    "parked_cars": ("query", {"transient"}),
    "leaves": ("query", {"transient"}),
    "snow": ("query", {"transient"}),
    "scaffolds": ("query", {"transient"}),
    "works": ("query", {"transient"}),
    "furniture": ("query", {"transient"}),
    "construction": ("database", {"stage"}),
    "traffic": ("query", {"traffic"}),
    "weather": ("query", {"lidars", "weather", "seed"}),
    "returns": ("query", {"lidars", "seed"}),
    "ride": ("database", {"ride"}),
    "sensor": ("query", {"lidars"}),
    "narrow_sensor": ("query", {"lidars"}),
    "driver": ("database", {"driver", "traffic", "lidars"}),
    "viewpoint": ("database", {"lidars"}),
    "lateral": ("database", {"lidars"}),
}


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with three stages, and two drives of 60 frames."""
    routes = {"01": "metropolis_01", "04": "metropolis_04"}
    folder = write_town(tmp_path_factory.mktemp("maps") / "town", routes, 60)
    (folder / "stage_02.sdf").write_bytes(
        (folder / "stage_01.sdf").read_bytes()
    )
    return folder


@pytest.fixture(scope="module")
def query_drive(town):
    return load_scenario(town / "sequence_04.yaml")


def differences(one, other):
    """The fields in which two scenarios differ."""
    return {
        name
        for name in type(one).model_fields
        if getattr(one, name) != getattr(other, name)
    }


def test_traffic_climbs_on_imported_lanes(town, tmp_path):
    """A map whose lanes are in lanes.json has the rungs of its roads.yaml."""
    extent = Extent(causes=("traffic",))
    folder = Path(shutil.copytree(town, tmp_path / "imported"))
    query_drive = load_scenario(folder / "sequence_04.yaml")
    graph, walkways, _ = load_ways(map_folder(query_drive))
    before, _ = plan_rungs(query_drive, extent)
    (folder / "lanes.json").write_text(lane_text(graph, walkways))
    (folder / "roads.yaml").unlink()
    after, notes = plan_rungs(query_drive, extent)
    wanted = [rung.drives.query.traffic for rung in after]
    assert wanted == [rung.drives.query.traffic for rung in before]
    assert max(traffic.vehicles for traffic in wanted) > 0
    assert not [note for note in notes if "traffic" in note]
    (folder / "lanes.json").unlink()
    bare, notes = plan_rungs(query_drive, extent)
    assert [rung.cause for rung in bare] == ["none"]
    assert "neither roads.yaml nor lanes.json: no traffic" in notes


def test_one_cause_changes_one_drive(query_drive):
    (plain, *rungs), notes = plan_rungs(
        query_drive, Extent(levels=(1, 2, 3, 4))
    )
    assert plain.cause == "none"
    assert plain.drives.query == query_drive
    assert differences(plain.drives.database, query_drive) == {"name", "lidars"}
    assert not notes
    for rung in rungs:
        found = {
            side: differences(
                getattr(rung.drives, side), getattr(plain.drives, side)
            )
            for side in ("database", "query")
        }
        if rung.cause in ("hidden", "turn", "tilt"):
            assert found == {"database": set(), "query": set()}
            assert rung.drives.query_changes
            continue
        assert not rung.drives.query_changes or rung.cause == "all"
        if rung.cause == "size":
            assert found == {"database": set(), "query": set()}
            assert rung.drives.num_distractors == STRENGTHS["size"][rung.level]
        elif rung.cause != "all":
            side, fields = CHANGED[rung.cause]
            assert found.pop(side) - {"name"} <= fields
            assert rung.drives.num_distractors == 0
            assert list(found.values()) == [set()]


def test_all_is_everything_at_its_level(query_drive):
    rungs, _ = plan_rungs(query_drive, Extent(levels=(2, 4)))
    strongest = {rung.cause: rung for rung in rungs if rung.cause != "none"}
    assert set(strongest) == set(CAUSES) - {"none"}
    both = strongest["all"].drives
    assert both.num_distractors == 10_000
    asked = {"hide_sector": 120.0, "turn_queries": True, "tilt_queries": 3.0}
    assert both.query_changes == {**asked, "seed": 1}
    for cause, (side, fields) in CHANGED.items():
        if cause in ("driver", "narrow_sensor"):
            continue
        if "transient" in fields:
            one, other = (
                getattr(drives.query.transient, cause)
                for drives in (both, strongest[cause].drives)
            )
            assert one == other == STRENGTHS[cause][4]
            continue
        alone = getattr(strongest[cause].drives, side)
        for field in fields - {"lidars", "seed"}:
            assert getattr(getattr(both, side), field) == getattr(alone, field)
    config = both.query.lidars["lidar"]
    assert (config.preset, config.returns) == ("mid-360", "calibrated")
    moved = both.database.lidars["lidar"]
    assert moved.rpy_deg[2] == 180.0
    # The lateral offset takes no part.
    assert moved.xyz[1] == 6.0
    assert both.radius(7.5) == 7.5


def test_levels_and_seeds(query_drive):
    rungs, _ = plan_rungs(query_drive, Extent(levels=(4,), seeds=(1, 2, 3)))
    climbed = [(r.cause, r.level, r.seed) for r in rungs]
    # The earlier of two stages is the stronger change; returns have one level.
    assert ("construction", 4, 1) in climbed
    assert ("returns", 1, 3) in climbed
    assert ("ride", 4, 3) in climbed
    assert ("sensor", 4, 2) not in climbed
    rungs, _ = plan_rungs(query_drive, Extent(causes={"construction"}))
    stages = {r.level: r.drives.database.stage for r in rungs}
    assert stages == {0: "04", 3: "02", 4: "01"}
    rungs, _ = plan_rungs(query_drive, Extent(causes={"narrow_sensor"}))
    assert rungs[1].drives.query.lidars["lidar"].preset == "avia"
    rungs, _ = plan_rungs(query_drive, Extent(causes={"size"}, most_places=500))
    assert [r.drives.num_distractors for r in rungs] == [0, 300]


def test_queries_of_a_rung_are_asked_as_it_says(query_drive):
    common = RetrievalProtocol(radius=5.0, query_spacing=20.0)
    rungs, _ = plan_rungs(
        query_drive,
        Extent(causes={"hidden", "turn", "tilt"}, seeds=(3, 4)),
    )
    asked = {
        (rung.cause, rung.level, rung.seed): rung.drives.protocol(common)
        for rung in rungs
    }
    assert asked["none", 0, 3] == common
    assert asked["hidden", 2, 4] == replace(common, hide_sector=60.0, seed=4)
    assert asked["turn", 1, 3] == replace(common, turn_queries=True, seed=3)
    assert asked["tilt", 3, 3] == replace(common, tilt_queries=1.5, seed=3)
    assert len({rung.fingerprint() for rung in rungs}) == len(rungs)


def test_drivers(query_drive):
    rungs, _ = plan_rungs(query_drive, Extent(causes={"driver"}, seeds=(5,)))
    plain, *drivers = (rung.drives.database for rung in rungs)
    assert [one.driver.wander for one in drivers] == [0.35] * 4
    assert [bool(one.driver.lane_changes) for one in drivers] == [
        *(False, True, True, True)
    ]
    assert [one.driver.follows for one in drivers] == [False, False, True, True]
    assert {one.driver.seed for one in drivers} == {5}
    assert all(one.traffic.vehicles > 0 for one in drivers[2:])
    assert [one.lidars == plain.lidars for one in drivers] == [
        *(True, True, True, False)
    ]
    assert drivers[3].lidars["lidar"].xyz[:2] == (1.25, 5.0)
    assert drivers[3].lidars["lidar"].rpy_deg[2] == 180.0


@pytest.mark.parametrize(
    ("viewpoint", "left", "heading_deg"),
    [("near", 0.5, 0.0), ("lane", 5.0, 0.0), ("reversed", 5.0, 180.0)],
)
def test_viewpoints_move_all_rungs(query_drive, viewpoint, left, heading_deg):
    rungs, notes = plan_rungs(query_drive, Extent(viewpoint=viewpoint))
    causes = {rung.cause for rung in rungs}
    moving = {"viewpoint", "lateral"}
    assert causes == set(CAUSES) - (moving if viewpoint != "near" else set())
    places = {
        (config.xyz[:2], config.rpy_deg[2])
        for rung in rungs
        if rung.cause not in (*moving, "driver", "all")
        for config in rung.drives.database.lidars.values()
    }
    assert places == {((1.25, left), heading_deg)}
    assert any("--viewpoint" in note for note in notes) == (viewpoint != "near")
    (plain, *_), _ = plan_rungs(query_drive, Extent())
    same_name = plain.drives.database.name == rungs[0].drives.database.name
    assert same_name == (viewpoint == "near")


def test_pairs_have_both_causes(query_drive):
    extent = Extent(seeds=(1, 2))
    causes = ("snow", "hidden", "construction", "size")
    rungs = plan_pairs(query_drive, causes, extent)
    names = [(rung.cause, rung.seed) for rung in rungs]
    assert len(names) == len(set(names)) == 5 * 2 + 1
    assert ("construction+size", 2) not in names
    both = next(r for r in rungs if r.cause == "snow+hidden").drives
    assert both.query.transient.snow == STRENGTHS["snow"][4]
    assert both.query_changes["hide_sector"] == 120.0
    assert both.database.stage == query_drive.stage


def test_queues_stand_in_all_lanes_but_where_the_car_is(query_drive):
    (_, rung), _ = plan_rungs(
        query_drive, Extent(causes={"traffic"}, levels=(4,))
    )
    scenario = rung.drives.query
    assert scenario.traffic.queues
    assert rung.strength == "queues in all lanes"
    drive = plan_drive(scenario)
    plan = plan_scenario_traffic(scenario, drive)
    lanes = load_ways(map_folder(scenario)).graph
    lines = shapely.MultiLineString(
        [lanes.pieces[k].points[:, :2] for k in lanes.lanes]
    )
    places = shapely.points(plan.vehicles.values[0, :, :2])
    assert shapely.distance(lines, places).max() < 0.5
    # A vehicle needs 7 m of a lane, some more.
    assert lines.length / 12 < len(places) < lines.length / 5
    halves = np.array([EGO_BOX.half_size])
    halves = np.concatenate([halves, [k.size[:2] for k in plan.kinds]])
    halves[1:] /= 2
    poses = np.full((40, len(halves), 3), np.nan)
    times = np.linspace(0.0, drive.duration, len(poses))
    gaps = []
    for row, t in zip(poses, times, strict=True):
        R_WB, p_WB = drive.poses(np.array([t]))
        yaw = np.arctan2(R_WB[:, 1, 0], R_WB[:, 0, 0])
        row[:1] = EGO_BOX.middles(p_WB[:, :2], yaw)
        there = plan.vehicles.is_present(t)
        row[1:][there] = plan.vehicles.at(t)[0][there][:, [0, 1, 3]]
        gaps.append(np.nanmin(np.hypot(*(row[1:, :2] - row[0, :2]).T)))
    found = np.zeros((len(halves), len(halves)), bool)
    find_overlaps(poses, halves, found)
    assert not found.any()
    # Some stand close to the car, in its lane or beside it.
    assert np.median(gaps) < 12.0


def test_what_a_map_lacks(query_drive, town):
    lonely = query_drive.model_copy(update={"stage": "01"})
    rungs, notes = plan_rungs(lonely, Extent())
    assert "construction" not in {rung.cause for rung in rungs}
    assert notes == ["no stage before 01: no construction"]


@pytest.mark.slow
def test_queries_lie_at_the_same_places_on_every_rung(query_drive):
    (plain, *rungs), _ = plan_rungs(query_drive, Extent(levels=(4,)))
    expected = DriveSimulation(plain.drives.query)().X_WS
    for rung in rungs:
        if rung.cause in ("weather", "returns", "sensor"):
            np.testing.assert_array_equal(
                DriveSimulation(rung.drives.query)().X_WS, expected
            )


def test_the_other_carriageway(query_drive):
    (plain, rung), _ = plan_rungs(
        query_drive, Extent(causes={"viewpoint"}, levels=(4,))
    )
    query = DriveSimulation(plain.drives.query)().X_WS
    database = DriveSimulation(rung.drives.database)().X_WS
    X_QD = np.linalg.inv(query) @ database
    np.testing.assert_allclose(X_QD[:, :3, 3] - [[1.25, 6, 0]], 0, atol=1e-9)
    np.testing.assert_allclose(X_QD[:, 0, 0], -1.0, atol=1e-9)


@pytest.mark.parametrize(("level", "left"), [(1, 5.0), (2, 10.0), (3, 15.0)])
def test_lateral_offsets_widen_the_radius(query_drive, level, left):
    """On a straight road, places match up to 7.5 m along it at any offset."""
    (plain, rung), _ = plan_rungs(
        query_drive, Extent(causes={"lateral"}, levels=(level,))
    )
    query = DriveSimulation(plain.drives.query)().X_WS
    database = DriveSimulation(rung.drives.database)().X_WS
    X_QD = np.linalg.inv(query) @ database
    np.testing.assert_allclose(X_QD[:, :3, 3] - [[1.25, left, 0]], 0, atol=1e-9)
    radius = rung.drives.radius(7.5)
    assert np.hypot(7.5 - 1e-6, left) < radius < np.hypot(7.5 + 1e-6, left)
    assert plain.drives.radius(7.5) == 7.5


def test_distracting_drives_are_of_other_cities(tmp_path, monkeypatch):
    query_drive = load_scenario("metropolis_04")
    drives = distracting_drives(query_drive, 1000, 5.0, tmp_path, Cluster())
    # Some 250 to 350 places each.
    assert 3 <= len(drives) <= 5
    assert all("metropolis" not in drive.name for drive in drives)
    assert len({drive.name for drive in drives}) == len(drives)
    assert distracting_drives(query_drive, 0, 5.0, tmp_path, Cluster()) == []


def test_many_distracting_drives_have_twin_blocks(tmp_path, monkeypatch):
    drawn = []

    def redraw(folder, stage, seeds, output, cluster):
        drawn.append((folder.name, *seeds))
        return {seed: output / f"{folder.name}_c{seed}" for seed in seeds}

    monkeypatch.setattr(ladder, "redraw_cities", redraw)
    monkeypatch.setattr(ladder, "_num_places", lambda *_: 1)
    query_drive = load_scenario("suburbia_02")
    notes = []
    drives = distracting_drives(
        query_drive, 40, 5.0, tmp_path, Cluster(), notes.append
    )
    assert notes == [
        "suburbia_02: looking for 40 places elsewhere",
        "suburbia_02: found 20 places elsewhere",
        "suburbia_02: found 40 places elsewhere",
    ]
    maps = [Path(drive.map).name for drive in drives]
    # Ten shipped drives of the others, two of the same streets, and so on.
    assert maps.index("suburbia_c1") == 10
    assert maps.count("suburbia_c1") == 2
    assert "suburbia" not in maps
    assert drawn == [("suburbia", 1), ("downtown", 1)]
    assert len({drive.name for drive in drives}) == 40


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered_figures")
def test_a_ladder_from_end_to_end(town, tmp_path, monkeypatch):
    runs = []
    monkeypatch.setattr(
        ladder,
        "run_jobs",
        lambda jobs, cluster: runs.append(studies.do(jobs)),
    )
    extent = Extent(causes={"construction", "lateral"}, levels=(4,))
    arguments = [[str(town)], tmp_path, Cluster(), METHODS, extent]
    path, text = climb_ladder(*arguments)
    assert path == tmp_path / "ladder.csv"
    assert text.startswith("Town, ")
    rows = list(csv.DictReader(path.open()))
    assert [(r["cause"], r["level"]) for r in rows[::4]] == [
        ("none", "0"),
        ("construction", "4"),
        ("lateral", "3"),
    ]
    radii = {row["cause"]: float(row["radius"]) for row in rows}
    assert radii == {
        "none": 7.5,
        "construction": 7.5,
        "lateral": pytest.approx(np.hypot(7.5, 15.0)),
    }
    # The places lie 15 m to the side, and still are matches.
    assert all(int(row["with_match"]) > 0 for row in rows)
    assert {r["method"] for r in rows} == {"solid", "layered-overlap"}
    assert {r["db"] for r in rows} == {r["query"] for r in rows} == {"04"}
    queries = list(csv.DictReader((tmp_path / "queries.csv").open()))
    assert len(queries) == sum(int(row["queries"]) for row in rows)
    assert (tmp_path / "ladder.png").is_file()
    # Finished rungs do not run again.
    assert climb_ladder(*arguments) == (path, text)
    assert [len(run) for run in runs] == [5, 0]


def test_two_maps_of_one_name(town, tmp_path):
    shutil.copytree(town, tmp_path / "town")
    maps = [str(town), str(tmp_path / "town")]
    with pytest.raises(InputError, match="another map has a drive town_04"):
        climb_ladder(maps, tmp_path / "out", Cluster(), METHODS, Extent())
    assert not (tmp_path / "out").exists()


def test_the_page_has_every_cause():
    table = documents.table(
        documents.read("docs/ladder.md"), "## What is compared"
    )
    assert [row[0].strip("`") for row in table] == list(CAUSES[1:])


EXTENT = Extent(causes=("construction", "hidden", "size"), levels=(4,))


def test_rungs_are_localised(town, tmp_path, monkeypatch):
    studies.run_here(monkeypatch, localisation)
    pairs = rung_pairs([str(town)], EXTENT)
    path = localise_pairs(pairs, tmp_path, Cluster(1), spacing=20.0)
    with open(path, newline="") as stream:
        rows = list(csv.DictReader(stream))
    # Hidden sectors and more places change no map.
    assert [row["cause"] for row in rows] == ["none"] * 8 + ["construction"] * 8
    assert {row["method"] for row in rows} == set(SHIPPED)
    assert [row["start"] for row in rows] == ["0.5", "2.0"] * 8
    assert {row["queries"] for row in rows} == {rows[0]["queries"]}
    assert {row["strength"] for row in rows[8:]} == {"mapped in stage 01"}


def test_maps_of_rungs_are_scored(town, tmp_path, monkeypatch):
    pairs = rung_pairs([str(town)], EXTENT)
    notes = []
    monkeypatch.setattr(map_pairs, "STUDY_SPACING", 20.0)
    monkeypatch.setattr(map_pairs, "find_spec", lambda name: None)
    studies.run_here(monkeypatch, localisation)
    path = update_pairs(pairs, tmp_path, Cluster(1), notes.append)
    assert notes == ["m3c2 is left out: it needs the extra map-update"]
    with open(path, newline="") as stream:
        rows = list(csv.DictReader(stream))
    found = {(row["cause"], row["method"]): row for row in rows}
    assert list(found) == [
        (cause, method)
        for cause in ("none", "construction")
        for method in ("truth", "free-space", "distance")
    ]
    for row in rows:
        if row["method"] == "truth":
            assert float(row["miou"]) == float(row["right_structures"]) == 1.0
    before, after = (
        found[cause, "truth"] for cause in ("none", "construction")
    )
    # Nothing changes between two drives through one city.
    assert float(before["called_points"]) == 0.0 < float(after["called_points"])
    assert before["gone"] == before["new"] == "0"
    assert int(after["gone"]) + int(after["new"]) > 0
    assert after["strength"] == "mapped in stage 01"
    assert (tmp_path / "map_update.png").stat().st_size > 1000

    # Finished pairs are read again.
    def done(jobs, _):
        assert all(job.step.is_done() for job in jobs)

    monkeypatch.setattr(localisation, "run_jobs", done)
    content = path.read_bytes()
    update_pairs(pairs, tmp_path, Cluster(1), notes.append)
    assert path.read_bytes() == content


def test_stages_of_a_map_are_pairs(town, tmp_path):
    pairs = stage_pairs([str(town)], tmp_path)
    found = [(p.rung.cause, p.rung.level, p.rung.database) for p in pairs]
    first = next(p.rung.database for p in pairs if p.rung.cause == "stages")
    assert found == [
        ("routes", 1, f"{first}_stage_04"),
        ("stages", 1, first),
    ]
    assert {p.rung.query for p in pairs} == {pairs[0].rung.query}
    stages = [[one.scenario.stage for one in p.sources] for p in pairs]
    assert stages == [["04", "04"], ["01", "04"]]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("reproduce", "--set", "a=1"), "leave out --set and --pages"),
        (("ladder", "--pairs"), "leave out --levels and --pairs"),
        (("ladder", "--method", "own.py"), "leave out --method"),
    ],
)
def test_tasks_refuse_what_they_do_not_take(
    town, tmp_path, capsys, words, text
):
    command, *options = words
    status, _, err = run_program(
        capsys,
        "cns-drake",
        main,
        *(command, town, "--task", "map", "--output", tmp_path, *options),
    )
    assert status == 2
    assert f"--task map: {text}" in err
