"""Labels of two maps by rays: walls, screens, leaves, glass, another caster."""

import json
import shutil

from helpers.internal import eval_program
from helpers.internal.eval_program import run_program
from helpers.small_map import box_visual, scenario_values, world_text
from helpers.tiny_drive import tiny_scenario
import numpy as np
import pytest
import yaml

from cns_drake.__main__ import main
from cns_drake.base import InputError, Reporter
from cns_drake.scenarios import make_scenario
from cns_drake.sensors import BeamCoverage
from cns_drake.simulation import SimulatedDrive, SimulationSource
from cns_drake.studies import open_labelled, write_truth
from cns_drake.studies.ground_truth.exact_labels import NEAR, is_there
from cns_drake.studies.ground_truth.labelled_drive import (
    LabelledDrive,
    simulate_labelled,
)
from cns_drake.studies.tasks.map_task import TRUTH, measure_maps
from evaluation.map_update import Label, read_pair, read_truth, score

GROUND = box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (200, 200, 1))
# Its front is 10 m to the left of the drive.
WALL = box_visual("wall/body", (0, 15.5, 3, 0, 0, 0), (30, 1, 6))
HOUSE = box_visual("house/body", (-6, 30, 2, 0, 0, 0), (8, 1, 4))
HALL = box_visual("hall/body", (25, -5, 3, 0, 0, 0), (8, 6, 6))
# It hides the house from all of the drive.
SCREEN = box_visual("screen/body", (-6, 14, 5, 0, 0, 0), (40, 0.2, 12))


def wall_at(offset):
    """The wall, farther from the drive by an offset [m]."""
    return box_visual("wall/body", (0, 15.5 + offset, 3, 0, 0, 0), (30, 1, 6))


def labelled_drive(folder, visuals, frames=40, **lidar):
    """The drive of `tiny_scenario` in a world of these visuals, simulated."""
    folder.mkdir(parents=True)
    world = folder / "world.sdf"
    world.write_text(world_text(visuals))
    config = {"preset": "vlp-16", "columns": 720} | lidar
    scenario = tiny_scenario(
        folder,
        world=str(world),
        name=folder.name,
        lidars={"lidar": config},
        frames=frames,
    )
    simulated = SimulatedDrive(scenario)
    return LabelledDrive(simulated, simulated, scenario)


def label(tmp_path, before, after, **options):
    """Returns the pair of two worlds, and the true labels of both maps."""
    labelled = [
        labelled_drive(tmp_path / name, visuals, **options)
        for name, visuals in (("before", before), ("after", after))
    ]
    output = tmp_path / "truth"
    write_truth(*labelled, output)
    pair = read_pair(output)
    return pair, read_truth(pair)


def on(session, name):
    """Whether each point lies on a structure, by its height and place."""
    x, y, z = session.points.T
    return {
        "ground": z < 0.05,
        "wall": (y > 14.5) & (y < 17.0) & (z > 0.05) & (np.abs(x) < 15.5),
        "house": (y > 29.0) & (z > 0.05),
    }[name]


@pytest.mark.parametrize(
    ("offset", "changes"),
    [(0.05, False), (-0.05, False), (0.15, True), (-0.15, True)],
)
def test_a_wall_that_moves_is_gone_and_new_beyond_the_tolerance(
    tmp_path, offset, changes
):
    pair, truth = label(
        tmp_path, [GROUND, WALL], [GROUND, wall_at(offset)], frames=20
    )
    for session, labels, changed in zip(
        pair, truth, (Label.GONE, Label.NEW), strict=True
    ):
        # At its ends, foot and top, other surfaces are within the tolerance.
        inner = on(session, "wall") & (np.abs(session.points[:, 0]) < 14.5)
        inner &= (session.points[:, 2] > 0.2) & (session.points[:, 2] < 5.8)
        assert inner.sum() > 1000
        assert (labels[inner] == (changed if changes else Label.KEPT)).all()


def test_a_wall_that_moves_far_hides_its_old_place(tmp_path):
    pair, truth = label(
        tmp_path, [GROUND, WALL], [GROUND, wall_at(-0.4)], frames=20
    )
    inner = on(pair.A, "wall") & (np.abs(pair.A.points[:, 0]) < 14.0)
    inner &= pair.A.points[:, 2] > 0.2
    assert (truth.A[inner] == Label.UNOBSERVED).all()


def test_swapped_drives_swap_gone_and_new(tmp_path):
    worlds = [GROUND, WALL, HALL], [GROUND, SCREEN]
    _, one = label(tmp_path / "one", *worlds)
    _, other = label(tmp_path / "other", *worlds[::-1])
    swap = np.zeros(5, np.uint8)
    swap[[0, 1, 2, 3, 4]] = [4, 1, 3, 2, 0]
    np.testing.assert_array_equal(swap[one.A], other.B)
    np.testing.assert_array_equal(swap[one.B], other.A)
    assert {0, 1, 2} == set(one.A)
    assert {1, 3} <= set(one.B)


