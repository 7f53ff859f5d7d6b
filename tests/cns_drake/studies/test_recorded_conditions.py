"""What a study measures can be recorded: every field, and every cause."""

import csv

from helpers.bag_recordings import contents
from helpers.internal import studies
from helpers.small_city import write_small_city
import pytest
import yaml

from cns_drake.scenarios import load_scenario
from cns_drake.simulation import simulate
from cns_drake.studies import named_drives, record_all, run_study
from evaluation import RetrievalProtocol, recognise
from evaluation.base import Cluster
from evaluation.results import Results, as_factor
from evaluation.study import causes, load_experiment
from worlds.city import generate_city

pytestmark = [pytest.mark.slow]

FIELDS = {
    "missing": {"query": {"city": {"missing": 0.3}}},
    "scattered": {"query": {"city": {"scattered": {"building": 0.5}}}},
    "towards": {"query": {"city": {"missing": 0.5, "towards": "01"}}},
    "years": {"query": {"city": {"years": 5}}},
    "rates": {"database": {"city": {"years": 3, "rates": 4}}},
    "redraw": {"database": {"city": {"redraw": 2}}},
    "offset": {"database": {"offset": {"left": 3.0, "yaw_deg": 90}}},
    "lidars": {"both": {"lidars": {"*": {"returns": "calibrated"}}}},
    "hidden": {"query": {"lidars": {"*": {"hidden_deg": [90, -135]}}}},
    "tilt": {"query": {"lidars": {"*": {"rpy_deg": [2, 5, 0]}}}},
    "sessions": {
        "query": {"city": {"years": 2}},
        "database": {"city": {"years": 1}},
    },
}
# Places of other cities belong to no drive of a pair.
CAUSES = [name for name in causes() if name != "size"]


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A small city with a drive of 24 frames in each of two stages."""
    folder = write_small_city(tmp_path_factory.mktemp("maps") / "town")
    generate_city(folder)
    for stage in ("01", "02"):
        drive = {
            "map": ".",
            "stage": stage,
            "route": [{"road": "north", "direction": "backward", "lane": 1}],
            "speeds": {
                "cruise": 14.0,
                "longitudinal_acceleration": 4.0,
                "lateral_acceleration": 6.0,
            },
            "lidars": {"lidar": {"columns": 64}},
            "frames": 24,
        }
        path = folder / f"sequence_{stage}.yaml"
        path.write_text(yaml.safe_dump(drive))
    return folder


def check(town, tmp_path, monkeypatch, **fields):
    """Measures, records and compares; returns the rows of `pairs.csv`."""
    studies.jobs_here(monkeypatch)
    file = tmp_path / "mine.yaml"
    fields = {
        "maps": str(town),
        "methods": ["solid"],
        "protocol": {
            "base": "recorded",
            "radius": 6.5,
            "query_spacing": 2.0,
            "place_spacing": 1.0,
        },
        **fields,
    }
    file.write_text(yaml.safe_dump(fields))
    measured, recorded = tmp_path / "measured", tmp_path / "recorded"
    run_study(load_experiment(file), measured, Cluster())
    results = Results.read(measured / "results.csv")
    record_all(
        named_drives((), str(file), recorded, Cluster()), recorded, Cluster()
    )
    with (recorded / "pairs.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        protocol = RetrievalProtocol(
            radius=float(row["radius"]),
            query_spacing=float(row["query_spacing"]),
            place_spacing=float(row["place_spacing"]),
            turn_queries=row["turn_queries"] == "1",
            tilt_queries=float(row["tilt_queries"]),
            hide_sector=float(row["hide_sector"]),
            seed=int(row["protocol_seed"]),
        )
        found = recognise(
            recorded / row["database"],
            recorded / row["query"],
            "solid",
            protocol=protocol,
        )
        factors = {
            name: as_factor(text)
            for name, text in row.items()
            if "." in name or name in ("cause", "level")
        }
        here = results.where(
            factors, seed=int(row["seed"]), task="place", verified=False
        )
        for metric in ("auc", "r1", "f1_max"):
            (value,) = {one.value for one in here.where(metric=metric).rows}
            assert value == pytest.approx(
                found.metrics[metric], abs=5e-7, nan_ok=True
            )
    for path in (recorded / "scenarios").glob("*.yaml"):
        drive = load_scenario(path)
        again = simulate(drive, tmp_path / "again").folder
        assert contents(again) == contents(recorded / drive.name)
    return rows


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", FIELDS)
def test_a_field_of_a_drive(town, tmp_path, monkeypatch, name):
    (row,) = check(town, tmp_path, monkeypatch, **FIELDS[name])
    assert row["map"] == "town"
    assert row["database"] != row["query"]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", CAUSES)
def test_a_cause(town, tmp_path, monkeypatch, name):
    case = load_experiment("ladder").cases[name]
    protocol = {"base": "recorded", "query_spacing": 2.0}
    if "protocol" not in case:
        protocol["radius"] = 6.5
    rows = check(
        town, tmp_path, monkeypatch, cases={name: case}, protocol=protocol
    )
    assert rows[0]["cause"] == "none"
    # The town has no recorded traffic.
    assert {row["case"] for row in rows[1:]} <= {name}
    assert len(rows) > 1 or name in ("traffic", "driver")


def test_factors_are_columns(town, tmp_path, monkeypatch):
    rows = check(
        town,
        tmp_path,
        monkeypatch,
        query={"city": {"missing": [0.0, 0.4]}},
        seeds=[3, 4],
    )
    told = [(row["query.city.missing"], row["seed"]) for row in rows]
    # Nothing is drawn where nothing is missing.
    assert told == [("0.0", "3"), ("0.4", "3"), ("0.4", "4")]
