"""The plan of a city: the districts in `city.yaml`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    field_validator,
    model_validator,
)

from cns_drake.base.errors import validated
from cns_drake.base.yaml_files import read_yaml
from cns_drake.roads.road import MeshStem

# Greatest extent of a city [m]; the size of the generated files grows with its
# area.
_LARGEST_SIDE = 10_000.0
# Greatest size of any object [m].
_LARGEST_PARAMETER = 1000.0
Point = tuple[float, float]
Line = Annotated[list[Point], Field(min_length=2)]
Area = Annotated[list[Point], Field(min_length=3)]


def _in_order(values: tuple[float, float]) -> tuple[float, float]:
    if values[0] > values[1]:
        raise ValueError(f"{values[0]:g} is greater than {values[1]:g}")
    return values


def _not_huge(value: Any) -> Any:
    is_number = isinstance(value, int | float)
    if is_number and not abs(value) <= _LARGEST_PARAMETER:
        raise ValueError(f"{value} is no number up to {_LARGEST_PARAMETER:g}")
    return value


# Arguments for the builder of an object.
Parameters = dict[str, Annotated[Any, AfterValidator(_not_huge)]]
# Least and greatest value of a random number.
Range = Annotated[
    tuple[float, float],
    AfterValidator(_in_order),
    Field(description="least and greatest value"),
]
Weights = dict[str, Annotated[float, Field(gt=0)]]
Ground = Literal["paved", "lawn", "gravel", "parking", "water"]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class BuildingPlan(_Model):
    """One building at a given place.

    Attributes:
        archetype: name of an archetype.
        at: `[x, y]` of the middle of the footprint [m].
        size: `[width along the front, depth]` [m]; give either this or
            `outline`.
        outline: corners of the footprint relative to `at`, before the building
            is turned [m].
        yaw_deg: heading of the building [deg]; at 0 its front faces -y.
        height: height of the walls [m].
        kind: beginning of its name; by default the archetype.
    """

    archetype: str
    at: Point
    size: Point | None = None
    outline: Area | None = None
    yaw_deg: float = 0.0
    height: float = Field(gt=0)
    kind: MeshStem | None = None

    @model_validator(mode="after")
    def _has_one_footprint(self) -> BuildingPlan:
        if (self.size is None) == (self.outline is None):
            raise ValueError("give either size or outline, not both or neither")
        return self


class RowPlan(_Model):
    """A row of buildings along the streets of a district.

    Attributes:
        setback: distance from the inner edge of the sidewalk to the fronts [m].
        archetypes: archetype -> weight in the random choice.
        width: least and greatest width of a lot [m].
        depth: least and greatest depth of a lot [m].
        height: least and greatest height of the walls [m].
        gap: least and greatest distance between neighbours [m].
        fill: share of the lots that are built on.
        kind: beginning of the buildings' names; by default the archetype.
        within: corners of the area to which the row is limited [m].
    """

    setback: float = Field(default=2.0, ge=0)
    archetypes: Weights = Field(min_length=1)
    width: Range
    depth: Range
    height: Range
    gap: Range = (0.0, 3.0)
    fill: float = Field(default=1.0, gt=0, le=1)
    kind: MeshStem | None = None
    within: Area | None = None


class PatchPlan(_Model):
    """A part of a district with another kind of ground, such as a path.

    Attributes:
        ground: kind of ground.
        area: corners of the patch [m]; give either this or `line`.
        line: points of the middle line of a path [m].
        width: width of the path [m].
        level: height at which the patch is level [m]; by default it follows the
            ground around it.
    """

    ground: Ground
    area: Area | None = None
    line: Line | None = None
    width: float = Field(default=3.0, gt=0)
    level: float | None = None

    @model_validator(mode="after")
    def _has_one_shape(self) -> PatchPlan:
        if (self.area is None) == (self.line is None):
            raise ValueError("give either area or line, not both or neither")
        return self


class ParkingPlan(_Model):
    """A parking lot: a row of bays with parked cars.

    Attributes:
        start: `[x, y]` of one end of the open side of the bays [m].
        end: `[x, y]` of the other end [m]; the bays lie on the left, seen from
            `start`.
        bay: width and depth of a bay [m].
        fill: share of the bays that are taken.
    """

    start: Point
    end: Point
    bay: Point = (2.6, 5.2)
    fill: float = Field(default=0.7, ge=0, le=1)


class ScatterPlan(_Model):
    """Plants or objects at random places on a district's open ground.

    Attributes:
        objects: object -> weight in the random choice.
        spacing: least distance between two objects [m].
        fill: share of the possible places that get an object.
        within: corners of the area to which the objects are limited [m].
        clearance: least distance to buildings and streets [m].
        ground: kinds of ground on which the objects can stand.
        kind: beginning of the objects' names; by default the object.
    """

    objects: Weights = Field(min_length=1)
    spacing: float = Field(gt=0.2)
    fill: float = Field(default=1.0, gt=0, le=1)
    within: Area | None = None
    clearance: float = Field(default=1.5, ge=0)
    ground: tuple[Ground, ...] = ("lawn",)
    kind: MeshStem | None = None


class LinePlan(_Model):
    """Objects along a line, such as the trees of an avenue, a fence or benches.

    Attributes:
        objects: object -> weight in the random choice.
        points: points of the line [m]; the fronts of the objects face its
            right.
        spacing: least and greatest distance between two objects [m]. By default
            each object is as long as a straight part of the line, as for fences
            and hedges.
        yaw_deg: heading of each object relative to the line [deg].
        kind: beginning of the objects' names; by default the object.
        parameters: arguments for the builder of the objects.
    """

    objects: Weights = Field(min_length=1)
    points: Line
    spacing: Range | None = None
    yaw_deg: float = 0.0
    kind: MeshStem | None = None
    parameters: Parameters = Field(default_factory=dict)


class ObjectPlan(_Model):
    """One object at a given place.

    Attributes:
        object: name of an object.
        at: `[x, y]` of the object [m].
        yaw_deg: heading of the object [deg].
        kind: beginning of its name; by default the object.
        parameters: arguments for the builder of the object, such as `{height:
            1.1}` for a `garden_wall`.
    """

    object: str
    at: Point
    yaw_deg: float = 0.0
    kind: MeshStem | None = None
    parameters: Parameters = Field(default_factory=dict)


class StreetPlan(_Model):
    """The objects on the sidewalks in front of a district.

    Attributes:
        trees: species -> weight in the random choice; without it there are no
            trees.
        tree_spacing: least and greatest distance between trees [m].
        tree_gaps: share of the trees that are left out.
        lamp: object that is used as street lamp.
        lamp_spacing: distance between lamps [m].
        furniture: object -> weight in the random choice.
        furniture_spacing: least and greatest distance between pieces of
            furniture [m].
    """

    trees: Weights = Field(default_factory=dict)
    tree_spacing: Range = (7.0, 11.0)
    tree_gaps: float = Field(default=0.15, ge=0, lt=1)
    lamp: str
    lamp_spacing: float = Field(default=26.0, gt=2)
    furniture: Weights = Field(default_factory=dict)
    furniture_spacing: Range = (5.0, 13.0)


class DistrictPlan(_Model):
    """A district: one block between streets, or another area.

    Attributes:
        name: unique name of lower-case letters, digits and underscores. The
            random draws in the district depend on it.
        block: `[x, y]` of any point in the block between streets that the
            district fills [m]; give this, `area` or neither.
        area: corners of the district [m]. Without `block` and `area`, the
            district takes all ground that belongs to no other district.
        ground: kind of the ground.
        relief: height of the swells in its lawns [m].
        relief_margin: distance from paths and buildings over which the relief
            rises from 0 to its full height [m].
        patches: parts with another kind of ground.
        buildings: single buildings.
        rows: rows of buildings along the streets.
        parking: parking lots.
        objects: single objects.
        lines: lines of objects.
        scatter: objects at random places.
        street: objects on its sidewalks; by default those of the city.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    block: Point | None = None
    area: Area | None = None
    ground: Ground = "lawn"
    relief: float = Field(default=0.0, ge=0, le=100)
    relief_margin: float = Field(default=12.0, gt=0)
    patches: list[PatchPlan] = Field(default_factory=list)
    buildings: list[BuildingPlan] = Field(default_factory=list)
    rows: list[RowPlan] = Field(default_factory=list)
    parking: list[ParkingPlan] = Field(default_factory=list)
    objects: list[ObjectPlan] = Field(default_factory=list)
    lines: list[LinePlan] = Field(default_factory=list)
    scatter: list[ScatterPlan] = Field(default_factory=list)
    street: StreetPlan | None = None

    @model_validator(mode="after")
    def _has_at_most_one_place(self) -> DistrictPlan:
        if self.block is not None and self.area is not None:
            raise ValueError("give block or area, not both")
        return self


