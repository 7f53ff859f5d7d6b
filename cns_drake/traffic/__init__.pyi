from .ego_car import EgoBox as EgoBox
from .ego_car import EgoPath as EgoPath
from .fcd_traffic import FcdTrace as FcdTrace
from .fcd_traffic import play_trace as play_trace
from .fcd_traffic import read_fcd as read_fcd
from .queues import plan_queues as plan_queues
from .recorded_traffic import play_recorded as play_recorded
from .recorded_traffic import read_recorded as read_recorded
from .traffic_motion import TrafficMotion as TrafficMotion
from .traffic_motion import add_traffic as add_traffic
from .traffic_motion import connect_traffic as connect_traffic
from .traffic_motion import (
    traffic_structures as traffic_structures,
)
from .traffic_plan import TrafficPlan as TrafficPlan
