"""Roadworks beside the carriageway: fences, skips, diggers and new kerbs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.city.furniture.pavilions import FENCES
from cns_drake.city.furniture.site_equipment import SITE_EQUIPMENT
from cns_drake.city.geometry.structures import Builder, Model, assemble, block
from cns_drake.transient.draws import draws
from cns_drake.transient.ground_surface import GroundSurface
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.standing import GROUND_CLASSES, Obstacles, Standing

CAUSE = "works"
# Cell size of the world's grid of kerb stretches, and their greatest distance
# from the drive [m].
_CELL = 20.0
_FARTHEST = 30.0
_SPACING = 1.0
# Greatest ratio of a stretch's length to its chord: a bent one is not used.
_MOST_BENT = 1.05
_LENGTHS = (6.0, 14.0)
_TRIES = 6
# Sites reach from this distance from the kerb to one of these [m].
_INNER = 0.4
_WIDTHS = (4.6, 2.7)
# New kerb stones narrow the carriageway by this [m].
_KERB_WIDTH, _KERB_HEIGHT = 0.3, 0.13
_KERB_RGB = (0.8, 0.8, 0.78)
# Things on a site, with the room they need [m] and relative shares.
_WIDE = {"excavator": 3, "skip": 2, "soil_heap": 1, "brick_pallets": 1}
_NARROW = {"skip": 3, "brick_pallets": 2, "portable_toilet": 1}
_OPEN = frozenset({"pole", "traffic-sign", "vegetation"}) | GROUND_CLASSES


class _Stretch:
    """A straight piece of kerb.

    Attributes:
        name: of its cell.
        middle: (2,) of it [m].
        yaw: heading of its x axis; y points away from the carriageway [rad].
        length: of it [m].
    """

    def __init__(self, name: str, points: np.ndarray, outward: np.ndarray):
        self.name = name
        chord = points[-1] - points[0]
        self.middle = (points[0] + points[-1]) / 2
        self.length = float(np.linalg.norm(chord))
        self.yaw = float(np.arctan2(outward[1], outward[0])) - np.pi / 2

    def place(self, x: float, y: float) -> np.ndarray:
        """Returns the (2,) place x along the kerb and y away from it [m]."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return self.middle + np.array([c * x - s * y, s * x + c * y])

    def rectangle(
        self, x: float, length: float, y0: float, y1: float
    ) -> shapely.Polygon:
        """Returns an area along the kerb, about x, from y0 to y1 away [m]."""
        x0, x1 = x - length / 2, x + length / 2
        return shapely.Polygon(
            [self.place(*at) for at in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        )


def put_up_works(
    editing: SceneEditing,
    things: Mapping[str, Standing],
    drive: BaseGeometry,
    kept_free: BaseGeometry,
    ground: GroundSurface,
    part: float,
    seed: int,
) -> None:
    """Puts roadworks along a part of the kerbs near a drive.

    Kerbs without room beside them get none.

    Args:
        editing: of the world.
        things: all structures.
        drive: the way of the vehicle, seen from above [m].
        kept_free: area that stays free [m].
        ground: near the drive.
        part: share of the stretches of kerb, from 0 to 1.
        seed: of the draws.
    """
    stretches = [
        stretch
        for stretch in _stretches(ground)
        if drive.distance(shapely.Point(stretch.middle)) < _FARTHEST
    ]
    if not stretches:
        editing.note("works: no structure of class road along the drive")
    solid, every = (
        Obstacles.of_things(
            kept_free,
            [t for t in things.values() if t.semantic_class not in ignored],
        )
        for ignored in (_OPEN, GROUND_CLASSES)
    )
    for stretch in stretches:
        rng = draws(seed, CAUSE, stretch.name)
        if rng.uniform() >= part:
            continue
        for _ in range(_TRIES):
            length = min(float(rng.uniform(*_LENGTHS)), stretch.length)
            spare = max(stretch.length - length, 0.0) / 2
            x = float(rng.uniform(-spare, spare))
            site = next(
                (
                    (x, length, width)
                    for width in _WIDTHS
                    if solid.is_free(
                        stretch.rectangle(x, length, _INNER, width)
                    )
                ),
                None,
            )
            if site is not None:
                _Site(editing, ground, stretch, site, rng).build(every, drive)
                break


class _Site:
    """One site under construction."""

    def __init__(
        self,
        editing: SceneEditing,
        ground: GroundSurface,
        stretch: _Stretch,
        site: tuple[float, float, float],
        rng: np.random.Generator,
    ):
        self._editing = editing
        self._ground = ground
        self._stretch = stretch
        self._x, self._length, self._width = site
        self._rng = rng

    def build(self, every: Obstacles, drive: BaseGeometry) -> None:
        """Puts up fences, machines, and new kerb stones.

        Args:
            every: obstacles of machines.
            drive: area that kerb stones keep clear of [m].
        """
        x, length, width = self._x, self._length, self._width
        middle, across = (_INNER + width) / 2, width - _INNER
        sides = (
            (x, _INNER, 0.0, length),
            (x, width, 0.0, length),
            (x - length / 2, middle, np.pi / 2, across),
            (x + length / 2, middle, np.pi / 2, across),
        )
        for k, (at, y, turn, run) in enumerate(sides):
            model = FENCES["site_fence"].build(self._rng, length=run)
            self._add(f"fence_{k}", "fence", model, at, y, turn, run)
        self._add_machines(every, middle)
        stones = self._stretch.rectangle(x, length, -_KERB_WIDTH, 0.0)
        if not stones.intersects(drive.buffer(1.3)):
            size = (length, _KERB_WIDTH, 2 * _KERB_HEIGHT)
            model = assemble(block("stones", size, (0, 0, 0), rgb=_KERB_RGB))
            y = -_KERB_WIDTH / 2
            self._add("kerb", "sidewalk", model, x, y, 0.0, length)

    def _add_machines(self, every: Obstacles, y: float) -> None:
        shares = _WIDE if self._width > 4.0 else _NARROW
        names = list(shares)
        weights = np.array(list(shares.values()), float)
        taken: list[BaseGeometry] = []
        for _ in range(_TRIES):
            name = names[
                int(self._rng.choice(len(names), p=weights / weights.sum()))
            ]
            x = self._x + float(self._rng.uniform(-0.4, 0.4)) * self._length
            turn = float(self._rng.uniform(-0.15, 0.15))
            builder: Builder = SITE_EQUIPMENT[name]
            model = builder.build(self._rng)
            if name == "brick_pallets":
                turn += np.pi / 2  # Its row runs along y.
            area = shapely.affinity.translate(
                shapely.affinity.rotate(
                    model.footprint,
                    turn + self._stretch.yaw,
                    origin=(0, 0),
                    use_radians=True,
                ),
                *self._stretch.place(x, y),
            )
            inside = self._stretch.rectangle(
                self._x, self._length, _INNER, self._width
            )
            if (
                inside.contains(area)
                and every.is_free(area)
                and not any(area.intersects(other) for other in taken)
            ):
                suffix = f"{name}_{len(taken)}"
                kind = builder.semantic_class
                self._add(suffix, kind, model, x, y, turn, 0.0)
                taken.append(area)

    def _add(
        self,
        suffix: str,
        semantic_class: str,
        model: Model,
        x: float,
        y: float,
        turn: float,
        length: float,
    ) -> None:
        """Adds a thing whose two ends are on the ground.

        Without ground the thing is left out.
        """
        yaw = self._stretch.yaw + turn
        middle = self._stretch.place(x, y)
        along = np.array([np.cos(yaw), np.sin(yaw)]) * length / 2
        ends = np.array([middle, middle - along, middle + along])
        z = self._ground.heights(ends, of_road=y < 0.0)
        at = float(z[0])
        if not np.isfinite(at):  # No ground beside the road.
            edge = self._stretch.place(x, -0.1)[None]
            at = float(self._ground.heights(edge, of_road=True)[0])
        if not np.isfinite(at):  # Both are in slits of the ground.
            return
        pitch = 0.0
        if length > 0.0 and np.isfinite(z).all():
            pitch = -float(np.arctan2(z[2] - z[1], length))
        self._editing.add(
            f"{self._stretch.name}_{suffix}",
            semantic_class,
            model,
            RigidTransform(RollPitchYaw(0.0, pitch, yaw), [*middle, at]),
            CAUSE,
        )


def _stretches(ground: GroundSurface) -> list[_Stretch]:
    """Returns the longest straight piece of kerb in each cell."""
    best: dict[tuple[int, int], _Stretch] = {}
    for kerb in ground.kerbs(_SPACING):
        cells = np.floor(kerb.points / _CELL).astype(int)
        cuts = np.flatnonzero(np.diff(cells, axis=0).any(axis=1)) + 1
        for run in np.split(np.arange(len(cells)), cuts):
            points = kerb.points[run]
            walked = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
            if len(run) < 2:
                continue
            x, y = (int(value) for value in cells[run[0]])
            outward = kerb.outwards[run].mean(axis=0)
            stretch = _Stretch(f"works_{x:+d}_{y:+d}", points, outward)
            if stretch.length < _LENGTHS[0]:
                continue
            if walked > _MOST_BENT * stretch.length:
                continue
            if (x, y) not in best or stretch.length > best[x, y].length:
                best[x, y] = stretch
    return [best[cell] for cell in sorted(best)]
