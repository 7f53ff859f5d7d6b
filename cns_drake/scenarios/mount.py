"""Where a sensor sits on the vehicle."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from cns_drake.scenarios.section import Section

# Greatest distance of a sensor on a vehicle [m]; rays are cast in single
# precision.
Place = Annotated[float, Field(ge=-1000.0, le=1000.0)]
Triple = tuple[Place, Place, Place]
Angle = Annotated[float, Field(ge=-3600.0, le=3600.0)]


class Mount(Section):
    """Where a sensor sits on the vehicle.

    Attributes:
        xyz: position in base_link [m].
        rpy_deg: roll, pitch, yaw in base_link [deg].
    """

    xyz: Triple
    rpy_deg: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
