"""A kind of sensor from its description to its messages: a GNSS receiver.

    python docs/examples/gnss.py

It records a second of Downtown. CONTRIBUTING.md explains it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)

from cns_drake import Scenario, load_scenario, simulate
from cns_drake.recording import Topic, make_header
from cns_drake.sensors import (
    SensorConfig,
    Triple,
    field_off_by_default,
    noise_generator,
    sensor_pose,
)
from evaluation.drives import message_class

FIX = "sensor_msgs/msg/NavSatFix"
METRES_PER_DEG = 111_319.5
# The stream of its random numbers; no other kind of sensor has this number.
_NOISE = 32


class GnssConfig(SensorConfig):
    """A GNSS receiver with white noise.

    Attributes:
        xyz: position in `base_link` [m].
        rpy_deg: roll, pitch, yaw in `base_link` [deg].
        rate: fixes per second, at least the rate of the fastest LiDAR.
        origin_deg: latitude and longitude of the map's origin.
        noise: standard deviation of each coordinate [m].
    """

    xyz: Triple = (0.0, 0.0, 1.9)
    origin_deg: tuple[float, float] = (48.0, 11.0)
    noise: float = Field(default=1.0, ge=0.0)

    def topic(self, name: str) -> Topic:
        return Topic(f"/{name}/fix", FIX)

    def add(
        self,
        builder: DiagramBuilder,
        scene_graph: SceneGraph,
        body: RigidBody,
        *,
        motion: System,
        name: str,
        seed: int,
    ) -> OutputPort:
        X_BG = sensor_pose(self)
        gnss = builder.AddNamedSystem(name, Gnss(body, X_BG, self.noise, seed))
        builder.Connect(
            motion.GetOutputPort("body_poses"), gnss.get_input_port()
        )
        return gnss.get_output_port()

    def make_message(
        self, value: np.ndarray, frame_id: str, stamp_ns: int
    ) -> Any:
        east, north, up = value
        latitude, longitude = self.origin_deg
        status = message_class("sensor_msgs/msg/NavSatStatus")
        return message_class(FIX)(
            header=make_header(frame_id, stamp_ns),
            status=status(status=0, service=1),
            latitude=latitude + north / METRES_PER_DEG,
            longitude=longitude
            + east / (METRES_PER_DEG * np.cos(np.radians(latitude))),
            altitude=float(up),
            position_covariance=np.eye(3).ravel() * self.noise**2,
            position_covariance_type=2,
        )


class Gnss(LeafSystem):
    """Measures the position of a place G on a body.

    .. pydrake_system::

        name: Gnss
        input_ports:
        - body_poses
        output_ports:
        - position

    `position` is abstract, p_WG with noise (3,) [m].
    """

    def __init__(
        self, body: RigidBody, X_BG: RigidTransform, noise: float, seed: int
    ):
        """Declares the ports; for the arguments see `GnssConfig`."""
        super().__init__()
        self._body = body.index()
        self._X_BG = X_BG
        self._noise = noise
        self._seed = seed
        self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self.DeclareAbstractOutputPort(
            "position", lambda: Value(np.zeros(3)), self._calc_position
        )

    def _calc_position(self, context: Context, output: AbstractValue) -> None:
        X_WB = self.get_input_port().Eval(context)[self._body]
        # The noise depends on the time alone, not on earlier fixes.
        time_ns = round(context.get_time() * 1e9)
        rng = noise_generator(self._seed, self.get_name(), _NOISE, time_ns)
        p_WG = (X_WB @ self._X_BG).translation()
        output.set_value(p_WG + rng.normal(scale=self._noise, size=3))


class GnssScenario(Scenario):
    """A drive with a GNSS receiver.

    Attributes:
        gnss: the receiver, if any.
    """

    gnss: GnssConfig | None = field_off_by_default(None)


def with_gnss(scenario: Scenario, frames: int) -> GnssScenario:
    """Returns the first frames of a scenario, with ten fixes a scan."""
    values = scenario.model_dump(exclude_none=True)
    gnss = GnssConfig(rate=200, noise=0.5)
    return GnssScenario(**values | {"gnss": gnss, "frames": frames})


if __name__ == "__main__":
    run = simulate(
        with_gnss(load_scenario("downtown_01"), 20), Path("recordings")
    )
    print(f"{run.folder}: {run.num_frames} frames")
