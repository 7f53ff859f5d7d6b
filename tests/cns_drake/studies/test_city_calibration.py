"""Calibration: estimates against recordings, and proposals that hold."""

import pytest
from small_map import box_visual, world_text
import yaml

from cns_drake.command_line.city import city
from cns_drake.scenarios.scenario import load_scenario
from cns_drake.simulation.simulation import simulate
from cns_drake.studies.calibration import Calibration
from cns_drake.studies.calibration_report import report_lines
from evaluation.change.drive_change import compare, survey
from evaluation.support.errors import InputError

pytestmark = pytest.mark.slow

STAGES = {
    "01": {"north end": ["house_1", "house_2"], "south end": ["house_3"]},
    "02": {"north": ["house_4", "house_5"], "south": ["house_6"]},
    "03": {},
}
CANDIDATES = ["house_7", "house_8"]
EVERY_FRAME = 1e-3


def write_street(folder):
    """Writes a street of ten houses at three stages, and three drives."""
    folder.mkdir()
    places = {
        f"house_{k}": (12 * k - 40, 14 if k % 2 else -13) for k in range(10)
    }
    absent = set()
    for stage in ("03", "02", "01"):
        absent |= {name for group in STAGES[stage].values() for name in group}
        visuals = [box_visual("lawn/plate", (0, 0, -1, 0, 0, 0), (130, 50, 2))]
        visuals += [
            box_visual(f"{name}/body", (x, y, 5, 0, 0, 0.1 * y), (9, 8, 10))
            for name, (x, y) in places.items()
            if name not in absent
        ]
        (folder / f"stage_{stage}.sdf").write_text(world_text(visuals))
    names = ["lawn", *places]
    rows = [f"{k},{name},building" for k, name in enumerate(names, start=1)]
    (folder / "structures.csv").write_text(
        "\n".join(["instance,name,class", *rows, ""])
    )
    stages = {
        name: {"story": "a story", "absent": groups}
        for name, groups in STAGES.items()
    }
    (folder / "stages.yaml").write_text(
        yaml.safe_dump(
            {"stages": stages, "candidates": CANDIDATES}, sort_keys=False
        )
    )
    for stage, y in (("01", 0), ("02", -2), ("03", 2)):
        (folder / f"drive_{stage}.csv").write_text(f"x,y\n-35,{y}\n35,{y}\n")
        values = {
            "name": f"street_{stage}",
            "map": ".",
            "stage": stage,
            "waypoints": f"drive_{stage}.csv",
            "speeds": {
                "cruise": 12.0,
                "longitudinal_acceleration": 3.0,
                "lateral_acceleration": 3.0,
            },
            "lidars": {"lidar": {"columns": 128}},
        }
        (folder / f"sequence_{stage}.yaml").write_text(yaml.safe_dump(values))
    return folder


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    return write_street(tmp_path_factory.mktemp("worlds") / "street")


def scenarios(street, *stages):
    return [load_scenario(street / f"sequence_{nn}.yaml") for nn in stages]


@pytest.fixture(scope="module")
def calibration(street):
    """Stage 02, of which stage 01 is the earlier and 03 the later."""
    return Calibration(*scenarios(street, "02", "03"))


def test_every_frame_gives_what_recordings_give(street, tmp_path):
    earlier, later = scenarios(street, "01", "03")
    a, b = (
        survey(simulate(scenario, tmp_path / "out").folder)
        for scenario in (earlier, later)
    )
    recorded = compare(a, b).change.symmetric
    assert recorded > 0.08
    exact = Calibration(earlier, later, spacing=EVERY_FRAME)
    # Recorded coordinates are rounded: a point or two change voxels.
    assert exact.change == pytest.approx(recorded, abs=2e-3)
    assert exact.control < 0.01
    coarse = Calibration(earlier, later)
    assert coarse.change == pytest.approx(exact.change, abs=0.02)
    assert coarse.change != exact.change


def test_groups_move_in_the_order_of_the_story(calibration, street):
    assert [group.item for group in calibration.given_back] == [
        "south",
        "north",
    ]
    assert [(group.stage, group.item) for group in calibration.taken] == [
        ("01", "north end"),
        ("01", "south end"),
        ("candidates", ""),
    ]
    whole = Calibration(*scenarios(street, "01", "03"))
    assert [group.item for group in whole.given_back] == [
        "south end",
        "north end",
        "south",
        "north",
    ]
    assert [group.stage for group in whole.taken] == ["candidates"]


def restaged(street, tmp_path, change):
    """Returns stages 02 and 03 with 02's groups changed by a function."""
    other = write_street(tmp_path / "other")
    path = other / "stages.yaml"
    stages = yaml.safe_load(path.read_text())
    change(stages)
    path.write_text(yaml.safe_dump(stages, sort_keys=False))
    return Calibration(*scenarios(other, "02", "03"))


