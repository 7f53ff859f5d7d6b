"""Round parts of small things as triangles."""

import numpy as np
import pytest
from shapely.geometry import Point

from cns_drake.city import BoxShape, CylinderShape, Model, Part, SphereShape
from cns_drake.imports.dressing.street_room import without_curves


def volume(mesh, scale):
    corners = (mesh.vertices * scale)[mesh.triangles()]
    return np.linalg.det(corners).sum() / 6.0


def test_volumes_are_those_of_cylinder_and_nearly_of_sphere():
    """Closed surfaces that look outwards have positive volumes."""
    parts = (
        Part("mast", CylinderShape(0.1, 4.0), xyz=(1.0, 2.0, 2.0)),
        Part("sign", CylinderShape(0.3, 0.02), rpy=(0.0, 1.57, 0.0)),
        Part("ball", SphereShape(0.3), rpy=(0.1, 0.2, 0.3)),
        Part("foot", BoxShape((1.0, 2.0, 3.0)), rgb=(1.0, 0.0, 0.0)),
    )
    model = Model(parts, {}, Point(0.0, 0.0).buffer(1.0))
    mast, sign, ball, foot = (changed := without_curves(model)).parts
    assert foot is parts[3]
    assert (mast.name, mast.xyz) == ("mast", (1.0, 2.0, 2.0))
    assert ball.rpy == (0.1, 0.2, 0.3)
    solid = {
        part.name: volume(changed.meshes[part.shape.mesh], part.shape.scale)
        for part in (mast, sign, ball)
    }
    assert solid["sign"] == pytest.approx(np.pi * 0.3**2 * 0.02)
    assert solid["mast"] == pytest.approx(np.pi * 0.1**2 * 4.0)
    assert solid["ball"] == pytest.approx(4.0 / 3.0 * np.pi * 0.3**3, rel=0.15)
