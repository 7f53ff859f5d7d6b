"""Moves vehicles by a time step, and chooses their ways through junctions."""

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.random_numbers import uniform
from cns_drake.traffic.vehicle_records import CURRENT, NUM_PIECES, Traffic


@compiled
def advance(traffic: Traffic, accelerations: np.ndarray) -> None:
    """Moves all vehicles by one time step, with accelerations (N,) [m/s^2]."""
    cars, pieces = traffic.cars, traffic.streets.pieces
    for i in range(len(cars)):
        car = cars[i]
        if car.guided:
            continue
        v = max(0.0, car.v + accelerations[i] * STEP)
        s = car.s + 0.5 * (car.v + v) * STEP
        while True:
            piece = pieces[car.path[CURRENT]]
            left = piece.length - s
            if left > 0.0:
                break
            if not piece.is_way and not car.granted:
                s, v = piece.length, 0.0
                break
            s = -left
            for column in range(NUM_PIECES - 1):
                car.path[column] = car.path[column + 1]
            car.path[NUM_PIECES - 1] = -1
            if not pieces[car.path[CURRENT]].is_way:
                car.granted = False
                choose_way(traffic, i)
        car.s, car.v = s, v
        rear = s - car.length
        # A vehicle before its way keeps the permission that it has just got.
        is_before = car.held == car.path[CURRENT + 1] and car.granted
        if car.held >= 0 and not (piece.is_way or rear < 0.0 or is_before):
            car.held = -1
        if car.left_lane >= 0 and rear - car.change_start >= car.change_length:
            car.left_lane = -1


@compiled
def choose_way(traffic: Traffic, i: int) -> None:
    """Chooses at random where the i-th vehicle goes at the next junction.

    Two directions are sampled, and the direction that leads to the emptier lane
    is chosen. Thus no street stays empty while vehicles queue in other streets.
    """
    streets, cars = traffic.streets, traffic.cars
    car = cars[i]
    lane = streets.pieces[car.path[CURRENT]]
    least = np.inf
    for _ in range(2):
        car.draws += 1
        pick = uniform(traffic.seed, i, car.draws)
        row = lane.after_first
        last = row + lane.after_count - 1
        while row < last and pick >= streets.liked[row]:
            row += 1
        way = streets.after[row]
        beyond = streets.after[streets.pieces[way].after_first]
        number = 0.0
        for j in range(len(cars)):
            number += (
                cars[j].path[CURRENT] == beyond
                or cars[j].path[CURRENT + 2] == beyond
            )
        filled = number / streets.pieces[beyond].length
        if filled < least:
            least = filled
            car.path[CURRENT + 1], car.path[CURRENT + 2] = way, beyond
