"""A scenario: all settings of one recorded drive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import operator
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import (
    BaseModel,
    Field,
    PrivateAttr,
    ValidationInfo,
    field_validator,
    model_validator,
)

from cns_drake.motion import RoadProfile, RoughnessClass, Speeds
from cns_drake.sensors import (
    CameraSection,
    Echoes,
    ImuSection,
    LidarSection,
    OdometrySection,
    SensorConfig,
    WeatherConfig,
    check_rate,
    field_off_by_default,
)
from evaluation.base import Name, Section, validated
from evaluation.drives import check_sensor_name
from evaluation.lidar_sheets import LidarSheet
from worlds.shapes import STRUCTURES_NAME, Route

if TYPE_CHECKING:
    # A drive through a world that is no map needs nothing of maps.
    from worlds.maps import MapFolder

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
        "model_paths",
        "world",
        lambda paths, world: world or not paths,
        "for a world only; the stages of a map have their models beside them",
    ),
    (
        "route",
        "world",
        _not_both,
        "a world has no roads, give waypoints instead",
    ),
    (
        "waypoints",
        "route",
        operator.ne,
        "give either a route or waypoints; a world needs waypoints",
    ),
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

# What to do where a map has no recorded traffic, or too little.
SUMO_INSTEAD = "give a trace of SUMO instead, with traffic: {fcd: FILE}"


class RideConfig(Section):
    """How the vehicle's body moves on its springs during the drive.

    Attributes:
        roughness: roughness of the road that shakes the vehicle, as a class of
            ISO 8608 from `A` (new) to `E` (very poor); `none` keeps the vehicle
            steady.
        seed: seed of the random bumps of the road. Drives with the same seed
            have the same bumps.
        crossfall: sideways slope of the road, down to the car's right [m/m];
            0.025 is usual where cars keep right. Needs a `roughness` other than
            `none`.
    """

    roughness: Literal["none", RoughnessClass] = "none"
    seed: int = Field(default=1, ge=0)
    crossfall: float = field_off_by_default(0.0, ge=-0.1, le=0.1)

    @model_validator(mode="after")
    def _check_springs(self) -> RideConfig:
        if self.crossfall and self.roughness == "none":
            raise ValueError("crossfall: it has no effect without roughness")
        return self

    def profile(self) -> RoadProfile | None:
        """Returns the road surface profile; None if the car stays steady."""
        if self.roughness == "none":
            return None
        return RoadProfile(self.roughness, self.seed)


class DriverConfig(Section):
    """How the driver departs from the middle of the lanes.

    Attributes:
        wander: standard deviation of the car's lateral offset from the middle
            of its lane [m], where the road is wide enough. The offset between
            the paths of two such drives has a standard deviation 1.4 times as
            large as `wander`.
        wander_length: distance along the road after which the autocorrelation
            of the lateral offset (`wander`) has fallen to 1/e [m].
        lane_changes: average number of lane changes per kilometre [1/km], where
            there is a neighbouring lane. The car returns to its lane after 15
            to 270 m.
        seed: seed of all random choices of the driver; by default the name of
            the drive.
    """

    wander: float = Field(default=0.0, ge=0.0, le=1.0)
    wander_length: float = Field(default=50.0, ge=20.0, le=1000.0)
    lane_changes: float = Field(default=0.0, ge=0.0, le=10.0)
    seed: int | str | None = None

    @field_validator("seed", mode="before")
    @classmethod
    def _check_seed(cls, seed: Any) -> Any:
        is_number = type(seed) is int and seed >= 0
        if is_number or seed is None or (seed and isinstance(seed, str)):
            return seed
        raise ValueError("give a whole number from 0 on, or a name")

    @property
    def departs(self) -> bool:
        """Whether the driver ever leaves the middle of the lane."""
        return self.wander > 0 or self.lane_changes > 0

    def rng(self, name: str) -> np.random.Generator:
        """Returns the random generator of the driver's decisions.

        Without a seed, the name of the drive is the seed.
        """
        seed = name if self.seed is None else self.seed
        return np.random.default_rng(
            [*seed.encode()] if isinstance(seed, str) else [seed]
        )


# Pairs of drives of Boreas and of MulRan KAIST differ by 0.5 m in a lane, and
# are in different lanes on 10 to 17 % of the way. The correlation of their
# offsets is 1/e at 45 to 55 m; changes of lane shorten it.
REAL_DRIVER = DriverConfig(wander=0.35, wander_length=65.0, lane_changes=9.0)


class TrafficConfig(Section):
    """Vehicles and pedestrians that move while a drive is recorded.

    Attributes:
        vehicles: number of cars, vans, trucks, buses, motorcycles and bicycles
            from the map's recorded traffic, at most 60. The shipped maps have
            recorded traffic of 600 s.
        walkers: number of pedestrians from the map's recorded traffic, at most
            60.
        seed: seed of all random choices: which vehicles and pedestrians, from
            when on in the recorded traffic; kinds, in queues and in a trace
            that names none.
        fcd: file of a SUMO trace (floating-car data) to replay instead;
            `vehicles` and `walkers` must then be 0.
        queues: whether vehicles stand in queues in all lanes, as in a rush
            hour, except where the recording vehicle is. No other traffic is
            then possible.
    """

    vehicles: int = Field(default=0, ge=0)
    walkers: int = Field(default=0, ge=0)
    seed: int = Field(default=1, ge=0)
    fcd: str | None = field_off_by_default(None)
    queues: bool = field_off_by_default(False)

    @model_validator(mode="after")
    def _check_alone(self) -> TrafficConfig:
        if self.fcd is not None and (self.vehicles or self.walkers):
            raise ValueError(
                "fcd: the trace replaces other traffic; give no vehicles and "
                "walkers"
            )
        if self.queues and (self.vehicles or self.walkers or self.fcd):
            raise ValueError(
                "queues: they replace other traffic; give no vehicles, walkers "
                "and fcd"
            )
        return self

    @property
    def is_recorded(self) -> bool:
        """Whether there is some of the map's recorded traffic."""
        return self.vehicles > 0 or self.walkers > 0

    @property
    def is_off(self) -> bool:
        """Whether there is no traffic."""
        return self.fcd is None and not (self.is_recorded or self.queues)


