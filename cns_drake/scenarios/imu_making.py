"""Rate and noise of a scenario's IMU."""

from __future__ import annotations

import math
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.scenarios.kalibr import KalibrImu, read_kalibr
from cns_drake.scenarios.rates import check_rate, fastest_rate
from cns_drake.scenarios.scenario import Scenario
from cns_drake.sensors.imu_noise import ImuNoise

# The name of the noise's file in a recording.
KALIBR_FILE = "imu.yaml"


def imu_rate(scenario: Scenario) -> int:
    """Returns the IMU's samples per second.

    By default it is the rate in Kalibr's file, or else one sample a scan of the
    fastest LiDAR.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    fastest = fastest_rate(scenario.lidars)
    if scenario.imu.rate is not None:
        return scenario.imu.rate
    kalibr = _kalibr(scenario)
    if kalibr is None or kalibr.update_rate is None:
        return fastest
    try:
        check_rate(kalibr.update_rate, fastest)
    except ValueError as error:
        raise InputError(f"{scenario.imu.kalibr}: update_{error}") from error
    return round(kalibr.update_rate)


def make_imu_noise(scenario: Scenario) -> ImuNoise:
    """Returns the errors of the IMU; None if it is ideal.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    imu = scenario.imu
    densities = {}
    kalibr = _kalibr(scenario)
    if kalibr is not None:
        densities = kalibr.model_dump(exclude={"rostopic", "update_rate"})
    return ImuNoise(
        **densities,
        accelerometer_turn_on_bias=imu.accelerometer_turn_on_bias,
        gyroscope_turn_on_bias=imu.gyroscope_turn_on_bias,
        accelerometer_range=imu.accelerometer_range or math.inf,
        gyroscope_range=imu.gyroscope_range or math.inf,
        seed=scenario.seed,
    )


def describe_kalibr(scenario: Scenario) -> dict | None:
    """Returns the fields of Kalibr's file for the IMU as it is simulated.

    Returns:
        None if the scenario names no such file.

    Raises:
        InputError: the file cannot be used.
    """
    kalibr = _kalibr(scenario)
    if kalibr is None:
        return None
    update = {
        "rostopic": "/imu/data",
        "update_rate": float(imu_rate(scenario)),
    }
    return kalibr.model_copy(update=update).model_dump()


def _kalibr(scenario: Scenario) -> KalibrImu | None:
    file = scenario.imu.kalibr
    return None if file is None else read_kalibr(Path(file))
