from cns_drake.traffic.ego_car import EgoBox as EgoBox
from cns_drake.traffic.ego_car import EgoPath as EgoPath
from cns_drake.traffic.fcd_traffic import play_trace as play_trace
from cns_drake.traffic.fcd_traffic import read_fcd as read_fcd
from cns_drake.traffic.lane_file import LaneFile as LaneFile
from cns_drake.traffic.lane_file import lane_text as lane_text
from cns_drake.traffic.lane_file import read_lanes as read_lanes
from cns_drake.traffic.lane_graph import Crossing as Crossing
from cns_drake.traffic.lane_graph import LaneGraph as LaneGraph
from cns_drake.traffic.lane_graph import Piece as Piece
from cns_drake.traffic.lane_graph import Walkway as Walkway
from cns_drake.traffic.lane_graph import make_crossing as make_crossing
from cns_drake.traffic.lane_joining import DirectedLane as DirectedLane
from cns_drake.traffic.lane_joining import join_lanes as join_lanes
from cns_drake.traffic.lane_joining import usual_limit as usual_limit
from cns_drake.traffic.polylines import SPACING as SPACING
from cns_drake.traffic.polylines import resampled as resampled
from cns_drake.traffic.queues import plan_queues as plan_queues
from cns_drake.traffic.recorded_traffic import play_recorded as play_recorded
from cns_drake.traffic.recorded_traffic import read_recorded as read_recorded
from cns_drake.traffic.road_lanes import make_lane_graph as make_lane_graph
from cns_drake.traffic.road_lanes import make_walkways as make_walkways
from cns_drake.traffic.traffic_motion import TrafficMotion as TrafficMotion
from cns_drake.traffic.traffic_motion import add_traffic as add_traffic
from cns_drake.traffic.traffic_motion import connect_traffic as connect_traffic
from cns_drake.traffic.traffic_motion import (
    traffic_structures as traffic_structures,
)
from cns_drake.traffic.traffic_plan import TrafficPlan as TrafficPlan
