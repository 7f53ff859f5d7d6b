from cns_drake.transient.changing import change_world as change_world
from cns_drake.transient.ground_surface import GroundSurface as GroundSurface
from cns_drake.transient.scaffolds import scaffold as scaffold
from cns_drake.transient.structure_geometry import PartGeometry as PartGeometry
from cns_drake.transient.structure_geometry import (
    StructureGeometry as StructureGeometry,
)
from cns_drake.transient.structure_geometry import (
    geometry_by_structure as geometry_by_structure,
)
from cns_drake.transient.structure_geometry import (
    triangle_corners as triangle_corners,
)
