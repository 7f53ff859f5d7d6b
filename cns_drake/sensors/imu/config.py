"""The description of an IMU, and the file of its noise densities."""

from dataclasses import dataclass
import math
from pathlib import Path
from typing import Annotated

from pydantic import Field

from cns_drake.sensors.imu.noise import ImuNoise
from cns_drake.sensors.sensor_config import (
    Mount,
    Triple,
    check_rate,
    field_off_by_default,
)
from evaluation.base import (
    InputError,
    Section,
    read_yaml,
    validated,
    value_errors,
)

# The name of the noise's file in a recording.
KALIBR_FILE = "imu.yaml"

_Bias = Annotated[float, field_off_by_default(0.0, ge=0.0)]
_Limit = Annotated[float | None, field_off_by_default(None, gt=0.0)]


# Drake's YAML reads the types of the fields, which thus must not be texts, as
# `from __future__ import annotations` makes them.
@dataclass(init=False, repr=False, eq=False)
class ImuDescription:
    """An IMU's rate and errors, in a scenario and in an `ImuConfig` alike.

    Attributes:
        rate: samples per second [Hz].
        kalibr: file in Kalibr's format with the four noise densities of the
            IMU. By default there is no noise.
        accelerometer_turn_on_bias: standard deviation of the constant bias that
            each axis of the accelerometer has from the start [m/s^2].
        gyroscope_turn_on_bias: standard deviation of the constant bias that
            each axis of the gyroscope has from the start [rad/s].
        accelerometer_range: largest specific force that an axis can measure, in
            either direction [m/s^2]. By default no limit.
        gyroscope_range: largest angular velocity that an axis can measure, in
            either direction [rad/s]. By default no limit.
    """

    rate: float | None = None
    kalibr: Annotated[str | None, field_off_by_default(None)] = None
    accelerometer_turn_on_bias: _Bias = 0.0
    gyroscope_turn_on_bias: _Bias = 0.0
    accelerometer_range: _Limit = None
    gyroscope_range: _Limit = None


class ImuSection(ImuDescription, Mount):
    """An IMU. By default it is ideal, with one sample per scan.

    Attributes:
        xyz: position in `base_link` [m].
        rpy_deg: roll, pitch, yaw in `base_link` [deg].
        rate: samples per second [Hz]: at least the scan rate, at most 1000, and
            a whole number of nanoseconds apart. By default the rate in the file
            `kalibr`, or one sample per scan.
    """

    xyz: Triple = (-1.0, 0.0, 1.6)
    rate: int | None = field_off_by_default(None)

    @property
    def is_ideal(self) -> bool:
        """Whether the IMU has no errors and takes one sample per scan."""
        return self == ImuSection(xyz=self.xyz, rpy_deg=self.rpy_deg)

    def sample_rate(self, scan_rate: int) -> int:
        """Returns the number of samples per second.

        The number is `rate` if given, or else the rate in Kalibr's file, or
        else the scan rate. `scan_rate` is the number of scans per second.

        Raises:
            InputError: Kalibr's file cannot be used.
        """
        if self.rate is not None:
            return self.rate
        kalibr = self._read_kalibr()
        if kalibr is None or kalibr.update_rate is None:
            return scan_rate
        with value_errors(self.kalibr):
            check_rate(kalibr.update_rate, scan_rate, "update_rate")
        return round(kalibr.update_rate)

    def noise(self, seed: int) -> ImuNoise:
        """Returns the errors of the IMU, all zero if it is ideal.

        Raises:
            InputError: Kalibr's file cannot be used.
        """
        densities = {}
        kalibr = self._read_kalibr()
        if kalibr is not None:
            densities = kalibr.model_dump(exclude={"rostopic", "update_rate"})
        return ImuNoise(
            **densities,
            accelerometer_turn_on_bias=self.accelerometer_turn_on_bias,
            gyroscope_turn_on_bias=self.gyroscope_turn_on_bias,
            accelerometer_range=self.accelerometer_range or math.inf,
            gyroscope_range=self.gyroscope_range or math.inf,
            seed=seed,
        )

    def describe_kalibr(self, scan_rate: int) -> dict | None:
        """Returns the fields of a Kalibr file for the simulated IMU.

        Args:
            scan_rate: scans per second, which is the sample rate of the IMU if
                neither `rate` nor Kalibr's file states a rate.

        Returns:
            Field -> value, with the simulated sample rate as `update_rate`;
            None if `kalibr` names no file.

        Raises:
            InputError: the file cannot be used.
        """
        kalibr = self._read_kalibr()
        if kalibr is None:
            return None
        rate = float(self.sample_rate(scan_rate))
        changed = kalibr.replaced(rostopic="/imu/data", update_rate=rate)
        return changed.model_dump()

    def _read_kalibr(self) -> "KalibrImu | None":
        return None if self.kalibr is None else read_kalibr(Path(self.kalibr))


class KalibrImu(Section):
    """The fields of Kalibr's `imu.yaml`.

    Attributes:
        accelerometer_noise_density: density of the white noise
            [m/s^2/sqrt(Hz)].
        accelerometer_random_walk: random walk of the bias [m/s^3/sqrt(Hz)].
        gyroscope_noise_density: density of the white noise [rad/s/sqrt(Hz)].
        gyroscope_random_walk: random walk of the bias [rad/s^2/sqrt(Hz)].
        rostopic: topic of the IMU's messages; not used.
        update_rate: samples per second.
    """

    accelerometer_noise_density: float = Field(ge=0.0)
    accelerometer_random_walk: float = Field(ge=0.0)
    gyroscope_noise_density: float = Field(ge=0.0)
    gyroscope_random_walk: float = Field(ge=0.0)
    rostopic: str | None = None
    update_rate: float | None = Field(default=None, gt=0.0)


def read_kalibr(path: Path) -> KalibrImu:
    """Reads the noise densities and the rate from a file in Kalibr's format.

    Raises:
        InputError: the file cannot be read, or has another form.
    """
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a mapping of Kalibr's fields of an IMU")
    return validated(KalibrImu, values, path)
