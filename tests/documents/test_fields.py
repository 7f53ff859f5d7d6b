"""Every field of the input files is in a table, with its default."""

import typing

from helpers import documents
from pydantic import BaseModel
import pytest
import yaml

from cns_drake.city.buildings import ARCHETYPES
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plan import city_plan, stages
from cns_drake.motion.speeds import Speeds
from cns_drake.roads import road_schema
from cns_drake.roads.route import RouteLeg
from cns_drake.scenarios import scenario, variation
from cns_drake.scenarios.imu_config import ImuConfig
from cns_drake.scenarios.lidar_config import LidarConfig
from cns_drake.scenarios.odometry_config import OdometryConfig
from cns_drake.scenarios.ride_config import RideConfig
from cns_drake.scenarios.traffic_config import TrafficConfig
from cns_drake.scenarios.transient_config import TransientConfig
from cns_drake.scenarios.weather_config import WeatherConfig
from cns_drake.sensors.lidar_presets import LIDAR_PRESETS
from evaluation.methods import MethodConfig, make_method, shipped_methods

# Page, heading above the table, model, and a model whose fields are told of
# elsewhere.
TABLES = [
    ("city", "## `roads.yaml`", road_schema.RoadsFile, None),
    ("city", "### A road's style", road_schema.RoadStyle, None),
    ("city", "### A road", road_schema.RoadEntry, road_schema.RoadStyle),
    ("city", "### A junction", road_schema.JunctionEntry, None),
    ("city", "## `city.yaml`", city_plan.CityPlan, None),
    ("city", "### A district", city_plan.DistrictPlan, None),
    ("city", "### A patch", city_plan.PatchPlan, None),
    ("city", "### A building", city_plan.BuildingPlan, None),
    ("city", "### A row", city_plan.RowPlan, None),
    ("city", "### A parking lot", city_plan.ParkingPlan, None),
    ("city", "### An object", city_plan.ObjectPlan, None),
    ("city", "### A line", city_plan.LinePlan, None),
    ("city", "### A scatter", city_plan.ScatterPlan, None),
    ("city", "### A street", city_plan.StreetPlan, None),
    ("city", "## `stages.yaml`", stages.Stages, None),
    ("city", "### A stage", stages.Stage, None),
    ("city", "### A growth", stages.Growth, None),
    ("scenarios", "## Fields", scenario.Scenario, None),
    ("scenarios", "### Route", RouteLeg, None),
    ("scenarios", "### Speeds", Speeds, None),
    ("scenarios", "### Ride", RideConfig, None),
    ("scenarios", "### Traffic", TrafficConfig, None),
    ("scenarios", "### Transient", TransientConfig, None),
    ("scenarios", "### LiDARs", LidarConfig, None),
    ("scenarios", "### Weather", WeatherConfig, None),
    ("scenarios", "### IMU", ImuConfig, None),
    ("scenarios", "### Odometry", OdometryConfig, None),
    ("scenarios", "## Families", variation.Family, None),
    ("scenarios", "### Routes by lot", variation.DrawnRoutes, None),
    *(
        ("methods", heading, type(make_method(name, {}).config), MethodConfig)
        for heading, name in [
            ("### Scan Context++", "scan-context++"),
            ("### SOLiD", "solid"),
            ("### RING++", "ring++"),
            ("### BTC", "btc"),
            ("### Layered overlap", "layered-overlap"),
        ]
    ),
]
# What a file may hold that begins with one of these.
ROOTS = [
    road_schema.RoadsFile,
    city_plan.CityPlan,
    stages.Stages,
    scenario.Scenario,
    variation.Family,
    *(type(make_method(name, {}).config) for name in shipped_methods()),
]


@pytest.mark.parametrize(
    ("page", "heading", "model", "base"),
    TABLES,
    ids=[f"{page}: {heading}" for page, heading, _, _ in TABLES],
)
def test_a_table_has_every_field(page, heading, model, base):
    rows = documents.table(documents.read(f"docs/{page}.md"), heading)
    said = {row[0].strip("`"): row[1].strip("`") for row in rows}
    elsewhere = base.model_fields if base else {}
    fields = {
        name: field
        for name, field in model.model_fields.items()
        if name not in elsewhere
    }
    assert said.keys() == fields.keys()
    for name, field in fields.items():
        assert_default(said[name], field, f"{heading}: {name}")


def assert_default(said, field, where):
    if said == "the file's name":
        assert field.is_required(), where  # Whoever reads the file fills it in.
        return
    if said == "required":
        assert field.is_required(), where
        return
    default = field.get_default(call_default_factory=True)
    if holds_models(default):  # Told in words.
        return
    if default is None or default in ((), [], {}, ""):
        assert said == "none", where
    else:
        assert yaml.safe_load(said) == plain(default), where


def holds_models(value):
    values = value.values() if isinstance(value, dict) else [value]
    return any(isinstance(one, BaseModel) for one in values)


def plain(value):
    """Returns a value as YAML has it."""
    return list(value) if isinstance(value, tuple) else value


def test_every_model_has_a_table():
    found, waiting = set(), list(ROOTS)
    while waiting:
        model = waiting.pop()
        found.add(model)
        for field in model.model_fields.values():
            waiting += set(models_in(field.annotation)) - found
    # A route is a list of its legs.
    found = {model for model in found if model.__name__ != "Route"}
    assert {model for _, _, model, _ in TABLES} >= found


def models_in(annotation):
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in typing.get_args(annotation):
        yield from models_in(argument)


@pytest.mark.parametrize(
    ("heading", "registry"),
    [("### Archetypes", ARCHETYPES), ("### Objects", OBJECTS)],
)
def test_what_can_be_placed_is_listed(heading, registry):
    page = documents.read("docs/city.md")
    _, _, rest = page.text.partition(f"\n{heading}\n")
    section = documents.Page(page.name, rest.partition("\n#")[0])
    listed = [piece.text for piece in documents.inline(section)]
    assert sorted(listed) == sorted(registry)


def test_lidar_presets():
    page = documents.read("docs/scenarios.md")
    rows = documents.table(page, "### LiDAR presets")
    said = {row[0].strip("`"): (int(row[1]), row[3], row[4]) for row in rows}
    assert said == {
        name: (
            preset.num_rings,
            str(preset.num_columns or "-"),
            f"{preset.min_range:g} to {preset.max_range:g}",
        )
        for name, preset in LIDAR_PRESETS.items()
    }
