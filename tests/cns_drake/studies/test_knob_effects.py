"""Calibration: the pair as it is, and with each knob taken back."""

from helpers import studies
from helpers.small_city import write_small_city
import pytest

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.city.generation.generate import generate_city
from cns_drake.scenarios.scenario import Scenario
from cns_drake.studies import knob_effects as knob_effects_module
from cns_drake.studies.knob_effects import effect_lines, knob_effects

pytestmark = pytest.mark.slow

STAGES = """
stages:
  "01":
    story: low, and without a house
    absent: {a house: [office_001]}
    lower: {others: {height: 5, structures: ["brick_block_*"]}}
  "02": {story: all of it}
"""


def drive(folder, stage, **values):
    legs = [
        {"road": "south", "direction": "backward", "lane": 1},
        {"road": "north", "direction": "backward", "lane": 1},
    ]
    return Scenario.model_validate(
        {
            "name": f"town_{stage}",
            "map": str(folder),
            "stage": stage,
            "route": legs,
            "speeds": {
                "cruise": 14.0,
                "longitudinal_acceleration": 4.0,
                "lateral_acceleration": 6.0,
            },
            "lidars": {"lidar": {"columns": 128}},
            **values,
        }
    )


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    folder = write_small_city(tmp_path_factory.mktemp("town") / "town")
    (folder / "stages.yaml").write_text(STAGES)
    generate_city(folder)
    return folder


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch):
    studies.run_here(monkeypatch, knob_effects_module)


def test_each_knob_is_taken_back(town):
    effects = knob_effects(
        drive(town, "01", aside=0.6, frames=40),
        drive(town, "02", frames=40),
        Cluster(),
    )
    change = {title: found[""]["tcr_sym"] for title, found in effects.items()}
    as_it_is, centred, present, high, unchanged = change.values()
    assert list(change) == [
        "as it is",
        "the earlier drive in the middle of its lanes",
        "nothing absent",
        "nothing lower",
        "the earlier drive in the later stage",
    ]
    # Both the house and the storeys are missed; the offset is not.
    assert unchanged < present < as_it_is
    assert unchanged < high < as_it_is
    assert centred == pytest.approx(as_it_is, abs=0.02)
    for found in effects.values():
        assert found.keys() >= {"ring++", "btc"}
        assert all(0 <= found[m]["auc"] <= 1 for m in found if m)
    head, *rows = effect_lines(effects)
    assert "TCR_sym" in head
    assert len({len(line) for line in (head, *rows)}) == 1
    assert f"{as_it_is:.4f}" in rows[0]


@pytest.mark.usefixtures("few_methods")
def test_absent_knobs_are_not_taken_back(town):
    stages = town / "stages.yaml"
    text = stages.read_text()
    stages.write_text(text.replace("absent: {a house: [office_001]}\n", "\n"))
    try:
        effects = knob_effects(
            drive(town, "01", frames=5),
            drive(town, "02", frames=5),
            Cluster(),
        )
    finally:
        stages.write_text(text)
    assert list(effects) == [
        "as it is",
        "nothing lower",
        "the earlier drive in the later stage",
    ]


def test_of_one_map_only(town, tmp_path):
    other = drive(town, "02").model_copy(update={"map": str(tmp_path)})
    with pytest.raises(
        InputError, match="town_02: map: it is not that of town_01"
    ):
        knob_effects(drive(town, "01"), other, Cluster())
