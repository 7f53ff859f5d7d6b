"""A scenario: everything that one recorded sequence depends on."""

from __future__ import annotations

import math
import os
from pathlib import Path
import re
from typing import Annotated

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PrivateAttr,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.base.errors import (
    InputError,
    describe_validation_error,
)
from cns_drake.base.yaml_files import read_yaml
from cns_drake.motion.speed_profile import Speeds
from cns_drake.recording.frame_clock import FRAME_PERIOD
from cns_drake.roads.route import Route
from cns_drake.scenarios.shipped import (
    sequence_name,
    shipped_maps,
    shipped_sequences,
)
from cns_drake.sensors.beam_pattern import BeamPattern
from cns_drake.sensors.lidar_presets import LIDAR_PRESETS, make_beam_pattern
from cns_drake.sensors.measurement import MeasurementModel

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_]*$")]
# On a vehicle nothing is farther, and rays are cast in single precision [m].
Place = Annotated[float, Field(ge=-1000.0, le=1000.0)]
Triple = tuple[Place, Place, Place]
Angle = Annotated[float, Field(ge=-3600.0, le=3600.0)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Mount(_Model):
    """Where a sensor sits on the vehicle.

    Attributes:
        xyz: position in base_link [m].
        rpy_deg: roll, pitch, yaw in base_link [deg].
    """

    xyz: Triple
    rpy_deg: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)

    def pose(self) -> RigidTransform:
        """Returns the sensor's pose in base_link."""
        roll, pitch, yaw = map(math.radians, self.rpy_deg)
        return RigidTransform(RollPitchYaw(roll, pitch, yaw), self.xyz)


class LidarConfig(Mount):
    """A LiDAR.

    Attributes:
        preset: which unit, a key of `LIDAR_PRESETS`.
        columns: columns in a turn, in place of the preset's.
        min_range: nearest range, in place of the preset's [m].
        max_range: farthest range, in place of the preset's [m].
        resolution: step of the coordinates [m]; 0 records what was cast.
        range_noise: standard deviation of the ranges [m].
        dropout: probability that a return is lost.
        faint_dropout: probability that a return of no intensity is lost,
            falling linearly with intensity to none for full intensity.
        motion_distortion: whether each column is cast from the sensor's pose
            at its own firing time, instead of all from that at the stamp.
    """

    xyz: Triple = (0.0, 0.0, 1.6)
    preset: str = "cns"
    columns: int | None = Field(default=None, ge=4, le=8192)
    min_range: float | None = Field(default=None, ge=0.0)
    max_range: float | None = Field(default=None, gt=0.0, le=1000.0)
    # About what real units resolve; a third less to store than exact values.
    resolution: float = Field(default=2.0**-10, ge=0.0, le=1.0)
    range_noise: float = Field(default=0.0, ge=0.0, le=10.0)
    dropout: float = Field(default=0.0, ge=0.0, le=1.0)
    faint_dropout: float = Field(default=0.0, ge=0.0, le=1.0)
    motion_distortion: bool = False

    @model_validator(mode="after")
    def _returns_something(self) -> LidarConfig:
        if self.columns and LIDAR_PRESETS[self.preset].num_columns is None:
            raise ValueError(f"the preset '{self.preset}' has no columns")
        pattern = self.pattern()
        if pattern.min_range >= pattern.max_range:
            raise ValueError(
                f"min_range {pattern.min_range:g} is not below max_range "
                f"{pattern.max_range:g}"
            )
        return self

    @field_validator("preset")
    @classmethod
    def _known(cls, preset: str) -> str:
        if preset not in LIDAR_PRESETS:
            known = ", ".join(LIDAR_PRESETS)
            raise ValueError(f"unknown preset '{preset}'; known: {known}")
        return preset

    def pattern(self) -> BeamPattern:
        """Returns the beams of one turn, which takes one frame."""
        return make_beam_pattern(
            self.preset,
            FRAME_PERIOD,
            num_columns=self.columns,
            min_range=self.min_range,
            max_range=self.max_range,
        )

    def measurement(self, name: str, seed: int) -> MeasurementModel:
        """Returns what the LiDAR of a name makes of true ranges.

        Args:
            name: of the LiDAR.
            seed: of the scenario.
        """
        return MeasurementModel(
            resolution=self.resolution,
            range_noise=self.range_noise,
            dropout=self.dropout,
            faint_dropout=self.faint_dropout,
            seed=seed,
            sensor_name=name,
        )

    def with_preset(self, preset: str) -> LidarConfig:
        """Returns another unit in the same place that measures alike.

        Raises:
            InputError: the preset is not known.
        """
        unit = make_lidar_config(preset)
        unit_fields = ("preset", "columns", "min_range", "max_range")
        return self.model_copy(
            update={field: getattr(unit, field) for field in unit_fields}
        )


