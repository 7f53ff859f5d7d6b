"""Live scans in Meshcat."""

from __future__ import annotations

from pydrake.geometry import Meshcat, MeshcatPointCloudVisualizer, Rgba
from pydrake.systems.framework import DiagramBuilder

from cns_drake.sensors.lidar import Lidar

_COLOR = Rgba(0.9, 0.2, 0.1, 1.0)


def add_lidar_view(
    builder: DiagramBuilder,
    lidar: Lidar,
    meshcat: Meshcat,
    *,
    period: float | None = None,
    color: Rgba = _COLOR,
    point_size: float = 0.05,
) -> MeshcatPointCloudVisualizer:
    """Adds a live view of a LiDAR's scans, at their places in Meshcat.

    Args:
        builder: of the diagram that holds the LiDAR.
        lidar: its points are shown at the path of its system's name.
        meshcat: the view.
        period: time between two shown scans [s]; by default that of a turn.
        color: of the points.
        point_size: their size [m].

    Example:
        from cns_drake import add_lidar_view

        add_lidar_view(builder, lidar, meshcat)
    """
    name = lidar.get_name()
    view = builder.AddNamedSystem(
        f"{name}_view",
        MeshcatPointCloudVisualizer(
            meshcat, name, lidar.pattern.period if period is None else period
        ),
    )
    view.set_default_rgba(color)
    view.set_point_size(point_size)
    builder.Connect(
        lidar.GetOutputPort("point_cloud_W"), view.cloud_input_port()
    )
    return view
