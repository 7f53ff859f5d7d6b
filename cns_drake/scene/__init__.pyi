from cns_drake.scene.drake_ports import optional_value as optional_value
from cns_drake.scene.drake_releases import find_bus as find_bus
from cns_drake.scene.drake_releases import (
    reads_vertex_colours_as_srgb as reads_vertex_colours_as_srgb,
)
from cns_drake.scene.file_references import referenced_files as referenced_files
from cns_drake.scene.file_watch import FileWatch as FileWatch
from cns_drake.scene.foreign_meshes import ForeignMeshes as ForeignMeshes
from cns_drake.scene.labels import MAX_INSTANCE as MAX_INSTANCE
from cns_drake.scene.labels import Labels as Labels
from cns_drake.scene.labels import number_structures as number_structures
from cns_drake.scene.map_folder import IMPORT_NAME as IMPORT_NAME
from cns_drake.scene.map_folder import MESH_FOLDER as MESH_FOLDER
from cns_drake.scene.map_folder import ROADS_NAME as ROADS_NAME
from cns_drake.scene.map_folder import STAGES_NAME as STAGES_NAME
from cns_drake.scene.map_folder import STRUCTURES_NAME as STRUCTURES_NAME
from cns_drake.scene.map_folder import TRAFFIC_NAME as TRAFFIC_NAME
from cns_drake.scene.map_folder import MapFolder as MapFolder
from cns_drake.scene.map_folder import check_new_map as check_new_map
from cns_drake.scene.map_folder import drive_name as drive_name
from cns_drake.scene.map_folder import no_drives as no_drives
from cns_drake.scene.map_folder import stage_name as stage_name
from cns_drake.scene.map_reference import LocalMetres as LocalMetres
from cns_drake.scene.map_reference import metres_on_map as metres_on_map
from cns_drake.scene.materials import MATERIALS as MATERIALS
from cns_drake.scene.materials import USUAL_MATERIALS as USUAL_MATERIALS
from cns_drake.scene.materials import Material as Material
from cns_drake.scene.mesh_files import MeshFiles as MeshFiles
from cns_drake.scene.perception_geometry import GREY as GREY
from cns_drake.scene.perception_geometry import GeometryList as GeometryList
from cns_drake.scene.perception_geometry import (
    PerceptionGeometry as PerceptionGeometry,
)
from cns_drake.scene.perception_geometry import (
    anchored_frames as anchored_frames,
)
from cns_drake.scene.perception_geometry import geometry_port as geometry_port
from cns_drake.scene.perception_geometry import list_geometry as list_geometry
from cns_drake.scene.perception_geometry import merge_surfaces as merge_surfaces
from cns_drake.scene.perception_geometry import read_geometry as read_geometry
from cns_drake.scene.perception_geometry import (
    read_perception_geometry as read_perception_geometry,
)
from cns_drake.scene.semantics import CLASS_IDS as CLASS_IDS
from cns_drake.scene.semantics import CLASS_RGB as CLASS_RGB
from cns_drake.scene.semantics import GROUND_CLASSES as GROUND_CLASSES
from cns_drake.scene.semantics import MOVING_IDS as MOVING_IDS
from cns_drake.scene.semantics import moving_id as moving_id
from cns_drake.scene.structure_names import kind_in_name as kind_in_name
from cns_drake.scene.structure_names import structure_name as structure_name
from cns_drake.scene.structure_table import StructureEntry as StructureEntry
from cns_drake.scene.structure_table import StructureTable as StructureTable
from cns_drake.scene.structure_table import (
    load_structure_table as load_structure_table,
)
from cns_drake.scene.structure_table import material_word as material_word
from cns_drake.scene.structure_table import read_materials as read_materials
from cns_drake.scene.structure_table import shortened as shortened
from cns_drake.scene.surfaces import LARGEST_SIZE as LARGEST_SIZE
from cns_drake.scene.surfaces import CapsuleSurface as CapsuleSurface
from cns_drake.scene.surfaces import CylinderSurface as CylinderSurface
from cns_drake.scene.surfaces import EllipsoidSurface as EllipsoidSurface
from cns_drake.scene.surfaces import HalfSpaceSurface as HalfSpaceSurface
from cns_drake.scene.surfaces import Surface as Surface
from cns_drake.scene.surfaces import TriangleSurface as TriangleSurface
from cns_drake.scene.surfaces import is_closed as is_closed
from cns_drake.scene.surfaces import merge_triangles as merge_triangles
from cns_drake.scene.surfaces import tessellate as tessellate
from cns_drake.scene.world import World as World
from cns_drake.scene.world import load_world as load_world
from cns_drake.scene.world import structures_in as structures_in
