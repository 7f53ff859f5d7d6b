"""Vehicles and pedestrians that move while a drive is recorded.

The motion of these road users is planned before the drive, from the roads and a
seed. During the drive, the poses are interpolated from this plan.

- Lanes and walkways: `lane_graph`, made by `road_lanes` and `road_walkways`
  from roads, by `lane_joining` from imported lanes, or read by `lane_file`;
  `unmarked_crossings`, `walkway_clearing`, `polylines`, `lane_heights`.
- Streets as arrays: `streets` with `conflicts`, `signals`, `traffic_flow`, and
  the `ego_car` on them.
- Vehicles: `vehicle_kinds`, `vehicle_records`, `vehicle_placement`; in each
  step, `occupants`, `right_of_way`, `giving_way`, `car_following`,
  `lane_changes` and `vehicle_steps`; then `vehicle_poses`.
- The ego car among them: `follower`, `path_runs`.
- Pedestrians: `walkers`, `social_force`.
- Plans: `traffic_plan`, made by `traffic_planning` and `traffic_trial`;
  `queues`; `fcd_traffic` from a SUMO trace that `fcd_trace` reads; `tracks`,
  `overlaps`, `random_numbers`.
- In a diagram: `traffic_motion`, `body_states`, `body_shapes`.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
