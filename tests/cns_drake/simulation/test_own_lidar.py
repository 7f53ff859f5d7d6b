"""A LiDAR of one's own, found again in the data, by each way in."""

import dataclasses

from helpers.internal.eval_program import run_program
from helpers.tiny_drive import tiny_scenario, write_scenario
import numpy as np
from pydrake.common.yaml import yaml_load_typed
from pydrake.geometry import Box
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
import pytest
import yaml

from cns_drake import ApplyLidarConfig, LidarConfig, add_lidar, load_scenario
from cns_drake import command_line as cli
from cns_drake.export import export_drive
from cns_drake.scenarios import digest_inputs, recording_fingerprint
from cns_drake.sensors import make_pattern
from cns_drake.simulation import simulate
from evaluation import open_drive
from evaluation.base import InputError
from evaluation.drives import read_scenario

SHEET = {
    "rings_deg": [[4.0, 1.0, 4], -2.0, [-5.0, -20.0, 6]],
    "columns": 40,
    "ranges": [0.5, 60.0],
    "source": "mine",
}
ELEVATIONS = [4, 3, 2, 1, -2, -5, -8, -11, -14, -17, -20]
# Rounding to 2^-10 m near the LiDAR [deg].
ROUNDED = 0.02


def write_sheet(folder, name="unit.yaml", **changes):
    path = folder / name
    path.write_text(yaml.safe_dump({**SHEET, **changes}))
    return path


def write_drive(folder, lidar, name="mine"):
    """Writes a drive of two frames whose LiDAR has the given fields."""
    scenario = tiny_scenario(folder, name=name, frames=2, lidars={"lidar": {}})
    values = scenario.model_dump(exclude_none=True)
    values["lidars"] = {"lidar": lidar}
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(values))
    return path


def elevations_of(scan):
    """Ring -> mean elevation of its points [deg]."""
    across = np.hypot(scan["x"], scan["y"])
    elevation = np.degrees(np.arctan2(scan["z"], across))
    rings = np.unique(scan["ring"]).tolist()
    return {k: float(elevation[scan["ring"] == k].mean()) for k in rings}


def assert_seen(scan, expected=ELEVATIONS):
    """The rings that see the ground have the expected elevations."""
    found = elevations_of(scan)
    down = {k for k, one in enumerate(expected) if one < -1.0}
    assert down <= found.keys()
    for ring, elevation in found.items():
        assert elevation == pytest.approx(expected[ring], abs=ROUNDED)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A recording with a LiDAR of one's own, whose sheet is gone."""
    folder = tmp_path_factory.mktemp("own")
    sheet = write_sheet(folder)
    scenario = load_scenario(write_drive(folder, {"unit": sheet.name}))
    sheet.unlink()
    return simulate(scenario, folder / "out").folder


def test_a_recording_states_the_sheet(recording):
    drive = open_drive(recording)
    assert_seen(drive.scan(0))
    assert drive.lidar_field == (11, -20.0, 4.0)
    written = yaml.safe_load((recording / "scenario.yaml").read_text())
    unit = written["lidars"]["lidar"]["unit"]
    assert unit == drive.lidar_section["unit"]
    assert unit["columns"] == 40
    assert "preset" not in written["lidars"]["lidar"]
    distance = np.sqrt(sum(drive.scan(0)[axis] ** 2 for axis in "xyz"))
    assert distance.max() < 60.0 + 0.01


def test_it_is_simulated_again_from_its_own_scenario(recording, tmp_path):
    scenario = load_scenario(recording / "scenario.yaml")
    again = simulate(scenario, tmp_path).folder
    one, other = open_drive(recording), open_drive(again)
    np.testing.assert_array_equal(one.scan(1), other.scan(1))


@pytest.mark.parametrize("format_name", ["kitti", "cns"])
def test_an_export_has_the_rings(recording, tmp_path, format_name):
    drive = open_drive(
        export_drive(open_drive(recording), format_name, tmp_path / format_name)
    )
    assert drive.lidar_field == (11, -20.0, 4.0)
    scan = drive.scan(0)
    elevation = np.degrees(
        np.arctan2(scan["z"], np.hypot(scan["x"], scan["y"]))
    )
    off = np.abs(elevation[:, None] - ELEVATIONS).min(axis=1)
    assert off.max() < 2.0 * ROUNDED


def run_drake(capfd, *words):
    status, out, err = run_program(capfd, "cns-drake", cli.main, *words)
    return status, out + err


