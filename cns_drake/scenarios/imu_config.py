"""The IMU of a scenario."""

from __future__ import annotations

from cns_drake.scenarios.mount import Mount, Triple
from cns_drake.scenarios.section import field_off_by_default


class ImuConfig(Mount):
    """An IMU, ideal and with one sample a scan unless a field says otherwise.

    Attributes:
        xyz: position in `base_link` [m].
        rpy_deg: roll, pitch, yaw in `base_link` [deg].
        rate: samples per second, from the rate of the scans to 1000; it divides
            1,000,000,000 ns, as 100, 200, 250, 400 and 500 do.
        kalibr: a file of Kalibr's with the four noise densities.
        accelerometer_turn_on_bias: standard deviation of the accelerometer's
            bias at the start, drawn for each axis [m/s^2].
        gyroscope_turn_on_bias: likewise of the gyroscope [rad/s].
        accelerometer_range: the most that an axis of the accelerometer
            measures, either way [m/s^2].
        gyroscope_range: likewise of the gyroscope [rad/s].
    """

    xyz: Triple = (-1.0, 0.0, 1.6)
    rate: int | None = field_off_by_default(None)
    kalibr: str | None = field_off_by_default(None)
    accelerometer_turn_on_bias: float = field_off_by_default(0.0, ge=0.0)
    gyroscope_turn_on_bias: float = field_off_by_default(0.0, ge=0.0)
    accelerometer_range: float | None = field_off_by_default(None, gt=0.0)
    gyroscope_range: float | None = field_off_by_default(None, gt=0.0)

    @property
    def is_ideal(self) -> bool:
        """Whether it measures exactly, once a scan."""
        return self == ImuConfig(xyz=self.xyz, rpy_deg=self.rpy_deg)
