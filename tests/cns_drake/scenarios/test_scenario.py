"""Scenarios: accepted and refused ones, and their text."""

from helpers.small_map import scenario_values
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
import yaml

from cns_drake.command_line import run_drive
from cns_drake.scenarios import (
    describe_scenario,
    digest_inputs,
    load_scenario,
    make_scenario,
    plan_drive,
)
from cns_drake.sensors import (
    LidarSection,
    WeatherConfig,
    make_lidar_config,
    make_lidar_model,
    make_pattern,
    sensor_pose,
)
from evaluation.base import InputError
from worlds.maps import recordable_drives


def test_shipped_drives_load():
    names = recordable_drives().keys()
    assert {"metropolis_01", "metropolis_04"} <= names
    for name in names:
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.world_file.is_file()
        assert scenario.title


def test_defaults_are_the_sensor_contract():
    scenario = load_scenario("metropolis_04")
    (name, lidar), *others = scenario.lidars.items()
    assert (name, others) == ("lidar", [])
    np.testing.assert_array_equal(sensor_pose(lidar).translation(), [0, 0, 1.6])
    pattern = make_pattern(lidar)
    assert (pattern.num_rings, pattern.num_columns) == (32, 1024)
    assert (pattern.min_range, pattern.max_range) == (0.8, 120.0)
    imu = sensor_pose(scenario.imu)
    np.testing.assert_array_equal(imu.translation(), [-1.0, 0, 1.6])
    assert imu.rotation().IsNearlyIdentity(0.0)


def test_a_recorded_scenario_loads_again(small_map, tmp_path):
    values = scenario_values(small_map)
    values["lidars"] = {"roof": {"preset": "vlp-16", "rpy_deg": [0, 10, 0]}}
    scenario = make_scenario(values, "test")
    text = yaml.safe_dump(scenario.model_dump(mode="json"))
    path = tmp_path / "scenario.yaml"
    path.write_text(text)
    assert load_scenario(path) == scenario


def test_map_folder_is_relative_to_the_scenario_file(small_map):
    values = scenario_values(small_map) | {"map": small_map.name}
    path = small_map.parent / "own_drive.yaml"
    del values["name"]
    path.write_text(yaml.safe_dump(values))
    scenario = load_scenario(path)
    assert scenario.name == "own_drive"
    assert scenario.folder.path == small_map


def test_mount_angles_are_roll_pitch_yaw_in_degrees():
    mount = LidarSection(xyz=(1, 2, 3), rpy_deg=(10, 20, 30))
    expected = RigidTransform(
        RollPitchYaw(np.deg2rad([10.0, 20.0, 30.0])), [1, 2, 3]
    )
    assert sensor_pose(mount).IsNearlyEqualTo(expected, 1e-15)


def test_preset_replaces_the_lidar_where_it_is():
    scenario = load_scenario("metropolis_01").with_lidar("os1-128")
    config = scenario.lidars["lidar"]
    assert make_pattern(config).num_rings == 128
    assert config.xyz == (0.0, 0.0, 1.6)
    own = {"lidars": {"a": {"columns": 64, "range_noise": 0.02}}}
    values = scenario.model_dump() | own
    config = make_scenario(values, "test").with_lidar("vlp-16")
    assert config.lidars["a"] == LidarSection(preset="vlp-16", range_noise=0.02)
    with pytest.raises(InputError, match=r"^unit: .*os2-128.*vlp-16"):
        scenario.with_lidar("os2-128")


