from cns_drake.traffic.ego_car import EgoBox as EgoBox
from cns_drake.traffic.ego_car import EgoPath as EgoPath
from cns_drake.traffic.fcd_traffic import FcdTrace as FcdTrace
from cns_drake.traffic.fcd_traffic import play_trace as play_trace
from cns_drake.traffic.fcd_traffic import read_fcd as read_fcd
from cns_drake.traffic.queues import plan_queues as plan_queues
from cns_drake.traffic.recorded_traffic import play_recorded as play_recorded
from cns_drake.traffic.recorded_traffic import read_recorded as read_recorded
from cns_drake.traffic.traffic_motion import TrafficMotion as TrafficMotion
from cns_drake.traffic.traffic_motion import add_traffic as add_traffic
from cns_drake.traffic.traffic_motion import connect_traffic as connect_traffic
from cns_drake.traffic.traffic_motion import (
    traffic_structures as traffic_structures,
)
from cns_drake.traffic.traffic_plan import TrafficPlan as TrafficPlan
