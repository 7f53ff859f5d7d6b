from .drake_ports import optional_value as optional_value
from .drake_releases import find_bus as find_bus
from .drake_releases import (
    reads_vertex_colours_as_srgb as reads_vertex_colours_as_srgb,
)
from .event_times import nearest_ns as nearest_ns
from .event_times import shortly_before as shortly_before
from .event_times import starts_late as starts_late
from .file_references import referenced_files as referenced_files
from .file_watch import FileWatch as FileWatch
from .labels import number_structures as number_structures
from .perception_geometry import GREY as GREY
from .perception_geometry import GeometryList as GeometryList
from .perception_geometry import PerceptionGeometry as PerceptionGeometry
from .perception_geometry import anchored_frames as anchored_frames
from .perception_geometry import geometry_port as geometry_port
from .perception_geometry import list_geometry as list_geometry
from .perception_geometry import listed_geometry as listed_geometry
from .perception_geometry import merge_surfaces as merge_surfaces
from .perception_geometry import read_geometry as read_geometry
from .perception_geometry import (
    read_perception_geometry as read_perception_geometry,
)
from .sdf_worlds import InSight as InSight
from .structure_geometry import ScenePart as ScenePart
from .structure_geometry import SceneStructure as SceneStructure
from .structure_geometry import geometry_by_structure as geometry_by_structure
from .structure_names import structure_name as structure_name
from .surfaces import LARGEST_SIZE as LARGEST_SIZE
from .surfaces import MOST_COPIED_TRIANGLES as MOST_COPIED_TRIANGLES
from .surfaces import CapsuleSurface as CapsuleSurface
from .surfaces import CylinderSurface as CylinderSurface
from .surfaces import EllipsoidSurface as EllipsoidSurface
from .surfaces import HalfSpaceSurface as HalfSpaceSurface
from .surfaces import Surface as Surface
from .surfaces import TriangleSurface as TriangleSurface
from .surfaces import is_closed as is_closed
from .surfaces import merge_triangles as merge_triangles
from .surfaces import tessellate as tessellate
from .world import World as World
from .world import load_world as load_world
from .world import structures_in as structures_in