def test_returns_and_weather_are_replaced(small_map):
    noisy = {"lidars": {"a": {"range_noise": 0.02, "dropout": 0.1}}}
    scenario = make_scenario(scenario_values(small_map) | noisy, "test")
    fog = WeatherConfig(visibility=80.0)
    foggy = scenario.with_returns("calibrated", fog)
    assert foggy.weather == fog
    assert foggy.lidars["a"] == LidarSection(returns="calibrated")
    # A written scenario is read again.
    values = foggy.model_dump(mode="json")
    assert make_scenario(values, "test") == foggy
    unit = {"lidars": {"a": {"unit_seed": 5, "echoes": "dual"}}}
    clear = foggy.with_fields(unit, "test").with_returns("ideal")
    assert clear.lidars["a"] == LidarSection()
    # Without these fields a scenario is written as before there were any.
    dumped = clear.model_dump(mode="json")
    assert "weather" not in dumped
    assert {"returns", "echoes"}.isdisjoint(dumped["lidars"]["a"])


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"colour": "red"}, r"scenario.yaml: colour: .*not permitted"),
        ({"stage": 4}, r'scenario.yaml: stage: .*quote it: stage: "04"$'),
        ({"stage": "../x"}, r"scenario.yaml: stage: "),
        ({"frames": 0}, r"scenario.yaml: frames: .*greater"),
        ({"lidars": {}}, r"scenario.yaml: lidars: "),
        ({"lidars": {"imu": {}}}, r"lidars: 'imu' is the name of another"),
        ({"lidars": {"2nd": {}}}, r"lidars: the name '2nd' cannot be a part"),
        (
            {"lidars": {"a": {}, "a_sweep": {}}},
            r"lidars: 'a_sweep' is the name of another",
        ),
        (
            {"cameras": {"lidar": {}}},
            r"cameras: 'lidar' is the name of another",
        ),
        ({"cameras": {"a": {"width": 1, "height": 480}}}, r"a.width: .*equal"),
        ({"lidars": {"a": {"preset": "x"}}}, r"lidars.a.preset: no preset"),
        ({"lidars": {"a": {"range_noise": float("nan")}}}, r"a.range_noise: "),
        ({"lidars": {"a": {"returns": "real"}}}, r"a.returns: .*'calibrated'"),
        ({"lidars": {"a": {"echoes": "dual"}}}, r"echoes: only calibrated"),
        (
            {"lidars": {"a": {"returns": "calibrated", "dropout": 0.1}}},
            r"lidars.a: dropout: calibrated returns have their own",
        ),
        (
            {"weather": {"visibility": 80}, "lidars": {"a": {}}},
            r"weather\.\w+: it has no effect on ideal returns; give lidars.a",
        ),
        (
            {"lidars": {"a": {"max_range": 0.5}}},
            r"lidars.a: min_range 0.8 is not below max_range 0.5",
        ),
        (
            {"lidars": {"a": {"xyz": [0, float("inf"), 0]}}},
            r"a.xyz.1: .*finite",
        ),
        (
            {"ride": {"crossfall": 0.02}},
            r"ride: crossfall: it has no effect without roughness",
        ),
        ({"route": []}, r"scenario.yaml: route: "),
        ({"stage": "07"}, r"stage: .*no stage '07'; it has: 01, 04"),
        ({"map": "atlantis"}, r"map: .*atlantis' is neither"),
    ],
)
def test_bad_fields_are_named(small_map, tmp_path, change, fault):
    path = tmp_path / "scenario.yaml"
    path.write_text(yaml.safe_dump(scenario_values(small_map) | change))
    with pytest.raises(InputError, match=fault) as caught:
        load_scenario(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("number", [-1, 2.5])
def test_traffic_that_cannot_be(small_map, number):
    scenario = make_scenario(scenario_values(small_map), "drive.yaml")
    with pytest.raises(InputError, match="_04: traffic: vehicles: Input"):
        scenario.with_traffic(number)


def test_unknown_drive_names_the_known_ones():
    with pytest.raises(
        InputError, match=r"'metropolis_99'; .*did you mean metropolis_0\d\?"
    ):
        load_scenario("metropolis_99")


def test_errors_of_the_route_name_the_file(small_map, tmp_path):
    values = scenario_values(small_map) | {"name": "drive"}
    path = tmp_path / "drive.yaml"
    path.write_text(
        yaml.safe_dump(
            values | {"route": [dict(values["route"][0], road="milky_way")]}
        )
    )
    for scenario in (
        load_scenario(path),
        load_scenario(path).with_lidar("vlp-16"),
    ):
        with pytest.raises(InputError, match=r"drive\.yaml: route\.0 \(milky"):
            plan_drive(scenario)


def test_where_it_was_read_from_makes_no_other_scenario(small_map, tmp_path):
    values = scenario_values(small_map)
    path = tmp_path / "drive.yaml"
    path.write_text(yaml.safe_dump(values))
    loaded = load_scenario(path)
    assert loaded == make_scenario(values, "test")
    assert loaded != make_scenario(values | {"seed": 1}, "test")
    assert loaded.source == str(path)
    assert make_scenario(values, "test").source == values["name"]


def test_a_ride_is_written_only_where_there_is_one(small_map):
    values = scenario_values(small_map)
    rigid = make_scenario(values, "test")
    assert "ride" not in describe_scenario(rigid)
    rough = make_scenario({**values, "ride": {"roughness": "B"}}, "test")
    assert describe_scenario(rough)["ride"] == {"roughness": "B", "seed": 1}
    none = make_scenario({**values, "ride": {"roughness": "none"}}, "test")
    assert none == rigid
    moved, still = (plan_drive(one).poses([20.0])[1] for one in (rough, none))
    assert np.abs(moved - still).max() > 1e-4
    np.testing.assert_array_equal(plan_drive(rigid).poses([20.0])[1], still)
    assert "suspension" in digest_inputs(rough)
    assert digest_inputs(none) == digest_inputs(rigid)
    assert "suspension" not in digest_inputs(rigid)


def test_a_driver_is_written_only_where_there_is_one(small_map):
    values = scenario_values(small_map)
    calm = make_scenario(values, "test")
    assert "driver" not in describe_scenario(calm)
    real = calm.with_driver("real")
    assert describe_scenario(real)["driver"]["wander"] == 0.35
    assert real.with_driver("none") == calm
    seeded = make_scenario({**values, "driver": {"seed": 7}}, "test")
    assert seeded.with_driver("real").driver.seed == 7


@pytest.mark.parametrize(
    "driver",
    [
        {"wander": -0.1},
        {"seed": -1},
        {"swerve": 1},
    ],
)
def test_a_driver_that_is_none_is_named(small_map, driver):
    values = {**scenario_values(small_map), "driver": driver}
    (field,) = driver
    with pytest.raises(InputError, match=f"^test: driver.{field}: "):
        make_scenario(values, "test")


def test_along_waypoints_there_is_no_lane_to_change_to(small_map):
    values = scenario_values(small_map)
    del values["route"]
    values["waypoints"] = "way.csv"
    values["driver"] = {"wander": 0.35, "lane_changes": 2.0}
    with pytest.raises(InputError, match=r"^test: driver: .*lane_changes"):
        make_scenario(values, "test")
    values["driver"] = {"wander": 0.35}
    driver = make_scenario(values, "test").with_driver("real").driver
    assert (driver.wander, driver.lane_changes) == (0.35, 0.0)


@pytest.mark.parametrize(
    "ride", [{"roughness": "F"}, {"seed": -1}, {"class": 1}]
)
def test_a_ride_that_is_none_is_named(small_map, ride):
    values = {**scenario_values(small_map), "ride": ride}
    (field,) = ride
    with pytest.raises(InputError, match=f"^test: ride.{field}: "):
        make_scenario(values, "test")


def write_drives(folder, **drives):
    """Writes a scenario file for each name; returns the first."""
    paths = []
    for name, values in drives.items():
        paths.append(folder / f"{name}.yaml")
        paths[-1].write_text(yaml.safe_dump(values, sort_keys=False))
    return paths[0]


def test_a_base_has_what_a_drive_leaves_out(tmp_path):
    shipped = load_scenario("riverside_01")
    path = write_drives(
        tmp_path,
        rough={
            "base": "car.yaml",
            "ride": {"roughness": "B"},
            "transient": {"snow": 0.2},
            "lidars": {"a": {"xyz": [1, 0, 2]}, "b": {}, "lidar": None},
            "without": ["tower"],
            "aside": None,
        },
        car={
            "base": "riverside_01",
            "name": "car",
            "speeds": {"cruise": 9},
            "ride": {"seed": 5},
            "transient": {"seed": 7},
            "lidars": {"a": {"preset": "vlp-16", "rpy_deg": [0, 10, 0]}},
            "without": ["house", "tree"],
        },
    )
    drive = load_scenario(path)
    assert drive.name == "rough"
    assert drive.source == str(path)
    assert drive.route == shipped.route
    assert drive.speeds == shipped.speeds.model_copy(update={"cruise": 9.0})
    assert (drive.ride.roughness, drive.ride.seed) == ("B", 5)
    assert (drive.transient.snow, drive.transient.seed) == (0.2, 7)
    assert (shipped.aside, drive.aside) == (1.2, 0.0)
    assert drive.without == ("tower",)
    assert drive.lidars == {
        "a": LidarSection(preset="vlp-16", rpy_deg=(0, 10, 0), xyz=(1, 0, 2)),
        "b": LidarSection(),
    }
    # It is recorded whole, without its base.
    values = drive.model_dump(mode="json", exclude_none=True)
    assert "base" not in values
    assert make_scenario(values, "test") == drive


def test_paths_are_relative_to_the_file_that_has_them(small_map, tmp_path):
    folder = tmp_path / "far"
    folder.mkdir()
    values = scenario_values(small_map) | {"imu": {"kalibr": "imu.yaml"}}
    write_drives(folder, base=values)
    near = write_drives(tmp_path, near={"base": "far/base.yaml"})
    with pytest.raises(InputError, match=r"near.yaml: imu.kalibr: .*far/imu"):
        load_scenario(near)


def test_what_excludes_a_field_of_the_base_replaces_it(small_map, tmp_path):
    (tmp_path / "tour.csv").write_text("x,y\n0,0\n50,0\n")
    world = small_map / "stage_04.sdf"
    path = write_drives(
        tmp_path,
        route={"base": "world.yaml", "map": str(small_map), "stage": "04"}
        | {"route": scenario_values(small_map)["route"]},
        world={"base": "tour.yaml", "world": str(world)},
        tour={"base": "riverside_01", "waypoints": "tour.csv", "u_turns": True},
    )
    drive = load_scenario(tmp_path / "tour.yaml")
    assert (drive.route, drive.aside, drive.map) == (None, 0.0, "riverside")
    drive = load_scenario(tmp_path / "world.yaml")
    assert (drive.map, drive.stage, drive.u_turns) == (None, None, True)
    drive = load_scenario(path)
    assert (drive.world, drive.waypoints, drive.u_turns) == (None, None, False)


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        (
            {"base": "nowhere"},
            r"a.yaml: base: 'nowhere' is neither a .*riversi",
        ),
        ({"base": "a.yaml"}, r"a.yaml: base: 'a.yaml' has this drive as its"),
        ({"base": "ring.yaml"}, r"ring.yaml: base: '../.*a.yaml' has this"),
        ({"base": "bad.yaml"}, r"bad.yaml: fames: .*did you mean frames"),
        ({"base": "b.yaml", "rid": 1}, r"a.yaml: rid: .*did you mean ride"),
        ({"base": "b.yaml", "ride": "A"}, r"a.yaml: ride: .*not a mapping"),
        ({"base": "b.yaml", "speeds": 3}, r"a.yaml: speeds: .*not a mapping"),
        ({"base": "b.yaml", "speeds": None}, r"a.yaml: speeds: .*required"),
        ({"base": "b.yaml", "route": {"0": {}}}, r"a.yaml: route: .*list"),
        ({"base": None}, r"a.yaml: world: give either a map"),
    ],
)
def test_faults_of_a_base_are_named(tmp_path, values, fault):
    path = write_drives(
        tmp_path,
        a=values,
        b={"base": "riverside_01"},
        bad={"base": "b.yaml", "fames": 3},
        ring={"base": f"../{tmp_path.name}/a.yaml"},
    )
    with pytest.raises(InputError, match=fault) as caught:
        load_scenario(path)
    assert "\n" not in str(caught.value)


