"""A scenario: all settings of one recorded drive."""

from __future__ import annotations

from collections.abc import Mapping
import operator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    Field,
    PrivateAttr,
    StringConstraints,
    ValidationInfo,
    field_validator,
    model_validator,
)

from cns_drake.base import validated
from cns_drake.drives import check_sensor_name
from cns_drake.roads import Route, Speeds
from cns_drake.scenarios.sections import (
    REAL_DRIVER,
    DriverConfig,
    RideConfig,
    TrafficConfig,
    TransientConfig,
)
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.scene import MapFolder
from cns_drake.sensors import (
    CameraSection,
    Echoes,
    ImuSection,
    LidarSection,
    OdometrySection,
    Section,
    SensorConfig,
    WeatherConfig,
    check_rate,
    field_off_by_default,
)

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_]*$")]
# Defaults are validated as well, because a rule may depend on another field.
_Optional = Field(default=None, validate_default=True)
# Names of systems and ports in a drive's Diagram that no sensor can have.
_SYSTEMS = (
    "scene_graph",
    "vehicle_motion",
    "geometry_pose",
    "traffic",
    "frame_poses",
    "camera_scene",
    "camera_colours",
    "camera_classes",
    "mcap_recorder",
    "meshcat_recorder",
    "geometry_query",
    "specific_force",
    "angular_velocity",
    "imu_samples",
)
# Endings of the names of systems and ports that belong to a LiDAR.
_OF_LIDARS = ("scan", "sweep", "pose")
# Endings of the names of systems and ports that belong to a camera.
_OF_CAMERAS = ("image", "camera_info", "depth", "label")


def _not_both(one: bool, other: bool) -> bool:
    return not (one and other)


# Two fields, the second declared before the first; a function that says whether
# the two may be combined, given whether each is set; the error if not.
_ALTERNATIVES: tuple[tuple[str, str, Any, str], ...] = (
    ("stage", "map", operator.eq, "give a map and its stage together"),
    (
        "world",
        "map",
        operator.ne,
        "give either a map and its stage, or a world",
    ),
    (
        "route",
        "world",
        _not_both,
        "a world has no roads, give waypoints instead",
    ),
    ("waypoints", "route", operator.ne, "give either a route or waypoints"),
    (
        "waypoints",
        "aside",
        _not_both,
        "aside is for a route only; with waypoints, move these instead",
    ),
    (
        "u_turns",
        "route",
        _not_both,
        "is for waypoints only; a route turns round where the next leg leads "
        "back on its road",
    ),
)
# Field -> fields that are removed when it is set.
_REPLACED: dict[str, tuple[str, ...]] = {
    "world": ("map", "stage", "route", "aside"),
    "map": ("world",),
    "route": ("waypoints", "u_turns"),
    "waypoints": ("route", "aside"),
}


