from cns_drake.city.buildings import ARCHETYPES as ARCHETYPES
from cns_drake.city.buildings import sample as sample
from cns_drake.city.city_plan import BuildingPlan as BuildingPlan
from cns_drake.city.city_plan import CityPlan as CityPlan
from cns_drake.city.city_plan import DistrictPlan as DistrictPlan
from cns_drake.city.city_plan import LinePlan as LinePlan
from cns_drake.city.city_plan import ObjectPlan as ObjectPlan
from cns_drake.city.city_plan import ParkingPlan as ParkingPlan
from cns_drake.city.city_plan import PatchPlan as PatchPlan
from cns_drake.city.city_plan import RowPlan as RowPlan
from cns_drake.city.city_plan import ScatterPlan as ScatterPlan
from cns_drake.city.city_plan import StreetPlan as StreetPlan
from cns_drake.city.city_plan import load_plan as load_plan
from cns_drake.city.dice import Dice as Dice
from cns_drake.city.dice import Rgb as Rgb
from cns_drake.city.facades.assembly import Assembly as Assembly
from cns_drake.city.facades.balconies import balcony as balcony
from cns_drake.city.facades.bays import gate as gate
from cns_drake.city.facades.bays import house_door as house_door
from cns_drake.city.facades.bays import shop_front as shop_front
from cns_drake.city.facades.bays import stretches as stretches
from cns_drake.city.facades.bays import window as window
from cns_drake.city.facades.boards import board as board
from cns_drake.city.facades.canopies import AwningShape as AwningShape
from cns_drake.city.facades.canopies import awnings as awnings
from cns_drake.city.facades.reliefs import Relief as Relief
from cns_drake.city.facades.reliefs import lifted as lifted
from cns_drake.city.facades.roof_equipment import add_chimney as add_chimney
from cns_drake.city.facades.roof_equipment import equip_roof as equip_roof
from cns_drake.city.facades.site import Site as Site
from cns_drake.city.facades.wall_frames import WallFrame as WallFrame
from cns_drake.city.facades.walls import single_wall as single_wall
from cns_drake.city.furniture.parked_cars import PAINTS as PAINTS
from cns_drake.city.furniture.parked_cars import PARKED_CARS as PARKED_CARS
from cns_drake.city.furniture.parked_cars import TRIM as TRIM
from cns_drake.city.furniture.parked_cars import WHITE as WHITE
from cns_drake.city.generation.city_structures import City as City
from cns_drake.city.generation.city_structures import CityStreets as CityStreets
from cns_drake.city.generation.city_structures import build_along as build_along
from cns_drake.city.generation.city_structures import make_city as make_city
from cns_drake.city.generation.generate import (
    differing_files as differing_files,
)
from cns_drake.city.generation.generate import generate_city as generate_city
from cns_drake.city.generation.rendering import (
    count_triangles as count_triangles,
)
from cns_drake.city.generation.rendering import meshes_of as meshes_of
from cns_drake.city.generation.rendering import render_stages as render_stages
from cns_drake.city.generation.rendering import stage_size as stage_size
from cns_drake.city.generation.rendering import structures_csv as structures_csv
from cns_drake.city.generation.rendering import triangles_in as triangles_in
from cns_drake.city.generation.rendering import world_sdf as world_sdf
from cns_drake.city.generation.starter import start_city as start_city
from cns_drake.city.generation.starter import starter_plan as starter_plan
from cns_drake.city.generation.starter import starter_stages as starter_stages
from cns_drake.city.geometry.mesh import Mesh as Mesh
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
from cns_drake.city.geometry.models import part_triangles as part_triangles
from cns_drake.city.geometry.models import triple as triple
from cns_drake.city.geometry.object_models import OBJECT_MESHES as OBJECT_MESHES
from cns_drake.city.geometry.object_models import assemble as assemble
from cns_drake.city.geometry.object_models import bar as bar
from cns_drake.city.geometry.object_models import block as block
from cns_drake.city.geometry.object_models import (
    ground_footprint as ground_footprint,
)
from cns_drake.city.geometry.object_models import post as post
from cns_drake.city.geometry.occupancy import Occupancy as Occupancy
from cns_drake.city.geometry.polygon_meshes import surface_mesh as surface_mesh
from cns_drake.city.geometry.polygons import GRID as GRID
from cns_drake.city.geometry.polygons import hull_of as hull_of
from cns_drake.city.geometry.polygons import placed as placed
from cns_drake.city.geometry.polygons import polygons_of as polygons_of
from cns_drake.city.geometry.polygons import snap as snap
from cns_drake.city.geometry.rectangles import (
    largest_rectangle as largest_rectangle,
)
from cns_drake.city.geometry.structures import Structure as Structure
from cns_drake.city.geometry.structures import (
    ground_triangles as ground_triangles,
)
from cns_drake.city.geometry.triangles import from_above as from_above
from cns_drake.city.geometry.triangles import long_normals as long_normals
from cns_drake.city.geometry.triangles import looks_up as looks_up
from cns_drake.city.geometry.triangles import quartered as quartered
from cns_drake.city.geometry.triangles import turned_up as turned_up
from cns_drake.city.geometry.triangles import unit_normals as unit_normals
from cns_drake.city.geometry.triangulation import triangulate as triangulate
from cns_drake.city.geometry.upper_sides import UpperSides as UpperSides
from cns_drake.city.ground.coverings import TILE as TILE
from cns_drake.city.ground.coverings import Covering as Covering
from cns_drake.city.ground.markings import DASH as DASH
from cns_drake.city.ground.markings import DASH_GAP as DASH_GAP
from cns_drake.city.ground.streets import kerb_area as kerb_area
from cns_drake.city.ground.streets import parking_bays as parking_bays
from cns_drake.city.ground.streets import street_surfaces as street_surfaces
from cns_drake.city.growth.building_sites import building_site as building_site
from cns_drake.city.growth.lot_uses import lot_objects as lot_objects
from cns_drake.city.growth.lot_uses import use_by_size as use_by_size
from cns_drake.city.growth.lowering import STOREY as STOREY
from cns_drake.city.growth.lowering import lowered as lowered
from cns_drake.city.growth.lowering import top_of as top_of
from cns_drake.city.placement.draft import Draft as Draft
from cns_drake.city.placement.draft import name_stem as name_stem
from cns_drake.city.placement.frontage import lines_along as lines_along
from cns_drake.city.placement.frontage import lot_at as lot_at
from cns_drake.city.placement.frontage import station_at as station_at
from cns_drake.city.placement.objects import OBJECTS as OBJECTS
from cns_drake.city.placement.objects import pick_key as pick_key
from cns_drake.city.placement.parking import place_car as place_car
from cns_drake.city.plants import SPECIES as SPECIES
from cns_drake.city.plants import scaled_plant as scaled_plant
from cns_drake.city.plants import tree as tree
from cns_drake.city.plants import younger_plant as younger_plant
from cns_drake.city.stages import Growth as Growth
from cns_drake.city.stages import Stage as Stage
from cns_drake.city.stages import Stages as Stages
from cns_drake.city.stages import load_stages as load_stages
