"""Stages of scenarios with added and removed structures."""

import json
from pathlib import Path
import re
import shutil

from helpers.small_map import world_text
from helpers.tiny_drive import tiny_scenario
from helpers.transient_town import write_transient_town
from mcap.reader import make_reader
import numpy as np
import pytest

from cns_drake.export import export_drive
from cns_drake.scenarios import (
    DrivePlan,
    describe_scenario,
    digest_inputs,
    make_scenario,
)
from cns_drake.simulation import SimulatedDrive, load_drive, simulate
from evaluation import open_drive
from evaluation.base import InputError
from evaluation.change import temporal_change
from evaluation.drives import McapDrive


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiny")
    sdf = write_transient_town(folder)
    return tiny_scenario(folder, world=str(sdf), frames=3)


def recorded(folder):
    return next(folder.glob("*/*.mcap"))


def test_neutral_values_are_as_no_section(scenario):
    neutral = scenario.with_transient(seed=5, parked_cars=0, leaves=1)
    assert describe_scenario(neutral) == describe_scenario(scenario)
    assert digest_inputs(neutral) == digest_inputs(scenario)
    changed = scenario.with_transient(parked_cars=0.5)
    assert describe_scenario(changed)["transient"]["parked_cars"] == 0.5
    values = describe_scenario(changed) | {
        "world": scenario.world,
        "waypoints": scenario.waypoints,
    }
    assert make_scenario(values, "again") == changed


def test_a_neutral_section_records_the_same_bytes(scenario, tmp_path):
    simulate(scenario, tmp_path / "without")
    simulate(scenario.with_transient(seed=5), tmp_path / "neutral")
    without, neutral = (recorded(tmp_path / n) for n in ("without", "neutral"))
    assert without.read_bytes() == neutral.read_bytes()