def test_only_a_file_has_a_base():
    with pytest.raises(InputError, match=r"^test: base: only a scenario file"):
        make_scenario({"name": "a", "base": "riverside_01"}, "test")


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"stage": None, "stge": "04"}, "stge: .*did you mean stage"),
        ({"route": None, "rout": []}, "rout: .*did you mean route"),
        ({"speeds": None, "frames": "all"}, "frames: .*integer"),
        ({"stage": None, "seed": -1}, "seed: .*greater"),
    ],
)
def test_the_fault_that_causes_others_comes_first(small_map, change, fault):
    values = scenario_values(small_map) | change
    values = {
        name: value for name, value in values.items() if value is not None
    }
    with pytest.raises(InputError, match=f"^test: {fault}") as error:
        make_scenario(values, "test")
    # No riddle about faults that may be consequences of the first.
    assert not str(error.value).endswith(")")


def test_a_driver_without_lanes_comes_with_a_note(
    small_map, tmp_path, monkeypatch, capsys
):
    values = scenario_values(small_map)
    (tmp_path / "drive.yaml").write_text(yaml.safe_dump(values))
    del values["route"]
    values["waypoints"] = "way.csv"
    (tmp_path / "tour.yaml").write_text(yaml.safe_dump(values))
    (tmp_path / "way.csv").write_text("x,y\n0,0\n90,0\n")

    def refuse(scenario, output, **options):
        raise InputError(f"wander {scenario.driver.wander}")

    start = "cns_drake.command_line.drive_script.import_simulation"
    monkeypatch.setattr(start, lambda: refuse)
    for name, notes in (("drive", 0), ("tour", 1)):
        with pytest.raises(InputError, match=r"wander 0\.35"):
            run_drive(tmp_path / f"{name}.yaml", tmp_path, driver="real")
        assert capsys.readouterr().err.count("no lanes") == notes