class Scenario(Section):
    """A vehicle with sensors that follows a route through a stage.

    The vehicle drives in a stage of a map, or in any SDF world. The vehicle
    follows either lanes of the map's roads (`route`) or given points
    (`waypoints`).

    Attributes:
        name: name of the drive and its files, from letters, digits and
            underscores.
        base: name or file of another drive. Fields that you leave out here have
            the values of this base drive.
        map: name of a shipped map, or a folder with the same layout.
        stage: stage of the map, such as `"01"`.
        world: SDF file of a world to drive in, instead of `map` and `stage`. A
            `world` needs `waypoints`.
        without: names of structures to leave out of the world; the names are in
            the map's `structures.csv`.
        title: one line for readers that says what the drive shows.
        route: lanes to follow, road by road. Give either `route` or
            `waypoints`.
        waypoints: CSV file of points for the car to pass. Required with
            `world`, because an SDF world has no roads.
        u_turns: whether the car makes a U-turn where the waypoints lead
            straight back. Without `u_turns`, such waypoints are an error.
        aside: lateral offset of the car from the centreline of its lane,
            positive to the right [m]. The offset applies between junctions, as
            far as the road has room.
        speeds: limits of speed and acceleration.
        driver: how the driver leaves the middle of the lane.
        ride: how an uneven road shakes the car.
        traffic: vehicles and pedestrians that move.
        transient: temporary changes to the city, such as other parked cars, or
            snow.
        lidars: LiDARs by name. The name of a LiDAR is also the name of its
            frame and its topic. By default there is one LiDAR, named `lidar`.
        cameras: cameras by name. The name of a camera is also the name of its
            optical frame (x right, y down, z ahead) and its topics. By default
            there is no camera.
        imu: the inertial measurement unit.
        weather: fog, rain and snowfall for calibrated returns.
        odometry: how often the vehicle's ground-truth motion is recorded.
        frames: number of frames to record, from the start. A frame is a scan of
            the first LiDAR. By default the whole drive.
        seed: seed of the random noise of all LiDARs and the IMU.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("downtown_01").with_lidar_preset("vlp-16")
    """

    name: Name
    base: str | None = field_off_by_default(None)
    map: str | None = None
    stage: Name | None = _Optional
    world: str | None = _Optional
    without: tuple[str, ...] = ()
    title: str = ""
    route: Route | None = None
    aside: float = Field(default=0.0, ge=-3.0, le=3.0)
    waypoints: str | None = _Optional
    u_turns: bool = False
    speeds: Speeds
    driver: DriverConfig = field_off_by_default(DriverConfig())
    ride: RideConfig = field_off_by_default(RideConfig())
    traffic: TrafficConfig = field_off_by_default(TrafficConfig())
    transient: TransientConfig = Field(
        default=TransientConfig(), exclude_if=lambda value: value.is_off
    )
    lidars: dict[Name, LidarSection] = Field(
        default={"lidar": LidarSection()}, min_length=1
    )
    cameras: dict[Name, CameraSection] = field_off_by_default({})
    imu: ImuSection = ImuSection()
    weather: WeatherConfig = field_off_by_default(WeatherConfig())
    odometry: OdometrySection = field_off_by_default(OdometrySection())
    frames: int | None = Field(default=None, ge=1)
    seed: int = Field(default=0, ge=0)

    # The file of the scenario, and those of its bases.
    _files: tuple[Path, ...] = PrivateAttr(())

    @field_validator("base")
    @classmethod
    def _check_base(cls, base: str | None) -> None:
        if base is not None:
            raise ValueError("only a scenario file has one")

    @field_validator("stage", mode="before")
    @classmethod
    def _check_stage(cls, stage: Any) -> Any:
        # Stages are numbered with two digits, and YAML takes 2 for a number.
        if type(stage) is int:
            raise ValueError(f'not a text; quote it: stage: "{stage:02d}"')
        return stage

    @field_validator("stage", "world", "route", "waypoints", "u_turns")
    @classmethod
    def _check_alternatives(cls, value: Any, info: ValidationInfo) -> Any:
        for field, other, fits, fault in _ALTERNATIVES:
            # An invalid earlier field has its own error.
            if field == info.field_name and other in info.data:
                given = _is_given(value), _is_given(info.data[other])
                if not fits(*given):
                    raise ValueError(fault)
        return value

    @field_validator("driver")
    @classmethod
    def _check_driver(
        cls, driver: DriverConfig, info: ValidationInfo
    ) -> DriverConfig:
        if driver.lane_changes and info.data.get("waypoints") is not None:
            raise ValueError(
                "waypoints have no lanes for lane_changes; give a route"
            )
        return driver

    @field_validator("lidars")
    @classmethod
    def _check_scan_rates(cls, lidars: dict) -> dict:
        # Every scan has the odometry of its own time.
        fastest = _fastest_rate(lidars)
        for name, lidar in lidars.items():
            if fastest % lidar.rate:
                raise ValueError(
                    f"{name}.rate: {lidar.rate} does not divide {fastest}, the "
                    "rate of the fastest LiDAR"
                )
        return lidars

    @field_validator("imu", "odometry")
    @classmethod
    def _check_sample_rate(cls, section: Any, info: ValidationInfo) -> Any:
        if section.rate is not None and "lidars" in info.data:
            fastest = _fastest_rate(info.data["lidars"])
            # Every scan needs its own pose.
            step = fastest if info.field_name == "odometry" else 1
            check_rate(section.rate, fastest, multiple_of=step)
        return section

    @model_validator(mode="after")
    def _check_names(self) -> Scenario:
        """Checks that sensors have names of their own, also as systems."""
        taken = set(_SYSTEMS)
        taken |= {f"{name}_{of}" for name in self.lidars for of in _OF_LIDARS}
        taken |= {f"{name}_{of}" for name in self.cameras for of in _OF_CAMERAS}
        for field, names in (
            ("lidars", self.lidars),
            ("sensors", self.further_sensors),
            ("cameras", self.cameras),
        ):
            for name in names:
                try:
                    check_sensor_name(name, taken)
                except ValueError as error:
                    raise ValueError(f"{field}: {error}") from None
                taken.add(name)
        return self

    @model_validator(mode="after")
    def _check_further_sensors(self) -> Scenario:
        for sensor in self.further_sensors.values():
            if sensor.rate is not None:
                check_rate(sensor.rate, self.fastest_rate)
        return self

    @model_validator(mode="after")
    def _check_cameras(self) -> Scenario:
        frame_rate = next(iter(self.lidars.values())).rate
        for name, camera in self.cameras.items():
            if frame_rate % camera.rate:
                raise ValueError(
                    f"cameras.{name}.rate: {camera.rate} does not divide "
                    f"{frame_rate}, the rate of the first LiDAR"
                )
        return self

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
        """The scenario's file, or else its name; used in error messages."""
        return str(self._files[0] if self._files else self.name)

    @property
    def files(self) -> tuple[Path, ...]:
        """The scenario's own file, and those that it builds on (`base`)."""
        return self._files

    @property
    def folder(self) -> MapFolder:
        """The folder of the map or, without a map, of the world's file."""
        if self.world is not None:
            return MapFolder(Path(self.world).parent)
        assert self.map is not None  # Either a map or a world is given.
        return MapFolder(shipped_maps().get(self.map, Path(self.map)))

    @property
    def world_file(self) -> Path:
        """The SDF file of the stage or of the world."""
        if self.world is not None:
            return Path(self.world)
        return self.folder.stage(str(self.stage))

    @property
    def fastest_rate(self) -> int:
        """Revolutions per second of the fastest LiDAR."""
        return _fastest_rate(self.lidars)

    @property
    def frame_period(self) -> float:
        """Time between two frames, the scans of the first LiDAR [s]."""
        return 1.0 / next(iter(self.lidars.values())).rate

    @property
    def further_sensors(self) -> dict[str, SensorConfig]:
        """Sensors of user-defined kinds, by the name of their field."""
        return {
            n: section
            for n, section in self
            if isinstance(section, SensorConfig)
        }

    def with_returns(
        self,
        returns: Literal["ideal", "calibrated"],
        weather: WeatherConfig | None = None,
    ) -> Scenario:
        """Returns the scenario with another model of every LiDAR's returns.

        Args:
            returns: `ideal` or `calibrated`. With `calibrated`, the settings
                for noise and losses of ideal returns are removed; with `ideal`,
                weather, echoes and errors of the unit are removed.
            weather: the weather; by default the scenario's own weather.
        """
        if returns == "ideal":
            update: dict = {"returns": returns, "echoes": Echoes.STRONGEST}
            update["unit_seed"] = 0
            weather = WeatherConfig()
        else:
            ideal_fields = ("range_noise", "dropout", "faint_dropout")
            update = {"returns": returns, **dict.fromkeys(ideal_fields, 0.0)}
        lidars = {
            n: lidar.replaced(**update) for n, lidar in self.lidars.items()
        }
        return self.replaced(lidars=lidars, weather=weather or self.weather)

    def with_fields(
        self, changes: Mapping[str, Any], source: object
    ) -> Scenario:
        """Returns the scenario with other values of some fields.

        In a section, and among the LiDARs, only the given entries change. A
        list is replaced as a whole. The value None restores the default.

        Args:
            changes: field -> new value, or a mapping of the changes in a
                section. Setting `world` removes `map`, `stage`, `route` and
                `aside`, setting `map` removes `world`, setting `route` removes
                `waypoints` and `u_turns`, and setting `waypoints` removes
                `route` and `aside`.
            source: the file or argument that error messages name.

        Raises:
            InputError: a field is unknown, or its value is not usable.
        """
        replaced = [n for field in changes for n in _REPLACED.get(field, ())]
        values = _merged(self, {**dict.fromkeys(replaced), **changes})
        scenario = validated(Scenario, values, source)
        scenario._files = self._files
        return scenario

    def with_traffic(self, number: int) -> Scenario:
        """Returns the scenario with this number of vehicles and of walkers."""
        seed = self.traffic.seed
        return self.replaced(
            traffic=TrafficConfig(vehicles=number, walkers=number, seed=seed)
        )

    def with_transient(self, **changes: float | str) -> Scenario:
        """Returns the scenario with other values of some temporary changes.

        Args:
            changes: values of switches in the section `transient`, such as
                `snow=0.25`.

        Raises:
            InputError: there is no such switch, or its value is not usable.
        """
        return self.with_fields({"transient": changes}, self.source)

    def with_driver(self, driver: Literal["real", "none"]) -> Scenario:
        """Returns the scenario with another driver.

        Args:
            driver: `none` for a driver who stays in the middle of the lane, or
                `real` for a driver who wanders and changes lanes as in
                published drives. Along waypoints, which have no lanes, the
                driver `real` only wanders. The driver `real` keeps the
                scenario's seed of the driver.
        """
        if driver == "none":
            return self.replaced(driver=DriverConfig())
        chosen = REAL_DRIVER.replaced(seed=self.driver.seed)
        if self.waypoints is not None:
            chosen = chosen.replaced(lane_changes=0.0)
        return self.replaced(driver=chosen)

    def with_lidar_preset(self, preset: str) -> Scenario:
        """Returns the scenario with every LiDAR replaced by another model.

        The LiDARs keep their poses and all settings of the measurement.

        Args:
            preset: name of the model's preset, such as `vlp-16`.

        Raises:
            InputError: there is no such preset.
        """
        units = self.lidars.items()
        return self.replaced(
            lidars={name: lidar.with_preset(preset) for name, lidar in units}
        )


def _merged(
    values: Mapping[str, Any] | BaseModel, changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Returns fields with changes; see `Scenario.with_fields`."""
    merged = dict(values)
    for field, change in changes.items():
        if change is None:
            merged.pop(field, None)
        elif isinstance(change, Mapping):
            old = merged.get(field)
            if not isinstance(old, Mapping | BaseModel):
                old = {}
            merged[field] = _merged(old, change)
        else:
            merged[field] = change
    return merged


def _fastest_rate(lidars: dict[str, LidarSection]) -> int:
    """Returns the revolutions per second of the fastest LiDAR."""
    return max(config.rate for config in lidars.values())


def _is_given(value: object) -> bool:
    """Returns whether a value is neither None, False nor zero."""
    return value is not None and value != 0
