"""Drives through cities that their field `city` changes."""

from helpers.small_city import write_small_city
import pytest
import yaml

from cns_drake.pictures import other_stage
from cns_drake.scenarios import (
    in_made_city,
    load_scenario,
    load_scenario_world,
    lost_structures,
    make_city,
    recording_fingerprint,
    set_fields,
)
from cns_drake.scene import structures_in
from cns_drake.simulation import SimulatedDrive, simulate
from evaluation.base import InputError
from evaluation.drives import open_drive
from worlds.city import generate_city

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A drive of 3 frames through the last stage of a small city."""
    folder = write_small_city(tmp_path_factory.mktemp("maps") / "town")
    generate_city(folder)
    path = folder / "sequence_02.yaml"
    leg = {"road": "north", "direction": "backward", "lane": 1}
    speeds = {
        "cruise": 8.0,
        "longitudinal_acceleration": 2.0,
        "lateral_acceleration": 2.0,
    }
    fields = {"map": ".", "stage": "02", "route": [leg], "speeds": speeds}
    fields |= {"frames": 3, "lidars": {"lidar": {"columns": 32}}}
    path.write_text(yaml.safe_dump(fields))
    return load_scenario(path)


def test_fields_that_are_off_are_not_written(drive):
    plain = drive.model_dump_json()
    for text in ("city.seed=7", "city.towards=01", "offset.left=0"):
        assert set_fields(drive, [text]).model_dump_json() == plain
    assert "city" not in plain
    assert "offset" not in plain


def test_what_is_missing_is_not_in_the_world(drive):
    changed = set_fields(drive, ["city.missing=0.5", "city.seed=3"])
    lost = set(lost_structures(changed))
    whole = structures_in(load_scenario_world(drive))
    assert lost
    assert structures_in(load_scenario_world(changed)) == whole - lost
    assert lost_structures(drive) == ()


@pytest.mark.parametrize(
    ("field", "name"),
    [("years=3", "town_y03_s1"), ("redraw=4", "town_c4")],
)
def test_a_city_is_made_once_and_its_place_is_not_recorded(
    drive, tmp_path, field, name
):
    changed = set_fields(drive, [f"city.{field}"])
    with pytest.raises(InputError, match="city: its map has not been made"):
        load_scenario_world(changed)
    made = make_city(changed, tmp_path / "cities")
    assert made == changed
    assert made.folder.path == (tmp_path / "cities" / name).resolve()
    assert structures_in(load_scenario_world(made)) != structures_in(
        load_scenario_world(drive)
    )
    before = made.world_file.stat()
    assert make_city(changed, tmp_path / "cities").world_file == made.world_file
    assert made.world_file.stat() == before
    elsewhere = in_made_city(changed, tmp_path / "elsewhere")
    assert recording_fingerprint(made, {}) == recording_fingerprint(
        elsewhere, {}
    )
    # A change of the scenario takes it out of its folder.
    assert made.with_fields({"city": None}, "test") == drive


def test_pages_show_the_city_without_and_with_a_change(drive, tmp_path):
    for text, told in (
        ("city.missing=0.5", "the whole city"),
        ("city.years=3", "stage 02"),
    ):
        changed = set_fields(drive, [text])
        plain, name, is_earlier = other_stage(changed)
        assert (plain, name, is_earlier) == (drive, told, True)
        page = tmp_path / "drive.html"
        simulate(changed, tmp_path / text, page_file=page, overwrite=True)
        assert "Before and after" in page.read_text()


def test_an_offset_moves_the_lidar_and_nothing_else(drive, tmp_path):
    changed = set_fields(
        drive, ["offset.left=2", "offset.ahead=1", "offset.yaw_deg=90"]
    )
    here, beside = (SimulatedDrive(one) for one in (drive, changed))
    x, y, z = here.X_BS[:3, 3]
    assert beside.X_BS[:3, 3] == pytest.approx([x + 1, y + 2, z])
    assert beside.X_BS[:3, 0] == pytest.approx([0, 1, 0], abs=1e-12)
    recorded = open_drive(simulate(changed, tmp_path).folder)
    assert (recorded.scan(1) == beside.scan(1)).all()
    assert [one.xyz for one in changed.lidars.values()] == [
        one.xyz for one in drive.lidars.values()
    ]


def test_every_lidar_gets_the_fields_of_the_star(drive):
    two = set_fields(drive, ["lidars.roof.rings=8"])
    changed = set_fields(
        two, ["lidars.*.returns=calibrated", "lidars.roof.columns=90"]
    )
    assert {one.returns for one in changed.lidars.values()} == {"calibrated"}
    assert [changed.lidars[n].columns for n in ("lidar", "roof")] == [32, 90]
    # Another model has its own columns.
    other = set_fields(drive, ["lidars.*.preset=vlp-16"])
    assert other.lidars["lidar"].columns is None


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("city.seeds=3", "--set: city.seeds: .*seed"),
        ("city.towards=09", "city.towards: map .* has no stage '09'; it has"),
        ("city={years: 3, redraw: 2}", "city.redraw: a city drawn anew does"),
        ("city.years=201", "city.years: "),
        ("city.years=1.5", "city.years: "),
        ("city.scattered={pole: 2}", "city.scattered: .*pole: 2.* from 0 to 1"),
        ("offset.left=101", "offset.left: "),
    ],
)
def test_faults_are_one_line_with_their_field(drive, text, fault):
    with pytest.raises(InputError, match=fault) as error:
        set_fields(drive, [text])
    assert "\n" not in str(error.value)


def test_the_last_stage_ages(drive, tmp_path):
    early = set_fields(drive, ["stage='01'", "city.years=2"])
    with pytest.raises(InputError, match=r"years: .* stage: '02', not '01'"):
        simulate(early, tmp_path)
    assert not list(tmp_path.iterdir())
