from .buildings import ARCHETYPES as ARCHETYPES
from .buildings import sample as sample
from .city_plan import BuildingPlan as BuildingPlan
from .city_plan import CityPlan as CityPlan
from .city_plan import DistrictPlan as DistrictPlan
from .city_plan import LinePlan as LinePlan
from .city_plan import ObjectPlan as ObjectPlan
from .city_plan import ParkingPlan as ParkingPlan
from .city_plan import PatchPlan as PatchPlan
from .city_plan import RowPlan as RowPlan
from .city_plan import ScatterPlan as ScatterPlan
from .city_plan import StreetPlan as StreetPlan
from .city_plan import load_plan as load_plan
from .dice import Dice as Dice
from .dice import Rgb as Rgb
from .facades.assembly import Assembly as Assembly
from .facades.balconies import balcony as balcony
from .facades.bays import gate as gate
from .facades.bays import house_door as house_door
from .facades.bays import shop_front as shop_front
from .facades.bays import stretches as stretches
from .facades.bays import window as window
from .facades.boards import board as board
from .facades.canopies import AwningShape as AwningShape
from .facades.canopies import awnings as awnings
from .facades.reliefs import Relief as Relief
from .facades.reliefs import lifted as lifted
from .facades.roof_equipment import add_chimney as add_chimney
from .facades.roof_equipment import equip_roof as equip_roof
from .facades.site import Site as Site
from .facades.wall_frames import WallFrame as WallFrame
from .facades.walls import single_wall as single_wall
from .furniture.parked_cars import PAINTS as PAINTS
from .furniture.parked_cars import PARKED_CARS as PARKED_CARS
from .furniture.parked_cars import TRIM as TRIM
from .furniture.parked_cars import WHITE as WHITE
from .generation.city_structures import City as City
from .generation.city_structures import CityStreets as CityStreets
from .generation.city_structures import build_along as build_along
from .generation.city_structures import make_city as make_city
from .generation.generate import (
    differing_files as differing_files,
)
from .generation.generate import generate_city as generate_city
from .generation.rendering import (
    count_triangles as count_triangles,
)
from .generation.rendering import render_stages as render_stages
from .generation.rendering import stage_size as stage_size
from .generation.rendering import structures_csv as structures_csv
from .generation.rendering import triangles_in as triangles_in
from .generation.rendering import world_sdf as world_sdf
from .generation.starter import start_city as start_city
from .generation.starter import starter_plan as starter_plan
from .generation.starter import starter_stages as starter_stages
from .geometry.mesh import Mesh as Mesh
from .geometry.mesh import read_mesh as read_mesh
from .geometry.models import BoxShape as BoxShape
from .geometry.models import CylinderShape as CylinderShape
from .geometry.models import Finish as Finish
from .geometry.models import MeshShape as MeshShape
from .geometry.models import Model as Model
from .geometry.models import Part as Part
from .geometry.models import Shape as Shape
from .geometry.models import SphereShape as SphereShape
from .geometry.models import part_mesh as part_mesh
from .geometry.models import part_triangles as part_triangles
from .geometry.models import triple as triple
from .geometry.object_models import OBJECT_MESHES as OBJECT_MESHES
from .geometry.object_models import assemble as assemble
from .geometry.object_models import bar as bar
from .geometry.object_models import block as block
from .geometry.object_models import (
    ground_footprint as ground_footprint,
)
from .geometry.object_models import post as post
from .geometry.occupancy import Occupancy as Occupancy
from .geometry.polygon_meshes import surface_mesh as surface_mesh
from .geometry.polygons import GRID as GRID
from .geometry.polygons import hull_of as hull_of
from .geometry.polygons import placed as placed
from .geometry.polygons import polygons_of as polygons_of
from .geometry.polygons import snap as snap
from .geometry.rectangles import (
    largest_rectangle as largest_rectangle,
)
from .geometry.structures import Structure as Structure
from .geometry.structures import (
    ground_triangles as ground_triangles,
)
from .geometry.triangles import from_above as from_above
from .geometry.triangles import long_normals as long_normals
from .geometry.triangles import looks_up as looks_up
from .geometry.triangles import quartered as quartered
from .geometry.triangles import turned_up as turned_up
from .geometry.triangles import unit_normals as unit_normals
from .geometry.triangulation import triangulate as triangulate
from .geometry.upper_sides import UpperSides as UpperSides
from .ground.coverings import TILE as TILE
from .ground.coverings import Covering as Covering
from .ground.markings import DASH as DASH
from .ground.markings import DASH_GAP as DASH_GAP
from .ground.streets import kerb_area as kerb_area
from .ground.streets import parking_bays as parking_bays
from .ground.streets import street_surfaces as street_surfaces
from .growth.building_sites import building_site as building_site
from .growth.lot_uses import lot_objects as lot_objects
from .growth.lot_uses import use_by_size as use_by_size
from .growth.lowering import STOREY as STOREY
from .growth.lowering import lowered as lowered
from .growth.lowering import top_of as top_of
from .placement.draft import Draft as Draft
from .placement.draft import name_stem as name_stem
from .placement.frontage import lines_along as lines_along
from .placement.frontage import lot_at as lot_at
from .placement.frontage import station_at as station_at
from .placement.objects import OBJECTS as OBJECTS
from .placement.objects import pick_key as pick_key
from .placement.parking import place_car as place_car
from .plants import SPECIES as SPECIES
from .plants import scaled_plant as scaled_plant
from .plants import tree as tree
from .plants import younger_plant as younger_plant
from .stages import Growth as Growth
from .stages import Stage as Stage
from .stages import Stages as Stages
from .stages import load_stages as load_stages
