"""Puts up scaffolds, roadworks and roadside objects along a drive."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
import math
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.city.geometry import (
    Model,
    Part,
    assemble,
    bar,
    block,
    placed,
    post,
)
from cns_drake.city.placement.objects import OBJECTS, pick_key
from cns_drake.transient.ground_surface import GROUND_CLASSES
from cns_drake.transient.obstacles import Obstacles
from cns_drake.transient.scene_editing import Surroundings, change_rng
from cns_drake.transient.world_structures import LoadedStructure

# Greatest distance between a front and the drive [m].
_FARTHEST = 30.0
# Distance of a scaffold's inner uprights from the front [m].
_ROW_INNER = 0.25
# Distance of a scaffold's outer uprights from the front [m].
_ROW_OUTER = 1.15
# Height of a lift of a scaffold [m].
_LIFT = 2.0
# Length of a bay of a scaffold, about [m].
_BAY = 2.5
# Greatest length of a scaffold [m].
_LONGEST_SCAFFOLD = 25.0
# Greatest height of a scaffold [m].
_HIGHEST_SCAFFOLD = 16.0
# Least length of a scaffold [m].
_SHORTEST_SCAFFOLD = 4.0
# Least height of a scaffold [m].
_LOWEST_SCAFFOLD = 3.5
# Share of the scaffolds that have a net.
_NETTED = 0.4
_STEEL = (0.6, 0.61, 0.62)
_WOOD = (0.62, 0.5, 0.35)
_NET = (0.35, 0.52, 0.42)
_NOT_THROUGH = frozenset({"building", "car", "truck", "bus", "other-structure"})


def put_up_scaffolds(around: Surroundings, share: float) -> None:
    """Puts up scaffolds in front of a share of the buildings along a drive.

    A building without free space in front gets no scaffold.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the buildings, from 0 to 1.
    """
    fronts = [
        thing
        for thing in around.of_classes({"building"})
        if thing.footprint.area > 0.0
        and thing.footprint.distance(around.drive) < _FARTHEST
    ]
    if not fronts:
        around.editing.note(
            f"scaffolds: no building within {_FARTHEST:g} m of the drive"
        )
    obstacles = around.obstacles_of(_NOT_THROUGH)
    for building, rng in around.chosen("scaffolds", fronts, share):
        X_WF, length = _front(building, around.drive)
        length = min(length, _LONGEST_SCAFFOLD)
        corners = [
            X_WF @ [x, y, 0.0]
            for x, y in (
                (-length / 2, _ROW_INNER), (length / 2, _ROW_INNER),
                (length / 2, _ROW_OUTER + 0.1), (-length / 2, _ROW_OUTER + 0.1),
            )
        ]  # fmt: skip
        area = shapely.Polygon([corner[:2] for corner in corners])
        # A quay beside the front does not count as the foot of the building.
        foot = max(around.ground.lowest(area, building.bottom), building.bottom)
        height = min(
            float(building.p_WPs[:, 2].max()) - foot, _HIGHEST_SCAFFOLD
        )
        if (
            length >= _SHORTEST_SCAFFOLD
            and height >= _LOWEST_SCAFFOLD
            and obstacles.is_free(area, (building.name,))
        ):
            around.editing.add(
                f"scaffold_{building.name}",
                "other-structure",
                scaffold(length, height, rng),
                RigidTransform([0.0, 0.0, foot]) @ X_WF,
                "scaffolds",
            )


def _front(
    building: LoadedStructure, drive: BaseGeometry
) -> tuple[RigidTransform, float]:
    """Returns the pose of the front that faces a drive, and its length [m].

    The pose is in W: in the middle of the front at z = 0, with x along the
    front and y away from the building.
    """
    rectangle = shapely.MultiPoint(
        shapely.get_coordinates(building.footprint)
    ).minimum_rotated_rectangle
    corners = shapely.get_coordinates(rectangle)
    middles = (corners[:-1] + corners[1:]) / 2
    k = int(np.argmin(shapely.distance(shapely.points(middles), drive)))
    along = corners[k + 1] - corners[k]
    length = math.hypot(*along)
    away = middles[k] - corners[:-1].mean(axis=0)
    yaw = math.atan2(away[1], away[0]) - np.pi / 2
    return RigidTransform(RollPitchYaw(0, 0, yaw), [*middles[k], 0.0]), length


def scaffold(length: float, height: float, rng: np.random.Generator) -> Model:
    """Returns a scaffold along x: uprights, ledgers, decks, sometimes a net.

    Args:
        length: length of the scaffold [m].
        height: height of the facade [m].
        rng: random generator for the variant of the scaffold.
    """
    lifts = max(int(height / _LIFT), 1)
    bays = max(round(length / _BAY), 1)
    xs = np.linspace(-length / 2, length / 2, bays + 1)
    top = lifts * _LIFT + 1.0
    parts: list[Part] = [
        post(f"standard_{row}_{k:02d}", 0.03, top, (float(x), y), _STEEL)
        for row, y in enumerate((_ROW_INNER, _ROW_OUTER))
        for k, x in enumerate(xs)
    ]
    for k in range(1, lifts + 1):
        z = k * _LIFT
        parts.append(
            block(
                f"deck_{k}",
                (length, _ROW_OUTER - _ROW_INNER - 0.1, 0.05),
                (0.0, (_ROW_INNER + _ROW_OUTER) / 2, z),
                rgb=_WOOD,
            )
        )
        parts += [
            bar(
                f"rail_{k}_{j}",
                (-length / 2, _ROW_OUTER, z + up),
                (length / 2, _ROW_OUTER, z + up),
                0.025,
                _STEEL,
            )
            for j, up in enumerate((0.5, 1.0))
        ]
    if rng.uniform() < _NETTED:
        parts.append(
            block(
                "net",
                (length, 0.01, top - _LIFT),
                (0.0, _ROW_OUTER + 0.05, (top + _LIFT) / 2),
                rgb=_NET,
            )
        )
    return assemble(*parts)


# Distance between points along a kerb [m].
_SPACING = 1.0
# A stretch is not used if its length is more than this times its chord.
_MOST_BENT = 1.05


class _Stretch:
    """A straight piece of kerb, named after the switch that uses it.

    Its frame is at its middle (2,) [m], at `yaw` [rad]; the x axis runs along
    the kerb, and the y axis points away from the carriageway.
    """

    def __init__(self, name: str, points: np.ndarray, outward: np.ndarray):
        """Takes points (N, 2) along the kerb [m], and the direction of y."""
        self.name = name
        chord = points[-1] - points[0]
        self.middle = (points[0] + points[-1]) / 2
        self.length = math.hypot(*chord)
        self.yaw = math.atan2(outward[1], outward[0]) - np.pi / 2

    def place(self, x: float, y: float) -> np.ndarray:
        """Converts a point (x, y) from the stretch's frame to W, (2,) [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.middle + np.array([c * x - s * y, s * x + c * y])

    def rectangle(
        self, x: float, length: float, y0: float, y1: float
    ) -> shapely.Polygon:
        """Returns a rectangle of the stretch's frame, as a polygon in W [m].

        It is `length` long along the kerb, with its middle at `x`. Across the
        kerb, it extends from `y0` to `y1`.
        """
        x0, x1 = x - length / 2, x + length / 2
        return shapely.Polygon(
            [self.place(*at) for at in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        )

    def footprint(
        self, model: Model, x: float, y: float, turn: float = 0.0
    ) -> BaseGeometry:
        """Returns the footprint of a model in W [m].

        `x` and `y` [m] are the place of the model in the frame of the stretch,
        and `turn` [rad] is its heading in this frame.
        """
        at = self.place(x, y).tolist()
        return placed(model.footprint, at, turn + self.yaw)

    def put(
        self,
        around: Surroundings,
        suffix: str,
        semantic_class: str,
        model: Model,
        x: float,
        y: float,
        turn: float = 0.0,
        length: float = 0.0,
    ) -> None:
        """Adds an object at a place, with both ends on the ground.

        If there is no ground, the object is left out.

        Args:
            around: the ground and what stands on it.
            suffix: end of the object's name.
            semantic_class: class of the object.
            model: shape of the object.
            x, y: place of the object in the frame of the stretch [m].
            turn: heading of the object relative to the kerb [rad].
            length: distance between the two ends of the object [m]; an object
                of length 0 stands upright.
        """
        ground = around.ground
        yaw = self.yaw + turn
        middle = self.place(x, y)
        along = np.array([math.cos(yaw), math.sin(yaw)]) * length / 2
        ends = np.array([middle, middle - along, middle + along])
        z = ground.heights(ends, of_road=y < 0.0)
        at = float(z[0])
        if length == 0.0:
            at = ground.lowest(self.footprint(model, x, y, turn), at)
        if not np.isfinite(at):  # There is no ground beside the road.
            edge = self.place(x, -0.1)[None]
            at = float(ground.heights(edge, of_road=True)[0])
        if not np.isfinite(at):  # Both are in gaps of the ground.
            return
        pitch = 0.0
        if length > 0.0 and np.isfinite(z).all():
            pitch = -math.atan2(z[2] - z[1], length)
        around.editing.add(
            f"{self.name}_{suffix}",
            semantic_class,
            model,
            RigidTransform(RollPitchYaw(0.0, pitch, yaw), [*middle, at]),
            self.name.partition("_")[0],
        )


def _stretches(
    around: Surroundings, cause: str, cell: float, shortest: float
) -> list[_Stretch]:
    """Returns the longest straight piece of kerb in each cell near a drive.

    The cells have the size `cell`. Pieces are at most 30 m from the drive and
    at least `shortest` long [m]. If there are none, a note says so.
    """
    best: dict[tuple[int, int], _Stretch] = {}
    for kerb in around.ground.kerbs(_SPACING):
        cells = np.floor(kerb.points / cell).astype(int)
        cuts = np.flatnonzero(np.diff(cells, axis=0).any(axis=1)) + 1
        for run in np.split(np.arange(len(cells)), cuts):
            points = kerb.points[run]
            walked = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
            if len(run) < 2:
                continue
            x, y = (int(value) for value in cells[run[0]])
            outward = kerb.outwards[run].mean(axis=0)
            stretch = _Stretch(f"{cause}_{x:+d}_{y:+d}", points, outward)
            longest = best[x, y].length if (x, y) in best else 0.0
            if (
                stretch.length >= shortest
                and stretch.length > longest
                and walked <= _MOST_BENT * stretch.length
            ):
                best[x, y] = stretch
    found = [
        stretch
        for _, stretch in sorted(best.items())
        if around.drive.distance(shapely.Point(stretch.middle)) < _FARTHEST
    ]
    if not found:
        around.editing.note(
            f"{cause}: no structure of class road along the drive"
        )
    return found


# Cell size of the grid, in W, of kerb stretches [m].
_WORKS_CELL = 20.0
_LENGTHS = (6.0, 14.0)
_TRIES = 6
# Sites extend from this distance from the kerb [m].
_SITE_INNER = 0.4
# Sites extend to one of these distances from the kerb [m].
_SITE_OUTER = (4.6, 2.7)
# Width of new kerb stones, which narrow the carriageway [m].
_KERB_WIDTH = 0.3
# Height of new kerb stones above the carriageway [m].
_KERB_HEIGHT = 0.13
_KERB_RGB = (0.8, 0.8, 0.78)
# Objects on wide sites -> weight in the random choice.
_WIDE = {"excavator": 3, "skip": 2, "soil_heap": 1, "brick_pallets": 1}
# Objects on narrow sites -> weight in the random choice.
_NARROW = {"skip": 3, "brick_pallets": 2, "portable_toilet": 1}
_OPEN = frozenset({"pole", "traffic-sign", "vegetation"}) | GROUND_CLASSES


def put_up_works(around: Surroundings, share: float) -> None:
    """Puts up roadworks along a share of the kerbs near a drive.

    Kerbs without free space get no roadworks.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the kerbs, from 0 to 1.
    """
    stretches = _stretches(around, "works", _WORKS_CELL, _LENGTHS[0])
    solid, every = (
        around.obstacles_except(ignored) for ignored in (_OPEN, GROUND_CLASSES)
    )
    for stretch, rng in around.chosen("works", stretches, share):
        for _ in range(_TRIES):
            length = min(float(rng.uniform(*_LENGTHS)), stretch.length)
            spare = max(stretch.length - length, 0.0) / 2
            x = float(rng.uniform(-spare, spare))
            free = [
                width
                for width in _SITE_OUTER
                if solid.is_free(
                    stretch.rectangle(x, length, _SITE_INNER, width)
                )
            ]
            if free:
                _Site(around, stretch, x, length, free[0], rng).build(every)
                break


@dataclass
class _Site:
    """One roadworks site, at the place x of a stretch of kerb [m]."""

    around: Surroundings
    stretch: _Stretch
    x: float
    length: float
    width: float
    rng: np.random.Generator

    def build(self, every: Obstacles) -> None:
        """Adds fences, machines where there is room, and new kerb stones."""
        x, length, width = self.x, self.length, self.width
        middle = (_SITE_INNER + width) / 2
        across = width - _SITE_INNER
        sides = (
            (x, _SITE_INNER, 0.0, length),
            (x, width, 0.0, length),
            (x - length / 2, middle, np.pi / 2, across),
            (x + length / 2, middle, np.pi / 2, across),
        )
        for k, (at, y, turn, run) in enumerate(sides):
            model = OBJECTS["site_fence"].build(self.rng, length=run)
            self.stretch.put(
                self.around, f"fence_{k}", "fence", model, at, y, turn, run
            )
        self._add_machines(every, middle)
        stones = self.stretch.rectangle(x, length, -_KERB_WIDTH, 0.0)
        if not stones.intersects(self.around.drive.buffer(1.3)):
            size = (length, _KERB_WIDTH, 2 * _KERB_HEIGHT)
            model = assemble(block("stones", size, (0, 0, 0), rgb=_KERB_RGB))
            y = -_KERB_WIDTH / 2
            self.stretch.put(
                self.around, "kerb", "sidewalk", model, x, y, 0.0, length
            )

    def _add_machines(self, every: Obstacles, y: float) -> None:
        shares = _WIDE if self.width > 4.0 else _NARROW
        taken: list[BaseGeometry] = []
        for _ in range(_TRIES):
            name = pick_key(shares, self.rng)
            x = self.x + float(self.rng.uniform(-0.4, 0.4)) * self.length
            turn = float(self.rng.uniform(-0.15, 0.15))
            model = OBJECTS[name].build(self.rng)
            if name == "brick_pallets":
                turn += np.pi / 2  # Its row of panels runs along y.
            area = self.stretch.footprint(model, x, y, turn)
            inside = self.stretch.rectangle(
                self.x, self.length, _SITE_INNER, self.width
            )
            if (
                inside.contains(area)
                and every.is_free(area)
                and not any(area.intersects(other) for other in taken)
            ):
                kind = OBJECTS[name].semantic_class
                self.stretch.put(
                    self.around, f"{name}_{len(taken)}", kind, model, x, y, turn
                )
                taken.append(area)


# Cell size of the grid, in W, of kerb stretches [m].
_STRETCH_CELL = 6.5
# Least length of a stretch [m].
_SHORTEST_STRETCH = 3.0
# Distance between the places that are tried, away from the kerb [m].
_STEP = 0.4


@dataclass(frozen=True)
class _Row:
    """A kind of objects in rows along kerbs, from `roadsides.yaml`."""

    kinds: list[str]
    share: float
    nearest: tuple[float, float]
    farthest: float
    sizes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    along: Sequence[float] = (0.0,)
    turns: Sequence[float] = (0.0,)
    moves: bool = False


_ROWS = {
    name: _Row(**values)
    for name, values in parse_yaml(
        Path(__file__).with_name("roadsides.yaml").read_bytes()
    ).items()
}


def fill_roadsides(around: Surroundings, share: float) -> None:
    """Adds objects to a share of the free places beside kerbs near a drive.

    The objects are, for example, parked cars, hedges, trees and garages. The
    seed of the temporary changes (`around.seed`) decides only where cars are
    parked; all other objects are the same for every seed.

    Args:
        around: surroundings of the drive, to which the objects are added.
        share: share of the free places that get an object, from 0 to 1.
    """
    stretches = _stretches(
        around, "roadsides", _STRETCH_CELL, _SHORTEST_STRETCH
    )
    standing = around.obstacles_except(GROUND_CLASSES)
    areas = [around.ground.carriageway]
    shapely.prepare(areas[0])
    for name, row in _ROWS.items():
        seed = around.seed if row.moves else 0
        for stretch in stretches:
            rng = change_rng(seed, f"roadsides {name}", stretch.name)
            is_put_up = rng.uniform() < share
            if rng.uniform() >= row.share:
                continue
            builder = OBJECTS[str(rng.choice(row.kinds))]
            sizes = {k: float(rng.uniform(*v)) for k, v in row.sizes.items()}
            model = builder.build(rng, **sizes)
            length = sizes.get("length", 0)
            turn = float(rng.choice(row.turns))
            first = float(rng.uniform(*row.nearest))
            places = product(np.arange(first, row.farthest, _STEP), row.along)
            for y, x in places:
                area = stretch.footprint(model, x, y, turn)
                if not standing.is_free(area) or (
                    shapely.intersects(areas, area).any()
                ):
                    continue
                # Objects that a smaller share leaves out take up room as well.
                areas.append(area)
                if is_put_up:
                    kind = builder.semantic_class
                    stretch.put(around, name, kind, model, x, y, turn, length)
                break