def test_contributions_are_what_is_lost_without_a_group(
    calibration, street, tmp_path
):
    contributions = {
        group.item: change
        for group, change in calibration.contributions().items()
    }
    assert contributions.keys() == {"north", "south"}
    assert min(contributions.values()) > 0.01

    def give_back(stages):
        del stages["stages"]["02"]["absent"]["north"]

    without = restaged(street, tmp_path, give_back)
    assert without.change == calibration.change - contributions["north"]


def test_a_proposal_to_take_holds(calibration, street, tmp_path):
    proposal = calibration.propose(calibration.change + 0.03)
    assert not proposal.gives_back
    assert proposal.groups[0].item == "north end"

    def take(stages):
        for group in proposal.groups:
            lists = stages["stages"].get(group.stage, {}).get("absent", {})
            for names in (*lists.values(), stages["candidates"]):
                names[:] = [n for n in names if n not in group.names]
            stages["stages"]["02"]["absent"][f"more {group.item}"] = list(
                group.names
            )

    assert restaged(street, tmp_path, take).change == proposal.change
    # As near as whole houses allow.
    assert abs(proposal.change - calibration.change - 0.03) < 0.01


def test_a_proposal_to_give_back_names_a_part_of_a_group(calibration):
    proposal = calibration.propose(0.0)
    assert proposal.gives_back
    assert [g.names for g in proposal.groups] == [
        ("house_6",),
        ("house_4", "house_5"),
    ]
    assert proposal.change == calibration.control
    contributions = calibration.contributions()
    (south,) = (g for g in contributions if g.item == "south")
    partly = calibration.propose(
        calibration.change - contributions[south] - 0.02
    )
    assert [g.names for g in partly.groups] == [("house_6",), ("house_4",)]
    assert calibration.control < partly.change < calibration.change


def test_what_is_right_already_stays(calibration):
    proposal = calibration.propose(calibration.change)
    assert proposal.groups == ()
    assert proposal.change == calibration.change


def test_out_of_reach_gives_all_there_is(calibration):
    proposal = calibration.propose(0.99)
    # Of as good proposals the smallest counts: house 8 cannot be seen.
    assert proposal.groups[-1].stage == "candidates"
    assert proposal.change > calibration.change


def test_the_command_prints_a_proposal_and_writes_nothing(street, capsys):
    before = {path: path.read_bytes() for path in street.iterdir()}
    city(street, calibrate=("02", "03"), target=0.0)
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0].startswith("TCR_sym 0.")
    assert any("02 north: all 2" in line for line in lines)
    assert "give back" in out
    assert "scanning" in err
    assert {path: path.read_bytes() for path in street.iterdir()} == before


def test_parts_of_groups_are_named(calibration):
    lines = list(report_lines(calibration, calibration.change + 0.02))
    named = [line for line in lines if line.startswith("    ")]
    parts = [line for line in lines if "the first" in line]
    assert len(named) == len(parts) <= 1


@pytest.mark.parametrize(
    ("stages", "fault"),
    [
        (("03", "02"), "street_03: stage: not before that of street_02"),
        (("02", "02"), "street_02: stage: not before that of street_02"),
    ],
)
def test_stages_out_of_order_are_named(street, stages, fault):
    with pytest.raises(InputError, match=fault):
        Calibration(*scenarios(street, *stages))


@pytest.mark.parametrize(
    ("file", "fault"),
    [
        ("structures.csv", "structures.csv: no such file; generate"),
        ("stages.yaml", "stages.yaml: No such file"),
        ("stage_03.sdf", "stage: map .* has no stage '03'"),
    ],
)
def test_missing_files_are_named_in_one_line(tmp_path, file, fault):
    street = write_street(tmp_path / "street")
    (street / file).unlink()
    with pytest.raises(InputError, match=fault) as caught:
        city(street, calibrate=("01", "03"))
    assert "\n" not in str(caught.value)


def test_a_stage_that_is_not_told_is_named(tmp_path):
    street = write_street(tmp_path / "street")
    stages = yaml.safe_load((street / "stages.yaml").read_text())
    del stages["stages"]["01"]
    (street / "stages.yaml").write_text(yaml.safe_dump(stages))
    with pytest.raises(InputError, match=r"no stage '01', .* street_01"):
        Calibration(*scenarios(street, "01", "03"))


def test_another_city_is_named(street, tmp_path):
    other = write_street(tmp_path / "street")
    (earlier,) = scenarios(street, "01")
    (later,) = scenarios(other, "03")
    with pytest.raises(InputError, match="street_03: map: not that of"):
        Calibration(earlier, later)


def test_a_target_alone_is_bad_usage(street):
    with pytest.raises(InputError, match="--target: only with --calibrate"):
        city(street, target=0.2)