class TransientConfig(Section):
    """Changes to a city that no stage contains, such as snow.

    Most of these changes are temporary; `height_limit` shows the city before it
    grew. `roadsides` is applied first, and the others also change what it adds.
    Else, the effect of each depends only on the seed and on the names of
    structures.

    Attributes:
        seed: seed of all random numbers.
        parked_cars: share of the parked cars that are changed: of these, 30 %
            have left, 20 % stand elsewhere in their bay, and all others are
            replaced.
        leaves: share of the leaves and needles that remain on plants; 0 is
            winter. Wood stays. A shrub that has only leaves keeps a tenth of
            them, as twigs.
        snow: depth of the snow within 120 m of the drive, on surfaces that face
            the sky [m]. Roads are cleared, and banks of snow lie along their
            kerbs.
        scaffolds: share of the building fronts within 30 m of the drive that
            stand behind a scaffold. Four in ten of the scaffolds have a net.
        works: share of the stretches of kerb within 30 m of the drive that have
            road works: fences, skips or diggers beside the road, and a new kerb
            stone that reaches 0.3 m into the road.
        furniture: share of the poles, lamps and signs that are replaced by new
            ones up to 2 m away.
        roadsides: share of the free places beside kerbs, within 30 m of the
            drive, that get hedges, garden walls, bushes, young trees, garages
            or parked cars; each 1 above 1 adds plants once more. Only the cars
            depend on the seed.
        height_limit: greatest height of buildings and plants above their lowest
            point [m]: higher buildings are cut off, with a flat roof, and
            higher plants scaled down.
    """

    seed: int = Field(default=1, ge=0)
    parked_cars: float = Field(default=0.0, ge=0.0, le=1.0)
    leaves: float = Field(default=1.0, ge=0.0, le=1.0)
    snow: float = Field(default=0.0, ge=0.0, le=1.0)
    scaffolds: float = Field(default=0.0, ge=0.0, le=1.0)
    works: float = Field(default=0.0, ge=0.0, le=1.0)
    furniture: float = Field(default=0.0, ge=0.0, le=1.0)
    roadsides: float = field_off_by_default(0.0, ge=0.0, le=10.0)
    height_limit: float | None = field_off_by_default(
        None, gt=2.0, allow_inf_nan=False
    )

    @property
    def is_off(self) -> bool:
        """Whether there are no temporary changes."""
        return self == TransientConfig(seed=self.seed)


# The key of `scattered` that is no class.
_SEED = "seed"


