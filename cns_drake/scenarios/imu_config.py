"""The IMU of a scenario."""

from __future__ import annotations

from cns_drake.scenarios.mount import Mount, Triple


class ImuConfig(Mount):
    """An ideal IMU."""

    xyz: Triple = (-1.0, 0.0, 1.6)