class CityPlan(_Model):
    """The file `city.yaml`: everything in a city except its roads.

    Attributes:
        seed: seed of all random draws.
        bounds: `[x0, y0, x1, y1]` of the generated world [m].
        water_level: height of the water's surface [m].
        cars: car -> weight in the random choice of parked cars.
        street: objects on the sidewalks of districts that have no `street` of
            their own.
        medians: plants and lamps on the medians of roads, with the fields of
            `street`; by default the same as `street`.
        districts: districts, in the order in which they take ground.
    """

    seed: int = Field(ge=0)
    bounds: tuple[float, float, float, float]
    water_level: float = -2.8
    cars: Weights = Field(min_length=1)
    street: StreetPlan
    medians: StreetPlan | None = None
    districts: list[DistrictPlan] = Field(min_length=1)

    @field_validator("bounds")
    @classmethod
    def _are_of_a_city(
        cls, bounds: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        x0, y0, x1, y1 = bounds
        for side in (x1 - x0, y1 - y0):
            if not 0.0 < side <= _LARGEST_SIDE:
                raise ValueError(
                    f"a side is {side:g} m long; the most is "
                    f"{_LARGEST_SIDE:g} m"
                )
        return bounds

    @model_validator(mode="after")
    def _names_are_unique(self) -> CityPlan:
        names = [district.name for district in self.districts]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"district {name} is there twice")
        return self


def load_plan(path: Path) -> CityPlan:
    """Returns the plan in a file `city.yaml`.

    Raises:
        InputError: if it cannot be read or has a wrong key or type.
    """
    return validated(CityPlan, read_yaml(path), path)
