"""What stands still is built once for all LiDARs and Contexts."""

from helpers.lidar_stage import FORWARD, Stage, ahead
import numpy as np
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.ray_casting.embree_scene import EmbreeScene
from cns_drake.sensors import add_lidar


def stills(lidar, root):
    """The address of what Embree has of the geometry that never moves."""
    scene = lidar.EvalScene(lidar.GetMyContextFromRoot(root))._scene
    return scene._targets.fixed


def test_lidars_and_contexts_share_what_stands_still():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    source, world = plant.get_source_id(), plant.world_body()
    for x, shape in ((8.0, Box(0.2, 20.0, 6.0)), (5.0, Sphere(1.0))):
        ball = plant.RegisterVisualGeometry(
            world, RigidTransform([x, 0, 1]), shape, f"at {x}", np.full(4, 0.5)
        )
    plant.Finalize()
    lidars = [
        add_lidar(
            builder,
            scene_graph,
            world,
            RigidTransform([0.0, y, 1.0]),
            "vlp-16",
            name=f"lidar_{y}",
        )
        for y in (0, 4)
    ]
    diagram = builder.Build()
    roots = [diagram.CreateDefaultContext() for _ in range(2)]
    roots.append(roots[0].Clone())
    ports = [lidar.GetOutputPort("scan") for lidar in lidars]
    found = [
        [
            port.Eval(lidar.GetMyContextFromRoot(root))
            for lidar, port in zip(lidars, ports, strict=True)
        ]
        for root in roots
    ]
    for other in found[1:]:
        np.testing.assert_array_equal(found[0][0], other[0])
        np.testing.assert_array_equal(found[0][1], other[1])
    shared = stills(lidars[0], roots[0])
    assert all(shared == stills(a, b) for a in lidars for b in roots)
    # A change in one Context is that of this Context.
    scene_graph.RemoveGeometry(
        scene_graph.GetMyMutableContextFromRoot(roots[1]), source, ball
    )
    gone = ports[0].Eval(lidars[0].GetMyContextFromRoot(roots[1]))
    still = ports[0].Eval(lidars[0].GetMyContextFromRoot(roots[0]))
    np.testing.assert_array_equal(still, found[0][0])
    assert still["x"].min() < 4.1 < 7.8 < gone["x"].min()
    assert shared != stills(lidars[0], roots[1])


def test_what_did_not_change_is_not_built_anew(monkeypatch):
    """One of many crates changes; the hierarchies of the others stay."""
    stage = Stage()
    frames = [
        stage.add_frame(f"f{k}", k, RigidTransform([10.0, 3.0 * k, 0.0]))
        for k in range(5)
    ]
    crates = [
        stage.add(f"c{k}", Box(2, 2, 2), frame=f) for k, f in enumerate(frames)
    ]
    stage.add("wall", Box(1.0, 90.0, 9.0), RigidTransform([20.5, 0, 0]))
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    stage.eval()
    built = []
    build = EmbreeScene._build_scene
    monkeypatch.setattr(
        EmbreeScene,
        "_build_scene",
        lambda self, proxies: built.append(proxies) or build(self, proxies),
    )
    context = stage.scene_graph.GetMyMutableContextFromRoot(stage.context)
    stage.scene_graph.ChangeShape(
        context, stage.source, crates[0], Box(4, 2, 2)
    )
    assert ahead(stage.eval()) == pytest.approx(8.0, abs=1e-5)
    assert [len(proxies.records) for proxies in built] == [12]
