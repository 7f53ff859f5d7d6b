from cns_drake.motion.path_geometry import SmoothPath as SmoothPath
from cns_drake.motion.road_profile import RoadProfile as RoadProfile
from cns_drake.motion.road_profile import RoughnessClass as RoughnessClass
from cns_drake.motion.splines import REACH as REACH
from cns_drake.motion.suspension import Suspension as Suspension
from cns_drake.motion.suspension import load_car_masses as load_car_masses
from cns_drake.motion.suspension import (
    load_suspension_rates as load_suspension_rates,
)
from cns_drake.motion.suspension import ride_on_springs as ride_on_springs
from cns_drake.motion.trajectory import Trajectory as Trajectory
from cns_drake.motion.trajectory import pose_at as pose_at
from cns_drake.motion.vehicle_motion import VehicleMotion as VehicleMotion
from cns_drake.motion.vehicle_sweep import Sweep as Sweep
from cns_drake.motion.vehicle_sweep import VehicleSweep as VehicleSweep
