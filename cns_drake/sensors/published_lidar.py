"""A LiDAR configured in YAML, in the same way as Drake's cameras.

It needs both Drake, which `lidar_config` does without, and pydantic, which
`lidar_adding` does without.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import GeometryId, Role, SceneGraph
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.perception import PointCloud, PointCloudToLcm
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmBuses

from cns_drake.sensors.lidar.beams import period_of_rate
from cns_drake.sensors.lidar.lidar import Lidar, sample_times
from cns_drake.sensors.lidar_adding import add_lidar
from cns_drake.sensors.lidar_config import (
    LidarDescription,
    LidarSection,
    make_lidar_model,
    revolution_at_rate,
)
from cns_drake.sensors.noise_draws import check_seed
from cns_drake.sensors.published_sensor import (
    Interface,
    PublishedSensor,
    carrier_frame,
    errors_of,
    find_interface,
    names_of_fields_in_errors,
    publish_measurements,
    section_of,
)
from evaluation.base import check_type, one_line
from evaluation.lidar_sheets import DEFAULT_PRESET, LONGEST_PERIOD

_ROLES = {
    "perception": Role.kPerception,
    "illustration": Role.kIllustration,
    "proximity": Role.kProximity,
}


@names_of_fields_in_errors
@dataclass(eq=False)
class LidarConfig(LidarDescription, PublishedSensor):
    """The configuration of a LiDAR, for YAML and `ApplyLidarConfig`.

    The fields are those of a `LidarDescription`, of all sensors (`name`, `X_PB`
    and `lcm_bus`), and the following. Unlike in a scenario, coordinates are not
    rounded by default. A relative path `unit` starts at the working directory.

    Attributes:
        rate: scans per second, from 0.25 to 1000. With a rate, the LiDAR is
            discrete: it computes a scan once per period and holds it. By
            default, the LiDAR is continuous, and publishes at the rate of the
            data sheet. A revolution takes as long as the data sheet states, or
            1 / `rate` if that is shorter.
        causal: whether a scan covers the revolution that ends at its time, so
            that a controller can use it at once.
        capture_offset: time of a discrete LiDAR's first periodic scan [s].
            With different offsets, several LiDARs can take turns.
        output_delay: time from a discrete LiDAR's scan to its appearance on the
            ports and its publication [s], less than 1 / `rate`. The message
            has the time of the scan.
        seed: seed of the noise.
        role: role of the geometry that the LiDAR sees: `perception`,
            `illustration` or `proximity`.
        unseen: names of bodies, frames on bodies, and geometries that the LiDAR
            does not see, such as `robot::arm`. A geometry has the name that the
            SceneGraph's inspector gives; a name stands for all geometries that
            have it. By default, the LiDAR's body and all bodies that are welded
            to it; `[]` if the LiDAR sees all bodies.
        num_threads: number of threads that share the LiDAR's rays.

    Example:
        from pydrake.common.yaml import yaml_load_typed

        from cns_drake import LidarConfig

        text = "{preset: os1-64, rate: 12.5}"
        config = yaml_load_typed(schema=LidarConfig, data=text)
    """

    name: str = "lidar"
    rate: float | None = None
    causal: bool = False
    capture_offset: float = 0.0
    output_delay: float = 0.0
    seed: int = 0
    role: str = "perception"
    unseen: list[str] | None = None
    num_threads: int = 1

    def _validate(self) -> None:
        self._section()
        if self.rate is not None:
            period_of_rate(self.rate, LONGEST_PERIOD)
        sample_times(self.rate, self.capture_offset, self.output_delay)
        if self.role not in _ROLES:
            raise ValueError(
                f"role: {self.role!r} is not one of {', '.join(_ROLES)}"
            )
        check_seed(self.seed)
        if self.num_threads < 1:
            raise ValueError(f"num_threads: {self.num_threads} is less than 1")

    def _section(self) -> LidarSection:
        """Returns the section of a scenario with the same fields."""
        if self.unit is not None and self.preset == DEFAULT_PRESET:
            # Nobody has given the preset.
            return section_of(self, LidarSection, preset=None)
        return section_of(self, LidarSection)


def _make_scan_messages() -> Callable[..., AbstractValue | None]:
    """Returns a function that returns a scan as an `lcmt_point_cloud`.

    The message has the time of the scan, which can be earlier than that of the
    Context.
    """
    convert = PointCloudToLcm("world")

    def make_message(
        _: float, cloud_W: PointCloud, scan_time: np.ndarray
    ) -> AbstractValue | None:
        if np.isnan(scan_time[0]):
            return None
        own = convert.CreateDefaultContext()
        # Drake cuts off what is below a microsecond.
        own.SetTime((round(scan_time[0] * 1e6) + 0.5) / 1e6)
        convert.get_input_port().FixValue(own, Value(cloud_W))
        return convert.get_output_port().EvalAbstract(own).Clone()

    return make_message


def ApplyLidarConfig(
    config: LidarConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm_buses: LcmBuses | None = None,
    lcm: Interface | None = None,
) -> Lidar:
    """Adds a LiDAR to a diagram and publishes its scans on LCM.

    The messages are `lcmt_point_cloud` on the channel
    `DRAKE_POINT_CLOUD_<name>`, one per revolution, with points expressed in the
    world. Meldis shows them. The field `rgb` contains the intensities as greys,
    as in the port `point_cloud_W` of a `Lidar`.

    Args:
        config: description of the LiDAR.
        builder: builder of the diagram, with plant and SceneGraph.
        plant: finalized plant; by default the system named `plant`.
        scene_graph: SceneGraph to scan; by default the system named
            `scene_graph`.
        lcm_buses: the available buses; `config.lcm_bus` names one of them.
        lcm: interface to publish on, instead of a bus. If both `lcm_buses` and
            `lcm` are None, an interface to the default URL is added.

    Returns:
        The LiDAR system that was added.

    Raises:
        RuntimeError: there is no such plant, SceneGraph, frame or bus, or the
            plant is not finalized.
        ValueError: a field of the config is out of range.

    Example:
        from cns_drake import ApplyLidarConfig, LidarConfig

        ApplyLidarConfig(LidarConfig(name="roof", rate=10), builder)
    """
    check_type("config", config, LidarConfig)
    config.ValidateOrThrow()
    section = config._section()
    period = revolution_at_rate(section.sheet, config.rate, section.columns)
    interface = find_interface(config, builder, lcm_buses, lcm)
    scene_graph = scene_graph or builder.GetSubsystemByName("scene_graph")
    plant = plant or builder.GetSubsystemByName("plant")
    with errors_of(config):
        lidar = add_lidar(
            builder,
            scene_graph,
            *carrier_frame(config, builder, plant),
            name=config.name,
            **make_lidar_model(
                section, config.name, config.seed, period=period
            )._asdict(),
            motion_distortion=section.motion_distortion,
            causal=config.causal,
            rate=config.rate,
            capture_offset=config.capture_offset,
            output_delay=config.output_delay,
            role=_ROLES[config.role],
            unseen=_unseen(config, plant, scene_graph),
            num_threads=config.num_threads,
        )
    publish_measurements(
        config,
        "POINT_CLOUD",
        builder,
        interface,
        [lidar.point_cloud_W_output_port(), lidar.scan_time_output_port()],
        _make_scan_messages(),
        period=lidar.samples.period if lidar.samples else period,
        offset=config.capture_offset + config.output_delay,
        is_cloud=True,
    )
    return lidar


def _unseen(
    config: LidarConfig, plant: MultibodyPlant, scene_graph: SceneGraph
) -> list[Frame | GeometryId] | None:
    """Returns what a LiDAR does not see; None for its own body.

    Raises:
        ValueError: nothing has one of the names.
    """
    if config.unseen is None:
        return None
    inspector = scene_graph.model_inspector()
    geometries: dict[str, list[GeometryId]] = {}
    for geometry_id in inspector.GetAllGeometryIds(_ROLES[config.role]):
        name = inspector.GetName(geometry_id)
        geometries.setdefault(name, []).append(geometry_id)
    unseen: list[Frame | GeometryId] = []
    for name in config.unseen:
        found: list[Frame | GeometryId] = [*geometries.get(name, ())]
        # Drake says of a frame that is missing or ambiguous which there are.
        try:
            found.append(GetScopedFrameByName(plant, name))
        except RuntimeError as error:
            if not found:
                raise ValueError(
                    f"unseen: no body, frame or geometry {name!r}: "
                    f"{one_line(error)}"
                ) from None
        unseen += found
    return unseen