class ImuConfig(Mount):
    """An ideal IMU."""

    xyz: Triple = (-1.0, 0.0, 1.6)


class Scenario(_Model):
    """A vehicle with sensors that follows a route through a stage.

    Where it drives is either a map and its stage or any SDF world; how, it
    is either told by lanes of the map's roads or by waypoints.

    Attributes:
        name: of the sequence; file and folder names derive from it.
        map: name of a shipped map, or the path of a folder laid out like
            one (`roads.yaml`, `stage_<stage>.sdf`, `structures.csv`).
        stage: which stage of the map.
        world: an SDF file instead, with visuals for the LiDAR.
        without: names of structures that are left out of it.
        title: what the sequence shows, in words.
        route: the lanes to follow.
        aside: how far to the right of its lanes' middle the vehicle keeps
            between junctions, where the road has room; negative to the left
            [m].
        waypoints: a CSV file of places to pass instead; see
            `cns_drake.roads.waypoints.load_waypoint_path`.
        u_turns: whether the vehicle turns round where waypoints double back.
        speeds: how fast.
        lidars: the LiDARs by name; the name gives frame and topic.
        imu: the IMU.
        frames: how many frames to record; all of the route by default.
        seed: of everything random: the noise of LiDARs that have any.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("downtown_01").with_lidar_preset("vlp-16")
    """

    name: Name
    map: str | None = None
    stage: Name | None = Field(default=None, validate_default=True)
    world: str | None = Field(default=None, validate_default=True)
    without: tuple[str, ...] = ()
    title: str = ""
    route: Route | None = Field(default=None, validate_default=True)
    aside: float = Field(default=0.0, ge=-3.0, le=3.0)
    waypoints: str | None = Field(default=None, validate_default=True)
    u_turns: bool = False
    speeds: Speeds
    lidars: dict[Name, LidarConfig] = Field(
        default={"lidar": LidarConfig()}, min_length=1
    )
    imu: ImuConfig = ImuConfig()
    frames: int | None = Field(default=None, ge=1)
    seed: int = Field(default=0, ge=0)

    # The file that it was read from.
    _file: Path | None = PrivateAttr(None)

    # A field that did not validate is missing in `info.data`: then its own
    # fault is enough.

    @field_validator("stage")
    @classmethod
    def _of_a_map(cls, stage: str | None, info: ValidationInfo) -> str | None:
        if "map" in info.data and (stage is None) != (info.data["map"] is None):
            raise ValueError("a map and its stage belong together")
        return stage

    @field_validator("world")
    @classmethod
    def _or_a_map(cls, world: str | None, info: ValidationInfo) -> str | None:
        if "map" in info.data and (world is None) == (info.data["map"] is None):
            raise ValueError("give either a map and its stage, or a world")
        return world

    @field_validator("route")
    @classmethod
    def _on_roads(
        cls, route: Route | None, info: ValidationInfo
    ) -> Route | None:
        if route is not None and info.data.get("world") is not None:
            raise ValueError("a world has no roads, give waypoints instead")
        return route

    @field_validator("waypoints")
    @classmethod
    def _or_a_route(
        cls, waypoints: str | None, info: ValidationInfo
    ) -> str | None:
        if "route" in info.data and (waypoints is None) == (
            info.data["route"] is None
        ):
            raise ValueError("give either a route or waypoints")
        if waypoints is not None and info.data.get("aside", 0.0) != 0.0:
            raise ValueError("aside is of a route, waypoints lie where they do")
        return waypoints

    @field_validator("u_turns")
    @classmethod
    def _of_waypoints(cls, u_turns: bool, info: ValidationInfo) -> bool:
        if u_turns and info.data.get("route") is not None:
            raise ValueError(
                "is of waypoints; a route turns round where the next leg "
                "leads back on its road"
            )
        return u_turns

    @field_validator("lidars")
    @classmethod
    def _frames_differ(cls, lidars: dict) -> dict:
        taken = {"map", "base_link", "imu"} & lidars.keys()
        if taken:
            raise ValueError(f"'{taken.pop()}' is the name of another frame")
        return lidars

    def described(self, folder: Path | None = None) -> dict:
        """Returns the fields that are given, ready for JSON.

        Where a map, world or waypoints lie is no part of what is driven, and
        what they hold has a digest.

        Args:
            folder: from which they are told by their way; without it, by
                their names alone.
        """
        values = self.model_dump(mode="json", exclude_none=True)
        for field in ("map", "world", "waypoints"):
            place = values.get(field)
            if place is None or place in shipped_maps():
                continue
            values[field] = Path(place).name
            if folder is not None:
                values[field] = os.path.relpath(place, folder.resolve())
        return values

    def __eq__(self, other: object) -> bool:
        """Tells whether two are the same, wherever they were read from."""
        if not isinstance(other, Scenario):
            return NotImplemented
        return self.__dict__ == other.__dict__

    @property
    def source(self) -> str:
        """What errors begin with: its file, or else its name."""
        return str(self._file or self.name)

    @property
    def map_folder(self) -> Path:
        """The folder of the map; of a world, where its file is."""
        if self.map is None:
            return self.world_file.parent
        return shipped_maps().get(self.map, Path(self.map))

    @property
    def world_file(self) -> Path:
        """The SDF file of the stage, or the world itself."""
        if self.world is not None:
            return Path(self.world)
        return self.map_folder / f"stage_{self.stage}.sdf"

    @property
    def roads_file(self) -> Path:
        """The road network of the map."""
        return self.map_folder / "roads.yaml"

    def with_lidar_preset(self, preset: str) -> Scenario:
        """Returns the scenario with the unit of every LiDAR replaced.

        Their places, and how they measure, stay as they are.

        Raises:
            InputError: the preset is not known.
        """
        lidars = {
            name: config.with_preset(preset)
            for name, config in self.lidars.items()
        }
        return self.model_copy(update={"lidars": lidars})

    def check_files(self, source: object = None) -> None:
        """Checks that the map and its stage, or the other files, exist.

        Args:
            source: the file that errors begin with; by default its own.

        Raises:
            InputError: they do not.
        """
        source = source or self.source
        for field in ("world", "waypoints"):
            file = getattr(self, field)
            if file is not None and not os.path.isfile(file):
                raise InputError(f"{source}: {field}: {file}: no such file")
        if self.map is None:
            return
        folder = self.map_folder
        if not os.path.isdir(folder):
            known = ", ".join(shipped_maps())
            raise InputError(
                f"{source}: map: '{self.map}' is neither a shipped map "
                f"({known}) nor a folder"
            )
        if not os.path.isfile(self.world_file):
            stages = sorted(
                path.stem.removeprefix("stage_")
                for path in folder.glob("stage_*.sdf")
            )
            raise InputError(
                f"{source}: stage: map '{self.map}' has no stage "
                f"'{self.stage}'; it has: {', '.join(stages) or 'none'}"
            )


