"""Stages of scenarios to which something came, or from which it went."""

import json
import re

from helpers.tiny_drive import tiny_scenario
from helpers.transient_town import write_transient_town
from mcap.reader import make_reader
import numpy as np
import pytest

from cns_drake.base.errors import InputError
from cns_drake.base.recordings.mcap_sequence import McapSequence
from cns_drake.scenarios.provenance import digest_inputs
from cns_drake.scenarios.scenario_files import describe_scenario
from cns_drake.scenarios.scenario_loading import make_scenario
from cns_drake.simulation.simulated_drive import SimulatedSequence
from cns_drake.simulation.simulation import simulate


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


def test_recordings_and_surveys_see_the_same_changes(scenario, tmp_path):
    """The same bytes twice, and the table of structures has the causes."""
    changed = scenario.with_transient(parked_cars=1.0, leaves=0.3)
    for name in ("first", "second"):
        simulate(changed, tmp_path / name)
    first, second = (recorded(tmp_path / n) for n in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()
    recording, survey = McapSequence(first, None), SimulatedSequence(changed)
    plain = SimulatedSequence(scenario)
    for index in range(3):
        scan = recording.scan(index)
        assert np.array_equal(scan, survey.scan(index))
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


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"leaves": 1.1}, "leaves: .*less than or equal to 1"),
        ({"parked_cars": -0.1}, "parked_cars: .*greater than or equal to 0"),
        ({"seed": -1}, "seed: .*greater than or equal to 0"),
        ({"snowmen": 3}, "snowmen"),
    ],
)
def test_bad_values_are_one_line(scenario, changes, told):
    with pytest.raises(InputError, match=f"^tiny_01: transient: .*{told}") as e:
        scenario.with_transient(**changes)
    assert not re.search("\n", str(e.value))