class CityConfig(Section):
    """How the city of a drive differs from its stage.

    Attributes:
        missing: share of the buildings and plants to remove: those nearest to a
            place that the seed selects.
        scattered: structures to remove at random all over the map, in addition
            to `missing`: the share of each class that you name, such as `{pole:
            0.3}`. The key `seed` replaces the seed of the section, so that two
            drives can lack different structures.
        towards: another stage of the map, usually an earlier one. Only
            structures that do not exist in that stage are missing; those that
            exist do not change, even if they have another height there.
        years: number of years by which the city has aged since the last stage
            of the map, which must be the stage of the drive; see
            `cns-drake age`.
        rates: factor by which all rates of change of these years are
            multiplied; or event -> rate per year, of which the key `factor`
            multiplies the rates that are not given.
        redraw: number of a city that is sampled anew along the same streets; by
            default the map's own. A number gives the same city in all drives.
        seed: seed of the random choices of `missing`, `scattered` and `years`.
    """

    missing: float = field_off_by_default(0.0, ge=0.0, le=1.0)
    scattered: dict[str, float] = field_off_by_default({})
    towards: Name | None = field_off_by_default(None)
    years: int = field_off_by_default(0, ge=0, le=200, strict=True)
    rates: float | dict[str, float] = field_off_by_default(1.0)
    redraw: int | None = field_off_by_default(None, ge=0, lt=2**31, strict=True)
    seed: int = Field(default=1, ge=0)

    @field_validator("scattered")
    @classmethod
    def _check_scattered(cls, scattered: dict[str, float]) -> dict[str, float]:
        for kind, share in scattered.items():
            if kind == _SEED:
                if share < 0 or share != int(share):
                    raise ValueError(
                        f"{kind}: {share} is no whole number from 0"
                    )
            elif not 0.0 <= share <= 1.0:
                raise ValueError(f"{kind}: {share} is not from 0 to 1")
        return scattered

    @field_validator("redraw")
    @classmethod
    def _check_redraw(
        cls, redraw: int | None, info: ValidationInfo
    ) -> int | None:
        if redraw is not None and info.data.get("years"):
            raise ValueError("a city drawn anew does not age; leave out years")
        return redraw

    @property
    def shares(self) -> dict[str, float]:
        """Class -> share of its structures that are removed at random."""
        return {n: one for n, one in self.scattered.items() if n != _SEED}

    @property
    def scattered_seed(self) -> int:
        """The seed of the structures that are removed at random."""
        return int(self.scattered.get(_SEED, self.seed))

    @property
    def loses_nothing(self) -> bool:
        """Whether no structure is missing."""
        return not (self.missing or any(self.shares.values()))

    @property
    def is_made(self) -> bool:
        """Whether the city is another map, which must be made."""
        return self.years > 0 or self.redraw is not None

    @property
    def is_off(self) -> bool:
        """Whether the city is that of the stage."""
        return self.loses_nothing and not self.is_made

    @property
    def is_random(self) -> bool:
        """Whether the city depends on the field `seed`."""
        scattered = any(self.shares.values()) and _SEED not in self.scattered
        return self.missing > 0.0 or self.years > 0 or scattered


class OffsetConfig(Section):
    """Where the LiDARs pass, beside where they are mounted on the car.

    It moves the LiDARs of a drive through its world without another route.

    Attributes:
        ahead: how far ahead [m].
        left: how far to the left [m].
        yaw_deg: angle by which they are rotated to the left [deg].
    """

    ahead: float = Field(default=0.0, ge=-100.0, le=100.0)
    left: float = Field(default=0.0, ge=-100.0, le=100.0)
    yaw_deg: float = Field(default=0.0, ge=-360.0, le=360.0)


# The key of `lidars` for every LiDAR of a drive.
_EVERY = "*"