def make_lidar_config(preset: str) -> LidarConfig:
    """Returns a LiDAR of a preset.

    Raises:
        InputError: the preset is not known.
    """
    try:
        return LidarConfig(preset=preset)
    except ValidationError as error:
        raise InputError(describe_validation_error("--lidar", error)) from None


def make_scenario(values: dict, source: object) -> Scenario:
    """Validates a scenario.

    Args:
        values: the fields.
        source: the file or argument that errors name.

    Raises:
        InputError: a field is missing, unknown or not usable.

    Example:
        from cns_drake import load_scenario, make_scenario

        values = load_scenario("metropolis_04").model_dump(exclude_none=True)
        short = make_scenario({**values, "frames": 20}, "short")
    """
    try:
        return Scenario.model_validate(values)
    except ValidationError as error:
        raise InputError(
            describe_validation_error(source, error, Scenario)
        ) from None


def load_scenario(name_or_file: str | Path) -> Scenario:
    """Loads a shipped sequence by name, or a scenario file.

    Raises:
        InputError: there is no such sequence or file, or the file is not a
            usable scenario.

    Example:
        from cns_drake import load_scenario

        scenario = load_scenario("metropolis_04")
    """
    shipped = shipped_sequences()
    path = shipped.get(str(name_or_file), Path(name_or_file))
    # Unlike pathlib, os.path takes names that no file can have.
    if not os.path.isfile(path):
        if re.fullmatch(r"\w+", str(name_or_file)):
            raise InputError(
                f"unknown sequence '{name_or_file}'; known: "
                f"{', '.join(shipped)}; or give a scenario file"
            )
        raise InputError(f"{path}: no such scenario file")
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a mapping of scenario fields")
    values.setdefault("name", sequence_name(path))
    for field in ("map", "world", "waypoints"):
        place = values.get(field)
        if isinstance(place, str) and place not in shipped_maps():
            # Relative to the file, independent of where it is read from.
            try:
                values[field] = str((path.parent / place).resolve())
            except ValueError as error:
                raise InputError(f"{path}: {field}: {error}") from error
    scenario = make_scenario(values, path)
    scenario._file = path
    scenario.check_files()
    return scenario