@pytest.mark.parametrize("folder", ["my town", "städtchen", "a..b", "-a"])
def test_the_name_of_a_folder_may_be_no_name(small_map, tmp_path, folder):
    file = tmp_path / folder / "sequence_01.yaml"
    file.parent.mkdir()
    values = scenario_values(small_map)
    del values["name"]
    file.write_text(yaml.safe_dump(values))
    with pytest.raises(InputError, match=f"name: '{folder}_01', from its"):
        load_scenario(file)
    file.write_text(yaml.safe_dump({**values, "name": "mine"}))
    assert load_scenario(file).name == "mine"


@pytest.mark.parametrize("hidden", [(150, -150), (-30, 30), (20, 10)])
def test_a_hidden_sector_lacks_its_beams_alone(hidden):
    """Counterclockwise from its first azimuth to its last."""
    section = make_lidar_config("vlp-16")
    whole, seen = (
        make_lidar_model(one, "lidar", 0).pattern.beams(0).d_Sset
        for one in (section, section.replaced(hidden_deg=hidden))
    )
    first, last = hidden
    azimuth = np.degrees(np.arctan2(whole[:, 1], whole[:, 0]))
    inside = (azimuth - first) % 360.0 < (last - first) % 360.0
    on_limit = np.isclose(azimuth, first) | np.isclose(azimuth, last)
    np.testing.assert_array_equal(seen, whole[~inside | on_limit])


@pytest.mark.parametrize("hidden", [[10, 10], [0, 200], [1]])
def test_a_sector_that_is_none_is_refused(hidden):
    with pytest.raises(InputError, match="hidden_deg"):
        load_scenario("suburbia_01").with_fields(
            {"lidars": {"*": {"hidden_deg": hidden}}}, "mine"
        )


def test_a_drive_goes_through_the_city_of_another(small_map, tmp_path):
    """Also if the city was made for one of them."""
    drive = make_scenario(scenario_values(small_map), "test")
    aged = drive.in_folder((tmp_path / "aged", "02"))
    back = aged.in_city_of(drive)
    assert (back.folder.path, back.stage_in_folder) == (
        drive.folder.path,
        drive.stage_in_folder,
    )
    there = drive.in_city_of(aged)
    assert (there.folder.path, there.stage_in_folder) == (
        tmp_path / "aged",
        "02",
    )
