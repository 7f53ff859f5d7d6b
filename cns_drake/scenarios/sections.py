"""Sections of a scenario: ride, driver, traffic and temporary changes."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from cns_drake.motion import RoadProfile, RoughnessClass
from cns_drake.sensors import Section, field_off_by_default

# More vehicles or pedestrians than any map can hold.
_MOST_TRAFFIC = 2000


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
        follows: whether the car moves among the vehicles of `traffic` and keeps
            its distance to the vehicle ahead.
        seed: seed of all random choices of the driver: a number or a text. By
            default the name of the drive.
    """

    wander: float = Field(default=0.0, ge=0.0, le=1.0)
    wander_length: float = Field(default=50.0, ge=20.0, le=1000.0)
    lane_changes: float = Field(default=0.0, ge=0.0, le=10.0)
    follows: bool = False
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
REAL_DRIVER = DriverConfig(
    wander=0.35, wander_length=65.0, lane_changes=9.0, follows=True
)


class TrafficConfig(Section):
    """Vehicles and pedestrians that move while a drive is recorded.

    Attributes:
        vehicles: number of cars, vans, trucks, buses, motorcycles and bicycles
            that drive along the map's roads.
        walkers: number of pedestrians on the map's sidewalks and crossings.
        seed: seed of all random choices for vehicles and pedestrians: their
            kinds, starting places and routes.
        fcd: file of a SUMO trace (floating-car data) to replay instead of
            planned traffic; `vehicles` and `walkers` must then be 0.
        queues: whether vehicles stand in queues in all lanes, as in a rush
            hour, except where the recording vehicle is. No other traffic is
            then possible.
    """

    vehicles: int = Field(default=0, ge=0, le=_MOST_TRAFFIC)
    walkers: int = Field(default=0, ge=0, le=_MOST_TRAFFIC)
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
    def is_off(self) -> bool:
        """Whether there is no traffic."""
        return (
            self.fcd is None
            and self.vehicles == self.walkers == 0
            and not self.queues
        )


class TransientConfig(Section):
    """Changes to a city that no stage contains, such as snow.

    Most of these changes are temporary; `height_limit` shows the city before it
    grew.

    `roadsides` is applied first, so all other switches also change the objects
    that `roadsides` adds. Apart from that, the switches are independent: the
    effect of each switch depends only on the seed and on the names of
    structures.

    Attributes:
        seed: seed of all random numbers.
        parked_cars: share of the parked cars that are changed. Of the changed
            cars, 30 % have left, 20 % stand elsewhere in their bay, and all
            others are replaced by another car.
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
            poles, lamps and signs up to 2 m away.
        roadsides: share of the free places beside kerbs, within 30 m of the
            drive, that get hedges, garden walls, bushes, young trees, garages
            or parked cars. Only the cars depend on the seed; all other added
            objects are the same in every drive.
        height_limit: greatest height of buildings and plants above their lowest
            point [m]. Buildings that exceed this height by at least 2.5 m (a
            storey) are cut off at this height, and get a flat roof; plants that
            exceed this height are scaled down. By default no limit.
    """

    seed: int = Field(default=1, ge=0)
    parked_cars: float = Field(default=0.0, ge=0.0, le=1.0)
    leaves: float = Field(default=1.0, ge=0.0, le=1.0)
    snow: float = Field(default=0.0, ge=0.0, le=1.0)
    scaffolds: float = Field(default=0.0, ge=0.0, le=1.0)
    works: float = Field(default=0.0, ge=0.0, le=1.0)
    furniture: float = Field(default=0.0, ge=0.0, le=1.0)
    roadsides: float = field_off_by_default(0.0, ge=0.0, le=1.0)
    height_limit: float | None = field_off_by_default(
        None, gt=2.0, allow_inf_nan=False
    )

    @property
    def is_off(self) -> bool:
        """Whether there are no temporary changes."""
        return self == TransientConfig(seed=self.seed)
