"""A scenario: all settings of one recorded drive."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    Field,
    PrivateAttr,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from cns_drake.base.errors import InputError, describe_validation_error
from cns_drake.motion.speeds import Speeds
from cns_drake.roads.route import Route
from cns_drake.scenarios.alternatives import (
    given_instead_of,
    given_with,
    never_given_with,
)
from cns_drake.scenarios.imu_config import ImuConfig
from cns_drake.scenarios.lidar_config import LidarConfig
from cns_drake.scenarios.odometry_config import OdometryConfig
from cns_drake.scenarios.rates import check_rate, fastest_rate
from cns_drake.scenarios.ride_config import RideConfig
from cns_drake.scenarios.section import Name, Section, field_off_by_default
from cns_drake.scenarios.traffic_config import TrafficConfig
from cns_drake.scenarios.transient_config import TransientConfig
from cns_drake.scenarios.weather_config import WeatherConfig
from cns_drake.sensors.returns.echo_choice import Echoes

# Defaults are checked as well: another field may require one.
_Optional = Field(default=None, validate_default=True)


class Scenario(Section):
    """A vehicle with sensors that follows a route through a stage.

    The vehicle drives either in a stage of a map or in any SDF world. It
    follows either lanes of the map's roads or waypoints.

    Attributes:
        name: name of the drive and its files; letters, digits and
            underscores.
        map: a shipped map, or a folder laid out like one.
        stage: stage of the map.
        world: any SDF file, in place of `map` and `stage`.
        without: names of structures to leave out, as in `structures.csv`.
        title: what the drive shows, in words.
        route: the lanes to follow, leg by leg; give this or `waypoints`.
        waypoints: a CSV file of places to pass; needed with a world, which has
            no roads.
        u_turns: whether the car turns round where waypoints double back.
        aside: offset of the car to the right of its lanes' middle between
            junctions, within the room of the road; to the left if negative, at
            most 3 [m].
        speeds: speed and acceleration.
        ride: motion of the car by springs and the road.
        traffic: moving vehicles and walkers.
        transient: passing changes since the stage was built.
        lidars: name -> LiDAR; frame and topic have this name; by default one
            named `lidar`.
        imu: the IMU.
        weather: fog, rain and snowfall for calibrated returns.
        odometry: the odometry.
        frames: number of frames to record, the scans of the first LiDAR; by
            default the whole drive.
        seed: seed of the noise of LiDARs and the IMU.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("downtown_01").with_lidar_preset("vlp-16")
    """

    name: Name
    map: str | None = None
    stage: Annotated[
        Name | None, given_with("map", "give a map and its stage together")
    ] = _Optional
    world: Annotated[
        str | None,
        given_instead_of("map", "give either a map and its stage, or a world"),
    ] = _Optional
    without: tuple[str, ...] = ()
    title: str = ""
    route: Annotated[
        Route | None,
        never_given_with(
            "world", "a world has no roads, give waypoints instead"
        ),
    ] = None
    aside: float = Field(default=0.0, ge=-3.0, le=3.0)
    waypoints: Annotated[
        str | None,
        given_instead_of("route", "give either a route or waypoints"),
        never_given_with(
            "aside",
            "aside is for a route only; with waypoints, move these instead",
        ),
    ] = _Optional
    u_turns: Annotated[
        bool,
        never_given_with(
            "route",
            "is for waypoints only; a route turns round where the next leg "
            "leads back on its road",
        ),
    ] = False
    speeds: Speeds
    ride: RideConfig = field_off_by_default(RideConfig())
    traffic: TrafficConfig = field_off_by_default(TrafficConfig())
    transient: TransientConfig = Field(
        default=TransientConfig(), exclude_if=lambda value: value.is_off
    )
    lidars: dict[Name, LidarConfig] = Field(
        default={"lidar": LidarConfig()}, min_length=1
    )
    imu: ImuConfig = ImuConfig()
    weather: WeatherConfig = field_off_by_default(WeatherConfig())
    odometry: OdometryConfig = field_off_by_default(OdometryConfig())
    frames: int | None = Field(default=None, ge=1)
    seed: int = Field(default=0, ge=0)

    # The file of the scenario.
    _file: Path | None = PrivateAttr(None)

    @field_validator("lidars")
    @classmethod
    def _check_frames_differ(cls, lidars: dict) -> dict:
        taken = {"map", "base_link", "imu"} & lidars.keys()
        if taken:
            raise ValueError(f"'{taken.pop()}' is the name of another frame")
        return lidars

    @field_validator("imu")
    @classmethod
    def _check_imu_rate(cls, imu: ImuConfig, info: ValidationInfo) -> ImuConfig:
        if imu.rate is not None and "lidars" in info.data:
            check_rate(imu.rate, fastest_rate(info.data["lidars"]))
        return imu

    @field_validator("odometry")
    @classmethod
    def _check_odometry_rate(
        cls, odometry: OdometryConfig, info: ValidationInfo
    ) -> OdometryConfig:
        if odometry.rate is not None and "lidars" in info.data:
            # Every scan needs its own pose.
            fastest = fastest_rate(info.data["lidars"])
            check_rate(odometry.rate, fastest, multiple_of=fastest)
        return odometry

    @model_validator(mode="after")
    def _check_weather(self) -> Scenario:
        ideal = [n for n, c in self.lidars.items() if c.returns == "ideal"]
        if ideal and self.weather != WeatherConfig():
            raise ValueError(
                "weather: it has no effect on ideal returns; give "
                f"lidars.{ideal[0]}.returns: calibrated"
            )
        return self

    def __eq__(self, other: object) -> bool:
        """Returns whether two scenarios are the same, read from any file."""
        if not isinstance(other, Scenario):
            return NotImplemented
        return self.__dict__ == other.__dict__

    @property
    def source(self) -> str:
        """The beginning of errors: the scenario's file, or else its name."""
        return str(self._file or self.name)

    def with_returns(
        self,
        returns: Literal["ideal", "calibrated"],
        weather: WeatherConfig | None = None,
    ) -> Scenario:
        """Returns the scenario with other returns of every LiDAR.

        Args:
            returns: see `LidarConfig`. Calibrated returns drop the noise and
                losses of ideal ones; ideal returns drop the weather.
            weather: in place of the scenario's.
        """
        if returns == "ideal":
            update: dict = {"returns": returns, "echoes": Echoes.STRONGEST}
            weather = WeatherConfig()
        else:
            ideal_fields = ("range_noise", "dropout", "faint_dropout")
            update = {"returns": returns, **dict.fromkeys(ideal_fields, 0.0)}
        lidars = {
            name: config.model_copy(update=update)
            for name, config in self.lidars.items()
        }
        return self.model_copy(
            update={"lidars": lidars, "weather": weather or self.weather}
        )

    def with_traffic(self, number: int) -> Scenario:
        """Returns the scenario with other traffic, of the same seed.

        Args:
            number: of vehicles, and of walkers.
        """
        traffic = TrafficConfig(
            vehicles=number, walkers=number, seed=self.traffic.seed
        )
        return self.model_copy(update={"traffic": traffic})

    def with_transient(self, **changes: float | str) -> Scenario:
        """Returns the scenario with some switches of `transient` set.

        Raises:
            InputError: there is no such switch, or its value is not usable.
        """
        values = self.transient.model_dump() | changes
        try:
            transient = TransientConfig.model_validate(values)
        except ValidationError as error:
            raise InputError(
                describe_validation_error(
                    f"{self.source}: transient", error, TransientConfig
                )
            ) from None
        return self.model_copy(update={"transient": transient})

    def with_lidar_preset(self, preset: str) -> Scenario:
        """Returns the scenario with the unit of every LiDAR replaced.

        Their places and settings of measurement stay as they are.

        Raises:
            InputError: there is no such preset.
        """
        lidars = {
            name: config.with_preset(preset)
            for name, config in self.lidars.items()
        }
        return self.model_copy(update={"lidars": lidars})
