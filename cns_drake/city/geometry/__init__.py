"""Meshes, polygons, and structures made of meshes."""

from cns_drake.city.geometry.mesh import Mesh, merge_meshes, read_mesh
from cns_drake.city.geometry.models import (
    BoxShape,
    CylinderShape,
    Finish,
    MeshShape,
    Model,
    Part,
    Shape,
    SphereShape,
    part_mesh,
    triple,
)
from cns_drake.city.geometry.object_models import (
    OBJECT_MESHES,
    Builder,
    assemble,
    bar,
    block,
    in_a_row,
    mesh_part,
    object_mesh,
    pillar,
    post,
)
from cns_drake.city.geometry.occupancy import Occupancy
from cns_drake.city.geometry.polygon_meshes import (
    HeightMap,
    surface_mesh,
    wall_mesh,
)
from cns_drake.city.geometry.polygons import (
    hull_of,
    placed,
    polygons_of,
    snap,
    tiles,
)
from cns_drake.city.geometry.structures import Structure, ground_triangles
from cns_drake.city.geometry.triangles import (
    from_above,
    long_normals,
    looks_up,
    quartered,
    turned_up,
    unit_normals,
)
from cns_drake.city.geometry.triangulation import triangulate
from cns_drake.city.geometry.upper_sides import UpperSides

__all__ = [
    "OBJECT_MESHES",
    "BoxShape",
    "Builder",
    "CylinderShape",
    "Finish",
    "HeightMap",
    "Mesh",
    "MeshShape",
    "Model",
    "Occupancy",
    "Part",
    "Shape",
    "SphereShape",
    "Structure",
    "UpperSides",
    "assemble",
    "bar",
    "block",
    "from_above",
    "ground_triangles",
    "hull_of",
    "in_a_row",
    "long_normals",
    "looks_up",
    "merge_meshes",
    "mesh_part",
    "object_mesh",
    "part_mesh",
    "pillar",
    "placed",
    "polygons_of",
    "post",
    "quartered",
    "read_mesh",
    "snap",
    "surface_mesh",
    "tiles",
    "triangulate",
    "triple",
    "turned_up",
    "unit_normals",
    "wall_mesh",
]
