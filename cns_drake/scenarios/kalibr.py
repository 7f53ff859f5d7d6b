"""The file in which Kalibr keeps the noise of an IMU."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, ValidationError

from cns_drake.base.errors import InputError, describe_validation_error
from cns_drake.base.yaml_files import read_yaml
from cns_drake.scenarios.section import Section


class KalibrImu(Section):
    """The fields of Kalibr's `imu.yaml`.

    Attributes:
        accelerometer_noise_density: [m/s^2/sqrt(Hz)].
        accelerometer_random_walk: [m/s^3/sqrt(Hz)].
        gyroscope_noise_density: [rad/s/sqrt(Hz)].
        gyroscope_random_walk: [rad/s^2/sqrt(Hz)].
        rostopic: topic of its messages; not used.
        update_rate: samples per second.
    """

    accelerometer_noise_density: float = Field(ge=0.0)
    accelerometer_random_walk: float = Field(ge=0.0)
    gyroscope_noise_density: float = Field(ge=0.0)
    gyroscope_random_walk: float = Field(ge=0.0)
    rostopic: str | None = None
    update_rate: float | None = Field(default=None, gt=0.0)


def read_kalibr(path: Path) -> KalibrImu:
    """Reads the noise of an IMU.

    Raises:
        InputError: the file cannot be read, or is of another form.
    """
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a mapping of Kalibr's fields of an IMU")
    try:
        return KalibrImu.model_validate(values)
    except ValidationError as error:
        raise InputError(
            describe_validation_error(path, error, KalibrImu)
        ) from None
