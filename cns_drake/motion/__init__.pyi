from .road_profile import RoadProfile as RoadProfile
from .road_profile import RoughnessClass as RoughnessClass
from .suspension import Suspension as Suspension
from .suspension import load_car_masses as load_car_masses
from .suspension import (
    load_suspension_rates as load_suspension_rates,
)
from .suspension import ride_on_springs as ride_on_springs
from .trajectory import Trajectory as Trajectory
from .trajectory import pose_at as pose_at
from .vehicle_motion import VehicleMotion as VehicleMotion
from .vehicle_sweep import VehicleSweep as VehicleSweep