@pytest.mark.slow
def test_recordings_and_simulations_see_the_same_changes(scenario, tmp_path):
    """The same bytes twice, and the table of structures has the causes."""
    changed = scenario.with_transient(parked_cars=1.0, leaves=0.3)
    for name in ("first", "second"):
        simulate(changed, tmp_path / name)
    first, second = (recorded(tmp_path / n) for n in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()
    recording = McapDrive(first, None)
    read = SimulatedDrive(changed)
    plain = SimulatedDrive(scenario)
    for index in range(3):
        scan = recording.scan(index)
        assert np.array_equal(scan, read.scan(index))
        assert not np.array_equal(scan, plain.scan(index))
    with first.open("rb") as stream:
        table = next(
            json.loads(attachment.data)
            for attachment in make_reader(stream).iter_attachments()
            if attachment.name == "structures.json"
        )
    causes = {entry["name"]: entry.get("causes") for entry in table}
    assert causes["tree_003"] == ["leaves"]
    assert causes["car_003"] == ["parked_cars"]
    assert causes["lamp_003"] is None
    assert any(name.startswith("parked_car_") for name in causes)


@pytest.mark.night
@pytest.mark.slow
def test_the_change_of_a_cause_is_that_of_its_instances_alone(scenario):
    """TCR of a cause is that of replacing the points on its instances alone."""
    changed = SimulatedDrive(scenario.with_transient(parked_cars=1.0))
    plain = SimulatedDrive(scenario)
    causes = np.array(
        [
            entry.instance
            for entry in load_drive(
                DrivePlan(scenario.with_transient(parked_cars=1.0))
            ).world.structures
            if entry.causes
        ]
    )
    before, after, rebuilt = [], [], []
    for index in range(3):
        old, new = plain.scan(index), changed.scan(index)
        met = {
            key
            for scan in (old, new)
            for key in keys_of(scan[np.isin(scan["instance"], causes)])
        }
        kept = [key not in met for key in keys_of(old)]
        fresh = [key in met for key in keys_of(new)]
        assert 0 < sum(fresh) < len(new)
        for clouds, scan in (
            (before, old),
            (after, new),
            (rebuilt, np.concatenate([old[kept], new[fresh]])),
        ):
            scan = np.sort(scan, order=("ring", "t"))
            p_S = np.column_stack([scan[axis] for axis in "xyz"])
            X_WS = plain.X_WS[index]
            clouds.append(p_S @ X_WS[:3, :3].T + X_WS[:3, 3])
    before, after, rebuilt = map(np.concatenate, (before, after, rebuilt))
    change = temporal_change(before, after, tau=0.3)
    assert 0.0 < change.symmetric < 1.0
    alone = temporal_change(before, rebuilt, tau=0.3)
    assert change.symmetric == alone.symmetric


def keys_of(scan):
    """Returns the beam of each point."""
    return list(zip(scan["ring"].tolist(), scan["t"].tolist(), strict=True))


def test_what_came_is_absent_in_another_stage(tmp_path):
    """`--absent-in` marks new cars, and not structures of both stages."""
    town = tmp_path / "town"
    town.mkdir()
    world = write_transient_town(town)
    shutil.copy(world, town / "stage_02.sdf")
    world.rename(town / "stage_01.sdf")
    place = {"world": None, "map": str(town), "stage": "01"}
    scenario = tiny_scenario(tmp_path, frames=2, **place)
    simulate(scenario.with_transient(parked_cars=1.0), tmp_path / "out")
    folder = next((tmp_path / "out").iterdir())
    marked = open_drive(
        export_drive(
            open_drive(folder), "kitti", tmp_path / "kitti", absent_in="02"
        )
    )
    scan = marked.scan(0)
    names = {k: entry["name"] for k, entry in marked.instances.items()}
    parked = [k for k, name in names.items() if name.startswith("parked_")]
    came = np.isin(scan["instance"], parked)
    assert 0 < came.sum() < len(scan)
    assert (scan["label"][came] == 252).all()
    assert (scan["label"][~came] < 252).all()


@pytest.mark.slow
def test_a_recording_shows_what_the_whole_world_shows(tmp_path):
    """Also where streets overlap that are in one plane, and slender."""
    lidars = {"lidar": {"preset": "vlp-16", "columns": 256}}
    scenario = tiny_scenario(tmp_path, frames=2, lidars=lidars)
    visuals = []
    rng = np.random.default_rng(5)
    for k, x in enumerate(rng.uniform(-200.0, 700.0, 150)):
        end, y = x + rng.uniform(20.0, 150.0), rng.uniform(-40.0, 40.0)
        (tmp_path / f"{k}.obj").write_text(
            f"v {x} {y} 0\nv {end} {-y} 0\nv {end} {3 - y} 0\n"
            f"v {x} {y} 6\nf 1 2 3\nf 2 3 4\n"
        )
        visuals.append(
            f"<visual name='street_{k}/surface'><geometry><mesh><uri>{k}.obj"
            "</uri></mesh></geometry></visual>"
        )
    Path(scenario.world).write_text(world_text(visuals))
    Path(scenario.waypoints).write_text("x,y,z\n-10,5,0\n40,5,0\n40,60,0\n")
    recording = McapDrive(
        recorded(simulate(scenario, tmp_path / "out").folder.parent), None
    )
    whole = SimulatedDrive(scenario)
    assert recording.instances == whole.instances
    for index in range(2):
        scan = recording.scan(index)
        assert len(np.unique(scan["instance"])) > 10
        assert np.array_equal(scan, whole.scan(index))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"leaves": 1.1}, "leaves: .*less than or equal to 1"),
        ({"parked_cars": -0.1}, "parked_cars: .*greater than or equal to 0"),
        ({"seed": -1}, "seed: .*greater than or equal to 0"),
        ({"snowmen": 3}, "snowmen"),
    ],
)
def test_bad_values_are_one_line(scenario, changes, expected):
    with pytest.raises(
        InputError, match=rf"^tiny_01: transient\..*{expected}"
    ) as e:
        scenario.with_transient(**changes)
    assert not re.search("\n", str(e.value))
