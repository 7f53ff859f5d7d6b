"""Times of a new process up to its first scan, and of the next one.

    python tests/benchmarks/first_scan.py

1,000 boxes, spheres and cylinders are scanned by 128 x 1024 beams. Times are
those of the processor.
"""

from time import process_time

start = process_time()
from cns_drake import add_lidar  # noqa: E402

imported = process_time()
import numpy as np  # noqa: E402
from pydrake.geometry import Box, Cylinder, Sphere  # noqa: E402
from pydrake.math import RigidTransform  # noqa: E402
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph  # noqa: E402
from pydrake.systems.framework import DiagramBuilder  # noqa: E402

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
rng, grey = np.random.default_rng(1), np.full(4, 0.5)
world = plant.world_body()
for k in range(1000):
    shape = (Box(1, 2, 1), Sphere(0.5), Cylinder(0.4, 2.0))[k % 3]
    X_WG = RigidTransform([*rng.uniform(-200.0, 200.0, 2), 1.0])
    plant.RegisterVisualGeometry(world, X_WG, shape, f"shape_{k}", grey)
plant.Finalize()
X_WS = RigidTransform([0.0, 0.0, 1.8])
lidar = add_lidar(
    builder, scene_graph, world, X_WS, "os1-128", range_noise=1e-3
)
root = builder.Build().CreateDefaultContext()
context = lidar.GetMyContextFromRoot(root)
times = []
for turn in range(2):
    root.SetTime(0.05 * turn)
    begin = process_time()
    lidar.GetOutputPort("scan").Eval(context)
    times.append(process_time() - begin)
print(
    f"import {imported - start:.2f} s, first scan {times[0]:.2f} s, next one "
    f"{1e3 * times[1]:.0f} ms"
)
