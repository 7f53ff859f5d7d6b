"""Noise of a LiDAR by Drake's own randomness."""

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import MonteCarloSimulation, Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.sensors import add_lidar

NOISY = [{"range_noise": 0.02}, {"dropout": 0.1}, {"returns": "calibrated"}]


def room(seed=3, **noise):
    """A diagram with a LiDAR in a room, and the LiDAR."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.RegisterVisualGeometry(
        plant.world_body(),
        RigidTransform([0.7, 0.2, 1.0]),
        Box(10, 8, 6),
        "room",
        np.ones(4),
    )
    body = plant.AddRigidBody("sensor")
    plant.WeldFrames(plant.world_frame(), body.body_frame())
    plant.Finalize()
    lidar = add_lidar(
        builder,
        scene_graph,
        body,
        RigidTransform(),
        "vlp-16",
        seed=seed,
        **noise,
    )
    return builder.Build(), lidar


def scan(lidar, context):
    port = lidar.scan_output_port()
    points = port.Eval(lidar.GetMyContextFromRoot(context))
    # Field by field: the padding of copies is undefined.
    return b"".join(points[name].tobytes() for name in points.dtype.names)


@pytest.mark.parametrize("noise", NOISY)
def test_random_contexts_have_other_noise(noise):
    diagram, lidar = room(**noise)
    context = diagram.CreateDefaultContext()
    default = scan(lidar, context)
    drawn = []
    for seed in (1, 2, 1):
        generator = RandomGenerator(seed)
        for _ in range(2):
            diagram.SetRandomContext(context, generator)
            drawn.append(scan(lidar, context))
            assert scan(lidar, context.Clone()) == drawn[-1]
    assert drawn[4:] == drawn[:2]
    assert len({default, *drawn}) == 5
    # The noise of each draw depends on the seed, too.
    diagram.SetRandomContext(context, RandomGenerator(1))
    other, its_lidar = room(seed=4, **noise)
    its_context = other.CreateDefaultContext()
    other.SetRandomContext(its_context, RandomGenerator(1))
    assert scan(its_lidar, its_context) != scan(lidar, context)
    diagram.SetDefaultContext(context)
    assert scan(lidar, context) == default


def test_a_draw_of_zero_is_the_seed_s_noise():
    diagram, lidar = room(range_noise=0.02)
    context = diagram.CreateDefaultContext()
    default = scan(lidar, context)
    port = lidar.GetInputPort("noise_draw")
    mine = lidar.GetMyMutableContextFromRoot(context)
    found = []
    for draw in (0.0, -0.0, 1e-300, 1.0):
        port.FixValue(mine, [draw])
        found.append(scan(lidar, context))
    assert found[0] == found[1] == default
    assert len(set(found)) == 3


def test_samples_of_a_monte_carlo_simulation_differ():
    diagram, lidar = room(range_noise=0.02)
    samples = MonteCarloSimulation(
        make_simulator=lambda generator: Simulator(diagram),
        output=lambda system, context: float(hash(scan(lidar, context))),
        final_time=0.1,
        num_samples=4,
        generator=RandomGenerator(1),
    )
    assert len({one.output for one in samples}) == 4


def test_a_lidar_without_noise_draws_nothing():
    diagram, lidar = room()
    assert not lidar.is_random
    assert not diagram.HasSubsystemNamed("lidar_noise_draw")
    context = diagram.CreateDefaultContext()
    default = scan(lidar, context)
    diagram.SetRandomContext(context, RandomGenerator(1))
    assert scan(lidar, context) == default
