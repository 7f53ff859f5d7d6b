"""Methods of a LiDAR that take a Context: which one, and what they see there.

Oracle: closed forms.
"""

import inspect

from helpers.lidar_stage import FORWARD, Stage
import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform
from pydrake.systems.framework import LeafSystem
import pytest

import cns_drake
from cns_drake.ray_casting import KnownPoses
from cns_drake.sensors import Lidar, add_lidar

AHEAD = np.eye(3)[:1]
METHODS = {
    "CastRays": lambda lidar, context: lidar.CastRays(
        context, lidar.X_PB.translation(), AHEAD
    ).ranges[0],
    "EvalGeometryIds": lambda lidar, context: lidar.EvalGeometryIds(context),
    "EvalInstances": lambda lidar, context: lidar.EvalInstances(context),
    "EvalScene": lambda lidar, context: lidar.EvalScene(context),
}


def site_of_two():
    """Two LiDARs, 9 m and 1.5 m from a wall."""
    stage = Stage()
    stage.add("wall", Box(1.0, 9.0, 9.0), RigidTransform([9.5, 0.0, 0.0]))
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    near = Stage()
    near.add("wall", Box(1.0, 9.0, 9.0), RigidTransform([9.5, 0.0, 0.0]))
    near.first = near.builder.AddNamedSystem(
        "first",
        Lidar(near.scene_graph.world_frame_id(), RigidTransform(), FORWARD),
    )
    near.builder.Connect(
        near.scene_graph.get_query_output_port(),
        near.first.query_object_input_port(),
    )
    near.finish(X_PS=RigidTransform([7.5, 0.0, 0.0]), pattern=FORWARD)
    return stage, near


def test_all_methods_with_a_context_are_tried():
    found = set()
    for name in cns_drake.__all__:
        kind = getattr(cns_drake, name)
        if isinstance(kind, type) and issubclass(kind, LeafSystem):
            found |= {
                method
                for method, function in vars(kind).items()
                if inspect.isfunction(function)
                and not method.startswith("_")
                and "context" in inspect.signature(function).parameters
            }
    assert found == set(METHODS)


@pytest.mark.parametrize("method", METHODS)
def test_only_the_context_of_the_lidar_is_taken(method):
    other, stage = site_of_two()
    call = METHODS[method]
    root = stage.context
    for wrong in (
        root,
        stage.scene_graph.GetMyContextFromRoot(root),
        stage.first.GetMyContextFromRoot(root),
        other.lidar.GetMyContextFromRoot(other.context),
    ):
        for _ in range(2):
            with pytest.raises(RuntimeError, match=r"^context: .* 'lidar'; "):
                call(stage.lidar, wrong)
    for wrong in (None, stage.lidar):
        with pytest.raises(TypeError):
            call(stage.lidar, wrong)
    for context in (root, root.Clone()):
        call(stage.lidar, stage.lidar.GetMyContextFromRoot(context))
    of = stage.first.GetMyContextFromRoot(root)
    if method == "CastRays":
        assert call(stage.first, of) == pytest.approx(9.0, abs=1e-5)


class Posed:
    """Balls on moving frames in a ring, whose poses come from an array."""

    def __init__(self, distances, **options):
        self.stage = Stage()
        turns = 2.0 * np.pi * np.arange(len(distances)) / len(distances)
        places = np.stack(
            [
                distances * np.cos(turns),
                distances * np.sin(turns),
                np.zeros(len(turns)),
            ],
            axis=1,
        )
        self.frames = [
            self.stage.add_frame(f"f{k}", k, RigidTransform())
            for k in range(len(places))
        ]
        for frame in self.frames:
            self.stage.add("ball", Sphere(1.0), frame=frame)
        graph = self.stage.scene_graph
        self.lidar = add_lidar(
            self.stage.builder,
            graph,
            graph.world_frame_id(),
            RigidTransform(),
            FORWARD,
            name="posed",
            **options,
        )
        self.stage.finish(pattern=FORWARD)
        self.own = self.lidar.GetMyContextFromRoot(self.stage.context)
        self.set(places)

    def set(self, places):
        self.places = places
        rows = {frame: k for k, frame in enumerate(self.frames)}
        world = self.stage.scene_graph.world_frame_id()
        X_WFs = np.tile(np.eye(4), (len(places) + 1, 1, 1))
        X_WFs[:-1, :3, 3] = places
        rows[world] = len(places)
        self.lidar.GetInputPort("frame_poses").FixValue(
            self.own, Value(KnownPoses(rows, X_WFs))
        )

    def down(self, scene=None):
        """The ranges of rays from 30 m above each ball."""
        p_WR = np.add(self.places, [0.0, 0.0, 30.0])
        d_W = np.tile([0.0, 0.0, -1.0], (len(p_WR), 1))
        if scene is None:
            return self.lidar.CastRays(self.own, p_WR, d_W).ranges
        return scene.cast_rays(p_WR, d_W, np.inf).ranges


def test_rays_see_what_scans_may_leave_out():
    """Far beyond the beams' reach, and after motion; scans stay the same."""
    distances = np.geomspace(5.0, 900.0, 24)
    posed = Posed(distances)
    assert (distances > FORWARD.max_range + 2.0).sum() > 8
    scan = posed.lidar.GetOutputPort("scan").Eval(posed.own)
    assert len(scan) == 3
    np.testing.assert_allclose(posed.down(), 29.0, atol=1e-4)
    again = posed.lidar.GetOutputPort("scan").Eval(posed.own)
    np.testing.assert_array_equal(scan, again)
    posed.set(np.add(posed.places[::-1], [0.0, 0.0, 2.0]))
    np.testing.assert_allclose(posed.down(), 29.0, atol=1e-4)
    # What comes near is scanned, and a scan between does not hide the rest.
    posed.set(np.roll(posed.places, 5, axis=0) - [0.0, 0.0, 2.0])
    posed.lidar.GetOutputPort("scan").Eval(posed.own)
    np.testing.assert_allclose(posed.down(), 29.0, atol=1e-4)


def test_a_scene_for_rays_is_complete():
    posed = Posed(np.linspace(20.0, 400.0, 9))
    posed.lidar.GetOutputPort("scan").Eval(posed.own)
    scene = posed.lidar.EvalScene(posed.own)
    np.testing.assert_allclose(posed.down(scene), 29.0, atol=1e-4)
