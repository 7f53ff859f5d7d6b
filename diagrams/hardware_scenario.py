"""Runs a scenario of models, drivers, cameras and LiDARs from one YAML file.

Messages come and go on LCM, as with hardware; Meldis shows them.
"""

from dataclasses import dataclass, field
import math
from pathlib import Path
from typing import Annotated

import numpy as np
from pydrake.common.yaml import yaml_load_typed
from pydrake.lcm import DrakeLcmParams
from pydrake.manipulation import (
    ApplyDriverConfigs,
    IiwaDriver,
    SchunkWsgDriver,
    ZeroForceDriver,
)
from pydrake.multibody.parsing import (
    ModelDirective,
    ModelDirectives,
    ModelInstanceInfo,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
)
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import ApplyLcmBusConfig, LcmBuses
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ApplyCameraConfig, CameraConfig
from pydrake.visualization import ApplyVisualizationConfig, VisualizationConfig
import typer

from cns_drake import (
    ApplyImuConfig,
    ApplyLidarConfig,
    ApplyOdometryConfig,
    ImuConfig,
    LidarConfig,
    OdometryConfig,
)

HERE = Path(__file__).resolve().parent
PACKAGES = (HERE / "models", HERE.parent / "cns_drake/motion/vehicle")


@dataclass
class WheelDriver:
    """Turns wheels at constant speeds [rad/s], by a gain [N m s/rad]."""

    speeds: dict[str, float] = field(default_factory=dict)
    gain: float = 5.0


@dataclass
class Scenario:
    """What the file holds; each section is optional."""

    duration: float = math.inf
    simulator_config: SimulatorConfig = field(
        default_factory=lambda: SimulatorConfig(target_realtime_rate=1.0)
    )
    plant_config: MultibodyPlantConfig = field(
        default_factory=lambda: MultibodyPlantConfig(time_step=0.002)
    )
    directives: list[ModelDirective] = field(default_factory=list)
    lcm_buses: dict[str, DrakeLcmParams | None] = field(
        default_factory=lambda: {"default": DrakeLcmParams()}
    )
    model_drivers: dict[
        str, IiwaDriver | SchunkWsgDriver | WheelDriver | ZeroForceDriver
    ] = field(default_factory=dict)
    cameras: dict[str, CameraConfig] = field(default_factory=dict)
    lidars: dict[str, LidarConfig] = field(default_factory=dict)
    imus: dict[str, ImuConfig] = field(default_factory=dict)
    odometry: dict[str, OdometryConfig] = field(default_factory=dict)
    visualization: VisualizationConfig = field(
        default_factory=lambda: VisualizationConfig(
            enable_meshcat_creation=False
        )
    )


def ApplyDriverConfig(
    driver: WheelDriver,
    model_instance_name: str,
    plant: MultibodyPlant,
    models: dict[str, ModelInstanceInfo],
    lcm_buses: LcmBuses,
    builder: DiagramBuilder,
) -> None:
    """Adds a driver; `ApplyDriverConfigs` calls it for each `WheelDriver`."""
    model = plant.GetModelInstanceByName(model_instance_name)
    names = [
        plant.get_joint_actuator(index).joint().name()
        for index in plant.GetJointActuatorIndices(model)
    ]
    speeds = [driver.speeds.get(name, 0.0) for name in names]
    source = ConstantVectorSource(np.hstack([np.zeros(len(names)), speeds]))
    builder.AddSystem(source)
    target = plant.get_desired_state_input_port(model)
    builder.Connect(source.get_output_port(), target)


def make_simulator(scenario: Scenario) -> Simulator:
    """Builds the Diagram of a scenario, and its Simulator."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(scenario.plant_config, builder)
    parser = Parser(plant)
    for package in PACKAGES:
        parser.package_map().AddPackageXml(str(package / "package.xml"))
    models = ProcessModelDirectives(
        ModelDirectives(directives=scenario.directives), parser
    )
    for name, driver in scenario.model_drivers.items():
        # Gains are part of the model, which ends with Finalize.
        if isinstance(driver, WheelDriver):
            model = plant.GetModelInstanceByName(name)
            for wheel in driver.speeds:
                actuator = plant.GetJointActuatorByName(wheel, model)
                gains = PdControllerGains(p=0.0, d=driver.gain)
                actuator.set_controller_gains(gains)
    plant.Finalize()
    buses = ApplyLcmBusConfig(scenario.lcm_buses, builder)
    ApplyDriverConfigs(
        driver_configs=scenario.model_drivers,
        sim_plant=plant,
        models_from_directives=models,
        lcm_buses=buses,
        builder=builder,
    )
    for apply, configs in (
        (ApplyCameraConfig, scenario.cameras),
        (ApplyLidarConfig, scenario.lidars),
        (ApplyImuConfig, scenario.imus),
        (ApplyOdometryConfig, scenario.odometry),
    ):
        for config in configs.values():
            apply(
                config,
                builder,
                plant=plant,
                scene_graph=scene_graph,
                lcm_buses=buses,
            )
    ApplyVisualizationConfig(scenario.visualization, builder, buses, plant)
    simulator = Simulator(builder.Build())
    ApplySimulatorConfig(scenario.simulator_config, simulator)
    return simulator


def main(
    scenario_file: Annotated[Path, typer.Argument()],
    duration: Annotated[float | None, typer.Option(help="Seconds.")] = None,
) -> None:
    text = scenario_file.read_text()
    scenario = yaml_load_typed(schema=Scenario, data=text, defaults=Scenario())
    simulator = make_simulator(scenario)
    end = scenario.duration if duration is None else duration
    simulator.AdvanceTo(end)
    print(f"simulated {simulator.get_context().get_time():g} s")


if __name__ == "__main__":
    typer.run(main)
