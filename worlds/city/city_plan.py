"""The plan of a city: the districts in `city.yaml`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    field_validator,
    model_validator,
)

from evaluation.base import InputModel, read_yaml, repeated, validated
from worlds.roads import MeshStem

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


class _Model(InputModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class BuildingPlan(_Model):
    """One building at a given place.

    Attributes:
        archetype: name of the archetype, which sets the look of the building.
        at: `[x, y]` of the centre of the footprint [m].
        size: `[width along the front, depth]` of a rectangular footprint [m].
            Give `size` or `outline`.
        outline: corners of the footprint [m], relative to `at`, before the
            rotation by `yaw_deg`.
        yaw_deg: heading of the building [deg]. At 0 its front faces the
            direction -y.
        height: height of the parapet, ridge or spire [m].
        kind: first part of the building's name in the tables; by default the
            archetype.
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
        setback: distance from the inner edge of the sidewalk to the building
            fronts [m].
        archetypes: weights of archetypes, such as `{house: 3, office: 1}`.
        width: range of the widths of lots [m].
        depth: range of the depths of lots [m].
        height: range of the heights of parapets, ridges or spires [m].
        gap: range of the gaps between neighbouring buildings [m].
        fill: share of the lots that have a building.
        kind: first part of the buildings' names in the tables; by default the
            archetype.
        within: corners of an area [m]. The row has buildings only in this area.
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
        ground: kind of ground of the patch.
        area: corners of the patch [m]. Give `area` or `line`.
        line: points of the centre line of a path [m]. Give `area` or `line`.
        width: width of the path along `line` [m].
        level: height of the patch, which is then level [m]. By default the
            patch follows the ground around it.
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
    """A row of parking bays with parked cars.

    Attributes:
        start: `[x, y]` of one end of the row, on the side from which cars enter
            [m].
        end: `[x, y]` of the other end of the row, on the same side [m]. Seen
            from `start`, the bays lie on the left.
        bay: width and depth of a bay [m].
        fill: share of the bays that have a car.
    """

    start: Point
    end: Point
    bay: Point = (2.6, 5.2)
    fill: float = Field(default=0.7, ge=0, le=1)


class ScatterPlan(_Model):
    """Plants or other objects at random places on a district's open ground.

    Attributes:
        objects: weights of objects.
        spacing: smallest distance between two objects [m].
        fill: share of the possible places at which an object stands.
        within: corners of an area [m]. The objects stand only in this area.
        clearance: smallest distance of the objects from buildings and streets
            [m].
        ground: kinds of ground on which the objects can stand.
        kind: first part of the names in the tables, as for a single object.
    """

    objects: Weights = Field(min_length=1)
    spacing: float = Field(gt=0.2)
    fill: float = Field(default=1.0, gt=0, le=1)
    within: Area | None = None
    clearance: float = Field(default=1.5, ge=0)
    ground: tuple[Ground, ...] = ("lawn",)
    kind: MeshStem | None = None


class LinePlan(_Model):
    """Objects along a line, such as an avenue of trees, a fence or benches.

    Attributes:
        objects: weights of objects.
        points: points of the line [m]. The objects face to the right of the
            line's direction.
        spacing: smallest and largest distance between two objects [m]. Without
            it, one object, such as a fence, fills each straight part of the
            line, or several end to end if the part is long or steep.
        yaw_deg: angle by which each object is rotated from its usual heading
            along the line [deg].
        kind: first part of the names in the tables, as for a single object.
        parameters: settings of the objects, as for a single object.
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
        object: name of the object to place.
        at: `[x, y]` of the object's position [m].
        yaw_deg: heading of the object [deg].
        kind: first part of the name in the tables; by default `tree`, `car`,
            `truck` or `sign`, or else the name of the object.
        parameters: settings of the object, such as `{height: 1.1}` for a
            `garden_wall`.
    """

    object: str
    at: Point
    yaw_deg: float = 0.0
    kind: MeshStem | None = None
    parameters: Parameters = Field(default_factory=dict)


class StreetPlan(_Model):
    """The objects on the sidewalks in front of a district.

    Attributes:
        trees: weights of tree species; by default there are no trees.
        tree_spacing: range of the distances between neighbouring trees [m].
        tree_gaps: share of the trees that are left out at random.
        lamp: name of the object to use as street lamp.
        lamp_spacing: distance between neighbouring lamps [m].
        furniture: weights of objects other than trees and lamps, such as
            benches.
        furniture_spacing: range of the distances between neighbouring pieces of
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
        name: unique name, from lower-case letters, digits and underscores. The
            random numbers of the district depend on this name.
        block: `[x, y]` of a point [m]: the district fills the block between
            streets around it. Give `block`, `area` or neither.
        area: corners of the district [m]. A district with neither `block` nor
            `area` gets all ground that belongs to no other district.
        ground: kind of ground of the district.
        relief: height of the swells (gentle hills) in the district's lawns [m];
            0 for level ground.
        relief_margin: width of the strip along paths and around buildings in
            which the swells rise to their full height [m].
        patches: parts of the district with another kind of ground.
        buildings: single buildings.
        rows: rows of buildings along the streets.
        parking: rows of parking bays.
        objects: single objects.
        lines: objects along lines.
        scatter: objects scattered at random.
        street: objects on the sidewalks in front of the district; by default
            those of the city's field `street`.
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
    """The file `city.yaml`: all parts of a city except its roads.

    Attributes:
        seed: seed of all random numbers. Another seed makes another city along
            the same streets.
        bounds: `[x0, y0, x1, y1]`, the smallest and largest x and y of the
            world [m].
        water_level: height of the water's surface [m].
        cars: weights of car models, for parked cars.
        street: objects on sidewalks, in front of districts without a `street`
            of their own.
        medians: objects on the medians of roads; only the fields `trees` and
            `tree_spacing` are used. By default the same objects as in `street`.
        districts: districts of the city. If two districts overlap, the first in
            the list gets the ground.
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
        for name in repeated(district.name for district in self.districts):
            raise ValueError(f"district {name} is there twice")
        return self


def load_plan(path: Path) -> CityPlan:
    """Reads the plan of a city from a file `city.yaml`.

    Raises:
        InputError: if it cannot be read or has a wrong key or type.
    """
    return validated(CityPlan, read_yaml(path), path)
