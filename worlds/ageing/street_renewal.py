"""Streets of an ageing city: furniture, kerbs and markings are renewed."""

from dataclasses import replace
import math

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from worlds.ageing import kinds
from worlds.ageing.old_world import OldWorld
from worlds.ageing.rates import MOVED
from worlds.ageing.standing_structures import StandingStructures
from worlds.ageing.yearly_draws import YearlyDraws
from worlds.shapes import (
    MATERIALS,
    Part,
    Structure,
    StructureGeometry,
    assemble,
    block,
)

# Street furniture that moves does so by at least this distance [m].
_LEAST_MOVE = 0.2
# It turns by at most this angle [rad].
_MOST_TURN = 0.1
# Number of random places that are tried for it.
_TRIES = 6
# A greater difference in height is a kerb [m].
_KERB = 0.1
# Furniture and kerbs this near to a junction are rebuilt with it [m].
_AROUND_JUNCTION = 8.0
# Greatest length of a kerb stone [m].
_LONGEST_STONE = 1.5
# Colour of kerb stones.
_STONE = (0.8, 0.8, 0.78)
# The material of road markings.
_PAINT = MATERIALS["markings"]


class StreetRenewal:
    """Renews the furniture, junctions and markings of an ageing city."""

    def __init__(
        self,
        world: OldWorld,
        standing: StandingStructures,
        draws: YearlyDraws,
        kept_free: BaseGeometry,
    ) -> None:
        """Begins with the streets of today.

        Args:
            world: the city of today.
            standing: the ageing city.
            draws: random numbers of the ageing city.
            kept_free: area in W [m] that stays free.
        """
        self._world = world
        self._standing = standing
        self._draws = draws
        self._kept_free = kept_free
        # Name of a piece of furniture today -> the event that replaces it.
        self._furniture = {
            name: event
            for name, one in world.geometry.items()
            if (event := _replacing_event(one)) is not None
        }
        # The same name -> the present name.
        self._present = {name: name for name in self._furniture}
        self._junctions = world.junctions()
        # Name of a junction -> name of its kerb stones.
        self._kerbs: dict[str, str] = {}

    def live(self) -> None:
        """Simulates one year."""
        for first, event in self._furniture.items():
            is_there = self._present[first] in self._standing.by_name
            if is_there and self._draws.happens(event, first):
                self._replace(first)
        for name, area in self._junctions.items():
            if self._draws.happens("junctions", name):
                self._rebuild_junction(name, area)
        self._paint_markings()

    def _replace(self, first: str) -> None:
        """Puts a new piece of furniture in place of an old one.

        The new piece stands close to the old one, on the same side of the kerb.

        Args:
            first: name of the piece that stands there today.
        """
        standing = self._standing
        old = self._present[first]
        rng = self._draws.generator("moved", first)
        footprint = standing.footprint(old)
        middle = np.array(footprint.centroid.coords[0])
        offset, rise, turn = self._free_place(old, footprint, rng)
        whole = standing.structure(old)
        x, y = _turned(np.array(whole.xyz[:2]) - middle, turn)
        xyz = (
            round(float(middle[0] + offset[0] + x), 3),
            round(float(middle[1] + offset[1] + y), 3),
            round(whole.xyz[2] + rise, 3),
        )
        name = f"{first}_{standing.year:03d}y"
        new = replace(whole, name=name, xyz=xyz, yaw=round(whole.yaw + turn, 5))
        standing.remove(old)
        footprint = affinity.rotate(footprint, turn, use_radians=True)
        standing.put(new, affinity.translate(footprint, *offset))
        self._present[first] = name
        by = math.hypot(*offset)
        standing.record("furniture", old, name, f"moved by {by:.1f} m")

    def _free_place(
        self, name: str, footprint: BaseGeometry, rng: np.random.Generator
    ) -> tuple[np.ndarray, float, float]:
        """Returns how a piece of furniture moves to its new place.

        Args:
            footprint: footprint of the piece in W [m].

        Returns:
            (2,) offset in W [m], rise of the ground [m] and turn [rad]. All are
            zero if none of the tried places is free.
        """
        ground = self._world.ground
        middle = np.array(footprint.centroid.coords[0])
        farthest = self._draws.rates[MOVED]
        for _ in range(_TRIES if farthest else 0):
            angle = rng.uniform(-np.pi, np.pi)
            by = float(rng.uniform(min(_LEAST_MOVE, farthest), farthest))
            offset = by * np.array([math.cos(angle), math.sin(angle)])
            rise = ground.rise(middle, middle + offset)
            area = affinity.translate(footprint, *offset)
            if (
                abs(rise) < _KERB
                and not self._standing.near(area, (name,))
                and not area.intersects(ground.carriageway)
                and not area.intersects(self._kept_free)
            ):
                return offset, rise, float(rng.uniform(-_MOST_TURN, _MOST_TURN))
        return np.zeros(2), 0.0, 0.0

    def _rebuild_junction(self, name: str, area: BaseGeometry) -> None:
        """Replaces the kerb stones, poles and signs of a junction."""
        standing = self._standing
        around = area.buffer(_AROUND_JUNCTION)
        for first, event in self._furniture.items():
            old = self._present[first]
            is_near = standing.footprint(old).intersects(around)
            if is_near and event != "benches" and old in standing.by_name:
                self._replace(first)
        standing.remove(self._kerbs.get(name, ""), because="junction")
        stones = self._kerb_stones(around)
        successor = ""
        if stones:
            successor = f"kerb_{name}_{standing.year:03d}y"
            model = assemble(*stones)
            one = Structure(successor, "sidewalk", model, (0.0, 0.0, 0.0))
            standing.put(one, Polygon())
            self._kerbs[name] = successor
        standing.record("junction", name, successor)

    def _kerb_stones(self, around: BaseGeometry) -> list[Part]:
        """Returns stones along all kerbs in an area of W [m]."""
        stones: list[Part] = []
        ground = self._world.ground
        for kerb in ground.kerbs(1.0):
            for k in range(len(kerb.points) - 1):
                a, b = kerb.points[k : k + 2]
                line = LineString([a, b])
                if not around.contains(line) or line.length > _LONGEST_STONE:
                    continue
                if line.buffer(0.4).intersects(self._kept_free):
                    continue
                middle = (a + b) / 2 - 0.15 * kerb.outwards[k]
                z = ground.heights(middle[None], of_road=True)[0]
                if np.isfinite(z):
                    yaw = math.atan2(*(b - a)[::-1])
                    size = (line.length + 0.05, 0.3, 0.3)
                    at = (*middle, z - 0.02)
                    stones.append(
                        block(f"stone_{len(stones)}", size, at, yaw, _STONE)
                    )
        return stones

    def _paint_markings(self) -> None:
        for one in self._world.of_class("road"):
            is_paint = any(part.material == _PAINT for part in one.parts)
            if is_paint and self._draws.happens("markings", one.name):
                rng = self._draws.generator("tint", one.name)
                tint = float(rng.uniform(0.75, 1.0))
                whole = self._world.structure(one.name)
                parts = tuple(
                    replace(p, rgb=(round(0.9 * tint, 3),) * 3)
                    for p in whole.model.parts
                )
                model = replace(whole.model, parts=parts)
                self._standing.by_name[one.name] = replace(whole, model=model)
                self._standing.record(
                    "markings", one.name, detail=f"{tint:.2f}"
                )


def _replacing_event(one: StructureGeometry) -> str | None:
    """Returns the event that replaces a structure; None if none does."""
    if one.semantic_class == "traffic-sign":
        return "signs"
    if one.semantic_class == "pole":
        return "signals" if kinds.is_signal(one.kind) else "lamps"
    is_small = one.footprint.area < 6.0 and one.top - one.bottom < 4.0
    # What stands on an empty lot leaves with the lot.
    is_on_lot = "lot" in one.entry.tags
    if one.semantic_class == "other-object" and is_small and not is_on_lot:
        return "benches"
    return None


def _turned(xy: np.ndarray, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * xy[0] - s * xy[1], s * xy[0] + c * xy[1]
