"""Labels of two maps by rays: walls, screens, leaves, glass, another caster."""

from helpers.small_map import box_visual, world_text
from helpers.tiny_drive import tiny_scenario
import numpy as np
import pytest

from cns_drake.ground_truth import write_truth
from cns_drake.ground_truth.exact_labels import NEAR
from cns_drake.ground_truth.labelled import LabelledDrive
from cns_drake.sensors import BeamCoverage
from cns_drake.simulation import SimulatedDrive
from evaluation.map_update import Label, read_pair, read_truth

GROUND = box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (200, 200, 1))
# Its front is 10 m to the left of the drive.
WALL = box_visual("wall/body", (0, 15.5, 3, 0, 0, 0), (30, 1, 6))
HOUSE = box_visual("house/body", (-6, 30, 2, 0, 0, 0), (8, 1, 4))
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
