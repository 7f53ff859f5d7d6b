from .drake_ports import optional_value as optional_value
from .drake_releases import find_bus as find_bus
from .drake_releases import (
    reads_vertex_colours_as_srgb as reads_vertex_colours_as_srgb,
)
from .file_references import referenced_files as referenced_files
from .file_watch import FileWatch as FileWatch
from .labels import MAX_INSTANCE as MAX_INSTANCE
from .labels import Labels as Labels
from .labels import number_structures as number_structures
from .map_folder import IMPORT_NAME as IMPORT_NAME
from .map_folder import MESH_FOLDER as MESH_FOLDER
from .map_folder import ROADS_NAME as ROADS_NAME
from .map_folder import STAGES_NAME as STAGES_NAME
from .map_folder import STRUCTURES_NAME as STRUCTURES_NAME
from .map_folder import TRAFFIC_NAME as TRAFFIC_NAME
from .map_folder import MapFolder as MapFolder
from .map_folder import check_new_map as check_new_map
from .map_folder import drive_name as drive_name
from .map_folder import no_drives as no_drives
from .map_folder import stage_name as stage_name
from .map_reference import LocalMetres as LocalMetres
from .map_reference import metres_on_map as metres_on_map
from .materials import MATERIALS as MATERIALS
from .materials import USUAL_MATERIALS as USUAL_MATERIALS
from .materials import Material as Material
from .perception_geometry import GREY as GREY
from .perception_geometry import GeometryList as GeometryList
from .perception_geometry import PerceptionGeometry as PerceptionGeometry
from .perception_geometry import anchored_frames as anchored_frames
from .perception_geometry import geometry_port as geometry_port
from .perception_geometry import list_geometry as list_geometry
from .perception_geometry import merge_surfaces as merge_surfaces
from .perception_geometry import read_geometry as read_geometry
from .perception_geometry import (
    read_perception_geometry as read_perception_geometry,
)
from .sdf_worlds import InSight as InSight
from .semantics import CLASS_IDS as CLASS_IDS
from .semantics import CLASS_RGB as CLASS_RGB
from .semantics import GROUND_CLASSES as GROUND_CLASSES
from .semantics import MOVING_IDS as MOVING_IDS
from .semantics import moving_id as moving_id
from .structure_names import kind_in_name as kind_in_name
from .structure_names import structure_name as structure_name
from .structure_table import StructureEntry as StructureEntry
from .structure_table import StructureTable as StructureTable
from .structure_table import load_structure_table as load_structure_table
from .structure_table import material_word as material_word
from .structure_table import read_materials as read_materials
from .structure_table import shortened as shortened
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