def test_a_stage_against_itself_has_no_changes(tmp_path):
    pair, truth = label(tmp_path, [GROUND, WALL], [GROUND, WALL])
    for labels in truth:
        assert (labels == Label.KEPT).all()
    assert score(pair, truth, truth, {})["miou"] == 1.0


def test_a_house_behind_a_screen_is_unobserved(tmp_path):
    pair, truth = label(tmp_path, [GROUND, HOUSE], [GROUND, HOUSE, SCREEN])
    house = on(pair.A, "house")
    assert house.sum() > 100
    assert (truth.A[house] == Label.UNOBSERVED).all()
    pair, truth = label(
        tmp_path / "swapped", [GROUND, HOUSE, SCREEN], [GROUND, HOUSE]
    )
    assert (truth.B[on(pair.B, "house")] == Label.NEWLY_SEEN).all()


def test_leaves_hide_as_much_as_their_geometry(tmp_path):
    """Slats half as wide as their distance hide half of what is behind."""
    slats = [
        box_visual(f"slat_{k}/body", (-30 + 0.53 * k, 10, 3, 0, 0, 0), s)
        for k, s in enumerate([(0.265, 0.01, 8)] * 80)
    ]
    pair, truth = label(
        tmp_path, [GROUND, WALL], [GROUND, WALL, *slats], frames=1, columns=2880
    )
    x, _, z = pair.A.points.T
    wall = on(pair.A, "wall") & (x > -14) & (x < -6) & (z > 0.2)
    share = np.mean(truth.A[wall] == Label.UNOBSERVED)
    # A map point stands for a cell of 0.1 m, a slat's shadow is 0.53 m wide.
    assert share == pytest.approx(0.5, abs=0.05)
    assert not (truth.A[wall] == Label.GONE).any()


def test_glass_is_a_surface(tmp_path):
    glass = SCREEN.replace(
        "</geometry>",
        "</geometry><transparency>0.9</transparency>"
        "<material><diffuse>0.5 0.6 0.7 0.1</diffuse></material>",
    )
    pair, truth = label(tmp_path, [GROUND, HOUSE], [GROUND, HOUSE, glass])
    house = on(pair.A, "house")
    assert (truth.A[house] == Label.UNOBSERVED).all()


def test_labels_are_those_of_another_caster_but_at_edges(tmp_path):
    import open3d

    boxes = {
        "before": [(0, 15.5, 3, 30, 1, 6), (12, -4, 1.5, 3, 3, 3)],
        "after": [(0, 15.65, 3, 30, 1, 6), (-6, 12, 2, 4, 0.5, 4)],
    }
    visuals = {
        name: [
            GROUND,
            *(
                box_visual(f"b{k}/body", (*box[:3], 0, 0, 0), box[3:])
                for k, box in enumerate(found)
            ),
        ]
        for name, found in boxes.items()
    }
    pair, truth = label(tmp_path, visuals["before"], visuals["after"])
    other = labelled_drive(tmp_path / "again", visuals["after"])
    scene = open3d.t.geometry.RaycastingScene()
    for x, y, z, *size in [*boxes["after"], (0, 0, -0.5, 200, 200, 1)]:
        mesh = open3d.geometry.TriangleMesh.create_box(*size)
        mesh.translate(np.array([x, y, z]) - 0.5 * np.array(size))
        scene.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(mesh))
    points = pair.A.points.astype(np.float32)
    there = scene.compute_distance(points).numpy() <= NEAR
    seen = np.zeros(len(points), bool)
    coverage = BeamCoverage(other.simulated.pattern.beams(0).d_Sset)
    for X_WS in pair.B.X_WS:
        offsets = pair.A.points - X_WS[:3, 3]
        away = np.linalg.norm(offsets, axis=1)
        lines = np.hstack(
            [np.tile(X_WS[:3, 3], (len(points), 1)), offsets / away[:, None]]
        )
        hits = scene.cast_rays(open3d.core.Tensor(lines.astype(np.float32)))
        before = away - hits["t_hit"].numpy()
        cosines = (hits["primitive_normals"].numpy() * lines[:, 3:]).sum(axis=1)
        with np.errstate(invalid="ignore"):
            across = before * np.abs(cosines)
            free = (before <= NEAR) | ((before <= 1.0) & (across <= 0.3))
        seen |= free & coverage.covers(lines[:, 3:] @ X_WS[:3, :3])
    expected = np.where(seen, np.where(there, 1, 2), 0)
    differs = np.mean(expected != truth.A)
    print(f"another caster: {differs:.2%} of {len(points)} labels differ")
    assert differs < 0.005
    assert set(expected) == {0, 1, 2}


