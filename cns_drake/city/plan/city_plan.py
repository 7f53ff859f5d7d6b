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

# A city's extent [m]: what is generated grows with its area.
_LARGEST_SIDE = 10_000.0
# No object is so large [m].
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


# Arguments of an object's builder.
Parameters = dict[str, Annotated[Any, AfterValidator(_not_huge)]]
# Least and greatest value of a drawn number.
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
        size: `[width along the front, depth]` [m]; give this or
            `outline`.
        outline: corners of the footprint about `at`, before turning [m].
        yaw_deg: heading; at 0 the front faces -y [deg].
        height: height of the walls [m].
        kind: stem of its name; by default the archetype.
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
        setback: from the inner edge of the sidewalk to the fronts [m].
        archetypes: archetype -> weight.
        width: range of the lots [m].
        depth: range of the lots [m].
        height: range of the walls [m].
        gap: range of the distance between neighbours [m].
        fill: part of the lots that are built on.
        kind: stem of their names; by default the archetype.
        within: corners of an area that the row is limited to [m].
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
    """Ground of another kind within a district, e.g. a path in a lawn.

    Attributes:
        ground: kind of ground.
        area: corners [m]; give this or `line`.
        line: points of a path's middle line [m].
        width: width of the path [m].
        level: height at which the patch is held level [m]; by default it
            follows the ground around it.
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
    """Rows of bays with parked cars.

    Attributes:
        start: one end of the line along the open side of the bays [m].
        end: the other; the bays lie on its left, seen from `start` [m].
        bay: width and depth of a bay [m].
        fill: part of the bays that are taken.
    """

    start: Point
    end: Point
    bay: Point = (2.6, 5.2)
    fill: float = Field(default=0.7, ge=0, le=1)


class ScatterPlan(_Model):
    """Plants or objects spread over a district's open ground.

    Attributes:
        objects: object -> weight.
        spacing: least distance between two of them, more than 0.2 [m].
        fill: part of the places that are used.
        within: corners of an area that they are limited to [m].
        clearance: least distance to buildings and streets [m].
        ground: kinds of ground that they may stand on.
        kind: stem of their names; by default the object.
    """

    objects: Weights = Field(min_length=1)
    spacing: float = Field(gt=0.2)
    fill: float = Field(default=1.0, gt=0, le=1)
    within: Area | None = None
    clearance: float = Field(default=1.5, ge=0)
    ground: tuple[Ground, ...] = ("lawn",)
    kind: MeshStem | None = None


class LinePlan(_Model):
    """Objects along a line, e.g. an avenue's trees, a fence, benches.

    Attributes:
        objects: object -> weight.
        points: the line [m]; its right is the objects' front.
        spacing: range of the distance between two objects [m]; by default each
            piece is as long as the line is straight, as for fences and hedges.
        yaw_deg: turn of each object against the line [deg].
        kind: stem of their names; by default the object.
        parameters: arguments of the objects' builder.
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
        at: `[x, y]` [m].
        yaw_deg: heading [deg].
        kind: stem of its name; by default the object.
        parameters: arguments of the object's builder, such as `{height: 1.1}`
            of a `garden_wall`.
    """

    object: str
    at: Point
    yaw_deg: float = 0.0
    kind: MeshStem | None = None
    parameters: Parameters = Field(default_factory=dict)


class StreetPlan(_Model):
    """The objects on the sidewalks in front of a district.

    Attributes:
        trees: species -> weight; a street without trees by default.
        tree_spacing: range of the distance between trees [m].
        tree_gaps: part of the trees left out.
        lamp: object used as street lamp.
        lamp_spacing: distance between lamps, more than 2 [m].
        furniture: object -> weight.
        furniture_spacing: range of the distance between objects [m].
    """

    trees: Weights = Field(default_factory=dict)
    tree_spacing: Range = (7.0, 11.0)
    tree_gaps: float = Field(default=0.15, ge=0, lt=1)
    lamp: str
    lamp_spacing: float = Field(default=26.0, gt=2)
    furniture: Weights = Field(default_factory=dict)
    furniture_spacing: Range = (5.0, 13.0)


class DistrictPlan(_Model):
    """One block, or an area of the surroundings.

    Attributes:
        name: unique; small letters, digits and underscores; also seeds the
            district's own draws.
        block: `[x, y]` of a point in the block that the streets leave [m];
            give this, `area` or neither.
        area: corners [m]; without both, the district is all ground that no
            other one takes.
        ground: kind of ground.
        relief: height of the swells of its lawns [m].
        relief_margin: width of their slope at paths and buildings [m].
        patches: list of patches.
        buildings: list of buildings.
        rows: list of rows of buildings.
        parking: list of parking lots.
        objects: list of objects.
        lines: list of lines of objects.
        scatter: list of scattered objects.
        street: the objects on its sidewalks.
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
    """A whole city, from `city.yaml`.

    Attributes:
        seed: seed of all random draws.
        bounds: `[x0, y0, x1, y1]` of the generated world [m].
        water_level: height of the water's surface [m].
        cars: object -> weight, of parked cars.
        street: the objects on sidewalks, unless the district has its own.
        medians: plants and lamps between the directions, with the same fields;
            by default as `street`.
        districts: list of districts, in the order in which they take ground.
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
    """Reads `city.yaml`.

    Raises:
        InputError: if it cannot be read or has a wrong key or type.
    """
    return validated(CityPlan, read_yaml(path), path)
