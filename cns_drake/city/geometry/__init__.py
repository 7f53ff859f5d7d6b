"""Meshes, polygons, and structures made of meshes."""

from cns_drake.city.geometry.mesh import Mesh as Mesh
from cns_drake.city.geometry.mesh import merge_meshes as merge_meshes
from cns_drake.city.geometry.mesh import read_mesh as read_mesh
from cns_drake.city.geometry.models import BoxShape as BoxShape
from cns_drake.city.geometry.models import CylinderShape as CylinderShape
from cns_drake.city.geometry.models import Finish as Finish
from cns_drake.city.geometry.models import MeshShape as MeshShape
from cns_drake.city.geometry.models import Model as Model
from cns_drake.city.geometry.models import Part as Part
from cns_drake.city.geometry.models import Shape as Shape
from cns_drake.city.geometry.models import SphereShape as SphereShape
from cns_drake.city.geometry.models import part_mesh as part_mesh
from cns_drake.city.geometry.models import triple as triple
from cns_drake.city.geometry.object_models import Builder as Builder
from cns_drake.city.geometry.object_models import assemble as assemble
from cns_drake.city.geometry.object_models import bar as bar
from cns_drake.city.geometry.object_models import block as block
from cns_drake.city.geometry.object_models import in_a_row as in_a_row
from cns_drake.city.geometry.object_models import mesh_part as mesh_part
from cns_drake.city.geometry.object_models import object_mesh as object_mesh
from cns_drake.city.geometry.object_models import pillar as pillar
from cns_drake.city.geometry.object_models import post as post
from cns_drake.city.geometry.occupancy import Occupancy as Occupancy
from cns_drake.city.geometry.polygon_meshes import HeightMap as HeightMap
from cns_drake.city.geometry.polygon_meshes import surface_mesh as surface_mesh
from cns_drake.city.geometry.polygon_meshes import wall_mesh as wall_mesh
from cns_drake.city.geometry.polygons import placed as placed
from cns_drake.city.geometry.polygons import polygons_of as polygons_of
from cns_drake.city.geometry.polygons import snap as snap
from cns_drake.city.geometry.polygons import tiles as tiles
from cns_drake.city.geometry.structures import Structure as Structure
from cns_drake.city.geometry.structures import (
    ground_triangles as ground_triangles,
)
from cns_drake.city.geometry.upper_sides import UpperSides as UpperSides