@pytest.mark.slow
def test_recordings_are_labelled_and_scored(short_recording, tmp_path, capsys):
    output = tmp_path / "pair"
    command = ("export", *2 * [short_recording], "--format", "map-truth")
    status, out, err = run_program(
        capsys, "cns-drake", main, *command, "--output", output
    )
    assert (status, out) == (0, f"{output}\n"), err
    names = {path.name for path in (output / "A").iterdir()}
    assert names == {
        "Scans",
        "map.ply",
        "poses.txt",
        "singlesession_posegraph.g2o",
        "truth.npy",
    }
    assert "new" in (output / "index.html").read_text()
    labels = [f"--labels-{s}={output / s.upper() / 'truth.npy'}" for s in "ab"]
    status, out, err = eval_program.run(
        capsys, "map-update", output, *labels, "--json"
    )
    assert status == 0, err
    found = json.loads(out)
    assert found["miou"] == found["iou_kept"] == 1.0
    assert found["iou_gone"] is None
    session = read_pair(output).A
    assert (session.instances > 0).all()
    assert (np.load(output / "A" / "truth.npy") == Label.KEPT).all()
    status, _, err = run_program(
        capsys, "cns-drake", main, *command, "--output", output
    )
    assert status == 2
    assert "exists already" in err


@pytest.mark.slow
def test_an_aged_city_has_another_name(small_map, tmp_path):
    aged = shutil.copytree(small_map, tmp_path / "small_s1")
    drives = []
    for name, folder, stage in (
        ("today", small_map, "01"),
        ("later", aged, "04"),
    ):
        values = scenario_values(folder) | {"stage": stage, "frames": 20}
        values |= {"name": name, "lidars": {"lidar": {"columns": 90}}}
        drives.append(SimulationSource(make_scenario(values, name)))
    scores = measure_maps(Reporter(), *drives, (TRUTH,), 1.0)
    assert scores[TRUTH].scores["miou"] == 1.0
    labelled = [simulate_labelled(drive.scenario) for drive in drives]
    with pytest.raises(InputError, match="through small_s1"):
        write_truth(*labelled, tmp_path / "out")


@pytest.mark.slow
def test_two_worlds_and_changed_worlds_are_refused(
    short_recording, tmp_path, small_map
):
    other = labelled_drive(tmp_path / "elsewhere", [GROUND])
    with pytest.raises(InputError, match="elsewhere"):
        write_truth(open_labelled(short_recording), other, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    table = small_map / "structures.csv"
    text = table.read_text()
    try:
        table.write_text(text.replace("tower_000", "tower_900"))
        with pytest.raises(InputError, match="has changed since"):
            open_labelled(short_recording)
    finally:
        table.write_text(text)


def test_small_parts_are_there(tmp_path):
    """Poles of 2 cm, passed in any direction."""
    poles = [
        box_visual(
            f"p{k}/body", (3.0 * k, 5, 3, 0, 0, 0.3 * k), (0.02, 0.02, 6)
        )
        for k in range(9)
    ]
    scene = labelled_drive(tmp_path / "w", [GROUND, *poles]).still()
    rng = np.random.default_rng(8)
    k = rng.integers(0, 9, 4000)
    # In the axes of a pole.
    x, y = rng.uniform(-0.15, 0.15, (2, 4000))
    c, s = np.cos(0.3 * k), np.sin(0.3 * k)
    z = rng.uniform(1.0, 5.0, 4000)
    points = np.column_stack([3.0 * k + c * x - s * y, 5.0 + s * x + c * y, z])
    beside = np.maximum(np.abs([x, y]) - 0.01, 0.0)
    distance = np.hypot(*beside)
    found = is_there(points, scene)
    assert found[distance < 0.09].mean() > 0.99
    assert not found[distance > 1.25 * NEAR].any()


def test_files_beside_a_recording_may_be_those_of_another(
    short_recording, tmp_path
):
    folder = tmp_path / "town" / short_recording.name
    shutil.copytree(short_recording, folder)
    file = folder / "scenario.yaml"
    values = yaml.safe_load(file.read_text())
    # The folder has moved, not the map.
    values["map"] = str((short_recording / values["map"]).resolve())
    file.write_text(yaml.safe_dump(values))
    open_labelled(folder)
    (lidar,) = values["lidars"]
    for change, field in (
        ({"seed": 77}, "seed"),
        ({"lidars": {lidar: {"preset": "vlp-16"}}}, "lidars"),
        ({"without": ["tower_000"]}, "without"),
    ):
        file.write_text(yaml.safe_dump(values | change))
        with pytest.raises(InputError, match=f"{field}: .* of another drive"):
            open_labelled(folder)
