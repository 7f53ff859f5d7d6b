"""Perception geometries of a surface alone."""

from pydrake.geometry import GeometryId
from pydrake.math import RigidTransform

from cns_drake.scene import PerceptionGeometry


def make_geometry(surface, frame_id, X_FG=None):
    return PerceptionGeometry(
        geometry_id=GeometryId.get_new_id(),
        name="model::visual",
        frame_id=frame_id,
        X_FG=RigidTransform() if X_FG is None else X_FG,
        surface=surface,
        rgb=None,
    )