def test_the_option_of_a_simulation(tmp_path, capfd):
    drive = write_scenario(tiny_scenario(tmp_path, frames=2), tmp_path)
    words = ["simulate", drive, "--output", tmp_path / "out"]
    sheet = write_sheet(tmp_path)
    status, said = run_drake(capfd, *words, "--lidar", sheet)
    assert status == 0, said
    drive = open_drive(tmp_path / "out/tiny_01")
    assert drive.lidar_field == (11, -20.0, 4.0)
    assert np.ptp(drive.scan(0)["ring"]) <= 10
    write_sheet(tmp_path, columns="many")
    status, said = run_drake(capfd, *words, "--lidar", sheet, "--overwrite")
    assert status == 2
    assert f"--lidar: {sheet}: columns: " in said
    assert said.strip().count("\n") == 0
    status, said = run_drake(capfd, *words, "--lidar", tmp_path / "no.yaml")
    assert (status, "no.yaml: No such file" in said) == (2, True)


def test_the_option_of_a_scan(tmp_path, capfd):
    tiny_scenario(tmp_path)
    sheet, output = write_sheet(tmp_path), tmp_path / "scan.npy"
    pose = ("--pose", 0, 0, 1.6, 0, 0, 0)
    words = ["scan", tmp_path / "tiny.sdf", *pose, "--output", output]
    status, said = run_drake(capfd, *words, "--lidar", sheet)
    assert status == 0, said
    x, y, z = np.load(output).T[:3]
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
    off = np.abs(elevation[:, None] - ELEVATIONS).min(axis=1)
    assert off.max() < 1e-3
    for returns in ("ideal", "calibrated"):
        status, said = run_drake(
            capfd, *words, "--lidar", sheet, "--returns", returns
        )
        assert status == 0, said


def scan_of(lidar, builder):
    context = builder.Build().CreateDefaultContext()
    own = lidar.GetMyContextFromRoot(context)
    return lidar.GetOutputPort("scan").Eval(own)


def make_floor():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.RegisterVisualGeometry(
        plant.world_body(),
        RigidTransform([0.0, 0.0, -2.5]),
        Box(200.0, 200.0, 1.0),
        "floor",
        np.full(4, 0.5),
    )
    plant.Finalize()
    return builder, plant, scene_graph


def test_a_lidar_of_a_diagram(tmp_path):
    sheet = write_sheet(tmp_path)
    text = f"{{name: roof, unit: {sheet}}}"
    config = yaml_load_typed(schema=LidarConfig, data=text)
    builder, plant, scene_graph = make_floor()
    lidar = ApplyLidarConfig(
        config, builder, plant, scene_graph, lcm=DrakeLcm("memq://")
    )
    assert lidar.pattern.period == 0.05
    scan = scan_of(lidar, builder)
    assert set(scan["ring"]) == set(range(4, 11))
    assert_seen(scan)
    builder, plant, scene_graph = make_floor()
    world = plant.world_body()
    added = add_lidar(builder, scene_graph, world, RigidTransform(), str(sheet))
    np.testing.assert_array_equal(scan_of(added, builder), scan)
    builder, plant, scene_graph = make_floor()
    both = dataclasses.replace(config, preset="vlp-16")
    with pytest.raises(ValueError, match="roof: unit: give either"):
        ApplyLidarConfig(both, builder, plant, scene_graph)
    write_sheet(tmp_path, ranges=[9, 1])
    with pytest.raises(ValueError, match=rf"roof: unit: {sheet}: ranges: 9"):
        ApplyLidarConfig(config, builder, plant, scene_graph)


@pytest.mark.parametrize(
    ("lidar", "elevations", "columns", "ranges"),
    [
        ({}, np.linspace(22.5, -22.5, 32), 1024, (0.8, 120.0)),
        ({"rings": 48}, np.linspace(22.5, -22.5, 48), 1024, (0.8, 120.0)),
        (
            {"preset": "vlp-16", "columns": 512, "max_range": 30.0},
            np.arange(15.0, -16.0, -2.0),
            512,
            (0.5, 30.0),
        ),
        ({"unit": "unit.yaml"}, ELEVATIONS, 40, (0.5, 60.0)),
        (
            {"unit": "unit.yaml", "rings": 3, "columns": 16, "min_range": 1},
            [4.0, -8.0, -20.0],
            16,
            (1.0, 60.0),
        ),
        ({"unit": SHEET}, ELEVATIONS, 40, (0.5, 60.0)),
    ],
)
def test_single_fields_replace_those_of_the_sheet(
    tmp_path, lidar, elevations, columns, ranges
):
    write_sheet(tmp_path)
    scenario = load_scenario(write_drive(tmp_path, lidar))
    pattern = make_pattern(scenario.lidars["lidar"])
    np.testing.assert_allclose(
        np.degrees(pattern.elevations_rad), elevations, atol=1e-9
    )
    assert pattern.num_columns == columns
    assert (pattern.min_range, pattern.max_range) == ranges


