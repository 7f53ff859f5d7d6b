from .car_outline import outlines as outlines
from .carriageway import Areas as Areas
from .carriageway import (
    union_without_slits as union_without_slits,
)
from .centreline import sample_stations as sample_stations
from .driver_offsets import FINE_SPACING as FINE_SPACING
from .driver_offsets import driven_path as driven_path
from .driver_offsets import kerbs as kerbs
from .lane_path import POINT_SPACING as POINT_SPACING
from .lane_path import LanePath as LanePath
from .network import Connection as Connection
from .network import RoadNetwork as RoadNetwork
from .network import load_road_network as load_road_network
from .road import ENDS as ENDS
from .road import Arm as Arm
from .road import Direction as Direction
from .road import End as End
from .road import Junction as Junction
from .road import LaneRef as LaneRef
from .road import Road as Road
from .roads_file import JunctionEntry as JunctionEntry
from .roads_file import MeshStem as MeshStem
from .roads_file import RoadEntry as RoadEntry
from .roads_file import RoadsFile as RoadsFile
from .roads_file import RoadStyle as RoadStyle
from .route import Route as Route
from .route import RouteLeg as RouteLeg
from .route import draw_route as draw_route
from .route import make_lane_path as make_lane_path
from .speeds import Speeds as Speeds
from .surface_heights import KerbMap as KerbMap
from .surface_heights import RoadSurface as RoadSurface
from .surface_heights import SurfaceHeights as SurfaceHeights
from .u_turn import TIGHTEST_RADIUS as TIGHTEST_RADIUS
from .waypoints import load_waypoint_path as load_waypoint_path
from .waypoints import make_waypoint_path as make_waypoint_path
from .waypoints import read_waypoints as read_waypoints
