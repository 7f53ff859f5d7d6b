from cns_drake.roads.car_outline import outlines as outlines
from cns_drake.roads.carriageway import Areas as Areas
from cns_drake.roads.carriageway import (
    union_without_slits as union_without_slits,
)
from cns_drake.roads.centreline import sample_stations as sample_stations
from cns_drake.roads.driver_offsets import FINE_SPACING as FINE_SPACING
from cns_drake.roads.driver_offsets import driven_path as driven_path
from cns_drake.roads.driver_offsets import kerbs as kerbs
from cns_drake.roads.lane_path import POINT_SPACING as POINT_SPACING
from cns_drake.roads.lane_path import LanePath as LanePath
from cns_drake.roads.network import Connection as Connection
from cns_drake.roads.network import RoadNetwork as RoadNetwork
from cns_drake.roads.network import load_road_network as load_road_network
from cns_drake.roads.road import ENDS as ENDS
from cns_drake.roads.road import Arm as Arm
from cns_drake.roads.road import Direction as Direction
from cns_drake.roads.road import End as End
from cns_drake.roads.road import Junction as Junction
from cns_drake.roads.road import LaneRef as LaneRef
from cns_drake.roads.road import Road as Road
from cns_drake.roads.roads_file import JunctionEntry as JunctionEntry
from cns_drake.roads.roads_file import MeshStem as MeshStem
from cns_drake.roads.roads_file import RoadEntry as RoadEntry
from cns_drake.roads.roads_file import RoadsFile as RoadsFile
from cns_drake.roads.roads_file import RoadStyle as RoadStyle
from cns_drake.roads.route import Route as Route
from cns_drake.roads.route import RouteLeg as RouteLeg
from cns_drake.roads.route import draw_route as draw_route
from cns_drake.roads.route import make_lane_path as make_lane_path
from cns_drake.roads.speeds import Speeds as Speeds
from cns_drake.roads.surface_heights import KerbMap as KerbMap
from cns_drake.roads.surface_heights import RoadSurface as RoadSurface
from cns_drake.roads.surface_heights import SurfaceHeights as SurfaceHeights
from cns_drake.roads.u_turn import TIGHTEST_RADIUS as TIGHTEST_RADIUS
from cns_drake.roads.waypoints import load_waypoint_path as load_waypoint_path
from cns_drake.roads.waypoints import make_waypoint_path as make_waypoint_path
from cns_drake.roads.waypoints import read_waypoints as read_waypoints