@pytest.mark.parametrize(
    ("lidar", "fault"),
    [
        ({"unit": "unit.yaml", "preset": "cns"}, "unit: give either"),
        ({"unit": "no.yaml"}, "unit: .*no.yaml: No such file"),
        ({"unit": 3}, "unit: 3 is not the file of a data sheet"),
        ({"unit": {**SHEET, "columns": 0}}, "unit: .*columns: "),
        ({"unit": "unit.yaml", "rings": 1}, "rings: "),
        ({"unit": "unit.yaml", "rings": 10**8}, "rings: "),
        ({"preset": "avia", "rings": 3}, ".*rings: only a spinning LiDAR"),
        ({"preset": "avia", "columns": 300}, ".*columns: .*'rosette' has none"),
        ({"unit": "unit.yaml", "min_range": 70}, ".*min_range 70 is not below"),
    ],
)
def test_faults_name_the_drive_and_the_field(tmp_path, lidar, fault):
    write_sheet(tmp_path)
    path = write_drive(tmp_path, lidar)
    with pytest.raises(
        InputError, match=rf"^{path}: lidars.lidar.?:? ?{fault}"
    ):
        load_scenario(path)


def test_a_drive_on_a_base_changes_its_lidar(tmp_path):
    write_sheet(tmp_path)
    write_drive(tmp_path, {"unit": "unit.yaml", "xyz": [0, 0, 2]}, "base")
    child = tmp_path / "child.yaml"
    for text, preset, rings in (
        ("{preset: vlp-16}", "vlp-16", 16),
        ("{columns: 16}", None, 11),
        ("{rings: 5}", None, 5),
        ("{unit: null}", "cns", 32),
    ):
        child.write_text(f"base: base.yaml\nlidars: {{lidar: {text}}}\n")
        lidar = load_scenario(child).lidars["lidar"]
        assert (lidar.preset, make_pattern(lidar).num_rings) == (preset, rings)
        assert lidar.xyz == (0.0, 0.0, 2.0)
    write_drive(tmp_path, {"preset": "vlp-16"}, "base")
    child.write_text("base: base.yaml\nlidars: {lidar: {unit: unit.yaml}}\n")
    lidar = load_scenario(child).lidars["lidar"]
    assert (lidar.preset, lidar.unit.columns) == (None, 40)
    assert load_scenario(child).with_lidar("cns").lidars["lidar"].unit is None


def test_a_changed_sheet_makes_another_drive(tmp_path):
    prints = []
    for changes in ({}, {"columns": 41}, {"returns": {"pulse_ns": 3.0}}, {}):
        write_sheet(tmp_path, **changes)
        path = write_drive(tmp_path, {"unit": "unit.yaml"})
        scenario = load_scenario(path)
        inputs = digest_inputs(scenario)
        prints.append(recording_fingerprint(scenario, inputs))
    assert len(set(prints)) == 3
    assert prints[0] == prints[3]
    # Where the file lies makes no difference.
    (tmp_path / "below").mkdir()
    write_sheet(tmp_path / "below")
    path = write_drive(tmp_path, {"unit": "below/unit.yaml"})
    scenario = load_scenario(path)
    assert recording_fingerprint(scenario, inputs) == prints[0]


def test_returns_follow_the_sheet(tmp_path):
    """A dark wall beyond the stated range gives few returns."""
    scans = {}
    for farthest in (5.0, 60.0):
        rows = [[0.8, farthest, 0.9]]
        write_sheet(tmp_path, returns={"rows": rows})
        lidar = {"unit": "unit.yaml", "returns": "calibrated"}
        path = write_drive(tmp_path, lidar, f"to_{farthest:.0f}")
        run = simulate(load_scenario(path), tmp_path / "out")
        scans[farthest] = open_drive(run.folder).scan(0)
        stated = yaml.safe_load((run.folder / "calibration.yaml").read_text())
        assert stated["lidar"]["source"] == "mine"
        assert stated["lidar"]["elevations_deg"] == ELEVATIONS
    assert 2 * len(scans[5.0]) < len(scans[60.0])


def test_scans_of_a_real_lidar_name_its_sheet(tmp_path):
    """The path starts at the folder of the drive."""
    write_sheet(tmp_path)
    text = "name: a\nlidars: {lidar: {unit: unit.yaml}}\n"
    (tmp_path / "scenario.yaml").write_text(text)
    found = read_scenario(tmp_path)["lidars"]["lidar"]["unit"]
    assert (found["columns"], found["source"]) == (40, "mine")
    write_sheet(tmp_path, ranges="far")
    with pytest.raises(
        InputError, match=r"lidars.lidar: .*unit.yaml: ranges: "
    ):
        read_scenario(tmp_path)