class Scenario(Section):
    """A vehicle with sensors that follows a route through a stage.

    The stage is one of a map, or any SDF world. The vehicle follows lanes of
    the map's roads (`route`) or given points (`waypoints`).

    Attributes:
        name: name of the drive and its files, from letters, digits and
            underscores.
        base: name or file of another drive, which has the values of all fields
            that you leave out here.
        map: name of a shipped map, or a folder with the same layout.
        stage: stage of the map, such as `"01"`.
        world: SDF file of a world to drive in, instead of `map` and `stage`. A
            `world` needs `waypoints`.
        model_paths: folders in which `model://` and `package://` of the `world`
            are searched, before those in GZ_SIM_RESOURCE_PATH.
        without: names of structures to leave out, as in the map's
            `structures.csv`.
        city: how the city differs from the stage: what is missing, how long it
            has aged, or which other city lies along the streets.
        title: one line for readers that says what the drive shows.
        route: lanes to follow, road by road. Give either `route` or
            `waypoints`.
        waypoints: CSV file of points for the car to pass; required with
            `world`. Without a column `z`, the car drives on the ground below
            the points.
        u_turns: whether the car makes a U-turn where the waypoints lead
            straight back, which is an error otherwise.
        aside: lateral offset of the car from the centreline of its lane,
            positive to the right [m]. The offset applies between junctions, as
            far as the road has room.
        speeds: limits of speed and acceleration.
        driver: how the driver leaves the middle of the lane.
        ride: how an uneven road shakes the car.
        traffic: vehicles and pedestrians that move.
        transient: temporary changes to the city, such as other parked cars, or
            snow.
        lidars: LiDARs by name, which is also the name of frame and topic. By
            default there is one, named `lidar`. The fields of the name `*` are
            given to every LiDAR.
        offset: how far the LiDARs pass from where they are mounted.
        cameras: cameras by name, which is also the name of the optical frame (x
            right, y down, z ahead) and the topics.
        imu: the inertial measurement unit.
        weather: fog, rain and snowfall for calibrated returns.
        odometry: how often the vehicle's ground-truth motion is recorded.
        frames: number of frames to record, from the start. A frame is a scan of
            the first LiDAR. By default the whole drive.
        seed: seed of the random noise of all LiDARs and the IMU.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("downtown_01").with_lidar("vlp-16")
    """

    name: Name
    base: str | None = field_off_by_default(None)
    map: str | None = None
    stage: Name | None = _Optional
    world: str | None = _Optional
    model_paths: tuple[str, ...] = field_off_by_default(())
    without: tuple[str, ...] = ()
    city: CityConfig = Field(
        default=CityConfig(), exclude_if=lambda value: value.is_off
    )
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
    offset: OffsetConfig = field_off_by_default(OffsetConfig())
    cameras: dict[Name, CameraSection] = field_off_by_default({})
    imu: ImuSection = ImuSection()
    weather: WeatherConfig = field_off_by_default(WeatherConfig())
    odometry: OdometrySection = field_off_by_default(OdometrySection())
    frames: int | None = Field(default=None, ge=1)
    seed: int = Field(default=0, ge=0)

    # A field -> the fields that a change of it removes.
    replaces: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "world": ("map", "stage", "route", "aside"),
        "map": ("world", "model_paths"),
        "route": ("waypoints", "u_turns"),
        "waypoints": ("route", "aside"),
    }

    # The file of the scenario, and those of its bases.
    _files: tuple[Path, ...] = PrivateAttr(())
    # Folder and stage of the map that was made of `city`.
    _made: tuple[Path, str] | None = PrivateAttr(None)

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

    @field_validator(
        "stage", "world", "model_paths", "route", "waypoints", "u_turns"
    )
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

    @field_validator("lidars", mode="before")
    @classmethod
    def _give_to_every_lidar(cls, lidars: Any) -> Any:
        if not (isinstance(lidars, Mapping) and _EVERY in lidars):
            return lidars
        return _for_every(lidars, ("lidar",) if len(lidars) == 1 else ())

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
        for name, value in self.weather if ideal else ():
            if value:
                raise ValueError(
                    f"weather.{name}: it has no effect on ideal returns; give "
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
        """The folder of the map or, without a map, of the world's file.

        If a city was made for the drive, the map is that of this city.
        """
        from worlds.maps import MapFolder

        if self._made is not None:
            return MapFolder(self._made[0])
        return self.map_folder

    @property
    def map_folder(self) -> MapFolder:
        """The folder of the field `map`, or of the world's file."""
        from worlds.maps import MapFolder, shipped_maps

        if self.world is not None:
            return MapFolder(Path(self.world).parent)
        assert self.map is not None  # Either a map or a world is given.
        return MapFolder(shipped_maps().get(self.map, Path(self.map)))

    @property
    def world_file(self) -> Path:
        """The SDF file of the stage or of the world."""
        if self.world is not None:
            return Path(self.world)
        return self.folder.stage(self.stage_in_folder)

    @property
    def structures(self) -> Path:
        """The table of structures beside that file; it may be missing."""
        return self.world_file.parent / STRUCTURES_NAME

    @property
    def stage_in_folder(self) -> str:
        """The name of the stage in `folder`."""
        return str(self.stage) if self._made is None else self._made[1]

    @property
    def lacks_city(self) -> bool:
        """Whether the city of the drive must be made, and is not."""
        return self.city.is_made and self._made is None

    def in_folder(self, made: tuple[Path, str] | None) -> Scenario:
        """Returns the scenario with its city read from a map that was made.

        The fields stay the same: what is recorded does not depend on the place
        of the folder.

        Args:
            made: folder and stage of the map; None for the field `map`.
        """
        copy = self.replaced()
        copy._made = made
        return copy

    def in_city_of(self, other: Scenario) -> Scenario:
        """Returns the drive through the city of another."""
        copy = self.replaced(map=other.map, stage=other.stage, city=other.city)
        copy._made = other._made
        return copy

    @property
    def fastest_rate(self) -> int:
        """Revolutions per second of the fastest LiDAR."""
        return _fastest_rate(self.lidars)

    @property
    def frame_period(self) -> float:
        """Time between two frames, the scans of the first LiDAR [s]."""
        return 1.0 / next(iter(self.lidars.values())).rate

    @property
    def mounted_lidars(self) -> dict[str, LidarSection]:
        """The LiDARs where they pass: moved by `offset`."""
        ahead, left, yaw_deg = (one for _, one in self.offset)
        if not (ahead or left or yaw_deg):
            return self.lidars
        found = {}
        for name, lidar in self.lidars.items():
            (x, y, z), (roll, pitch, yaw) = lidar.xyz, lidar.rpy_deg
            found[name] = lidar.replaced(
                xyz=(x + ahead, y + left, z),
                rpy_deg=(roll, pitch, yaw + yaw_deg),
            )
        return found

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
                `route` and `aside`. Of a LiDAR, setting `unit` removes
                `preset`, setting `preset` removes `unit`, and each of them
                removes `rings`, `columns`, `min_range` and `max_range`.
            source: the file or argument that error messages name.

        Raises:
            InputError: a field is unknown, or its value is not usable.
        """
        if isinstance(lidars := changes.get("lidars"), Mapping):
            changes = {**changes, "lidars": _for_every(lidars, self.lidars)}
        scenario = validated(Scenario, _merged(self, changes), source)
        scenario._files = self._files
        return scenario

    def with_traffic(self, number: int) -> Scenario:
        """Returns the scenario with this number of vehicles and of walkers.

        Raises:
            InputError: there cannot be so many.
        """
        seed = self.traffic.seed
        values = {"vehicles": number, "walkers": number, "seed": seed}
        return self.replaced(
            traffic=validated(TrafficConfig, values, f"{self.source}: traffic")
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

    def with_lidar(self, unit: str | Path | LidarSheet) -> Scenario:
        """Returns the scenario with every LiDAR replaced by another model.

        The LiDARs keep their poses and all settings of the measurement.

        Args:
            unit: name of the model's preset, such as `vlp-16`, the file of
                its data sheet, or its data sheet.

        Raises:
            InputError: there is no such preset, or the file is no data sheet.
        """
        lidars = self.lidars.items()
        return self.replaced(
            lidars={name: lidar.with_lidar(unit) for name, lidar in lidars}
        )


def _merged(
    values: Mapping[str, Any] | BaseModel, changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Returns fields with changes; see `Scenario.with_fields`."""
    merged = dict(values)
    replaces = getattr(values, "replaces", {})
    removed = [other for field in changes for other in replaces.get(field, ())]
    for field, change in {**dict.fromkeys(removed), **changes}.items():
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


def _for_every(
    lidars: Mapping[str, Any], names: Iterable[str]
) -> dict[str, Any]:
    """Returns fields of LiDARs, with those of `*` under each name.

    Args:
        lidars: name -> fields of the LiDAR, or None for no such LiDAR.
        names: further names of LiDARs.
    """
    every = lidars.get(_EVERY)
    found = {name: one for name, one in lidars.items() if name != _EVERY}
    if not isinstance(every, Mapping):
        return dict(lidars)
    for name in dict.fromkeys([*found, *names]):
        own = found.get(name, {})
        if isinstance(own, Mapping):
            found[name] = {**every, **own}
    return found


def _fastest_rate(lidars: dict[str, LidarSection]) -> int:
    """Returns the revolutions per second of the fastest LiDAR."""
    return max(config.rate for config in lidars.values())


def _is_given(value: object) -> bool:
    """Returns whether a value is neither None, False, zero nor empty."""
    return value is not None and value not in (0, ())
