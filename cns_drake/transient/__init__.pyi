from .changing import change_world as change_world
from .ground_surface import GroundSurface as GroundSurface
from .scaffolds import scaffold as scaffold
from .structure_geometry import PartGeometry as PartGeometry
from .structure_geometry import StructureGeometry as StructureGeometry
from .structure_geometry import geometry_by_structure as geometry_by_structure
from .structure_geometry import triangle_corners as triangle_corners
