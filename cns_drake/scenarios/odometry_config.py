"""The odometry of a scenario."""

from __future__ import annotations

from cns_drake.scenarios.section import Section


class OdometryConfig(Section):
    """How often the exact motion of the vehicle is recorded.

    Attributes:
        rate: messages per second; by default one a scan.
    """

    rate: int | None = None
