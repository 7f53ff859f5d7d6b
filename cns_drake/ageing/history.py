"""The history of a city: which events happen, year after year.

The city in a year follows from the city in the year before. Each object has its
own random numbers for each year and event, so that a simulation of more years
begins with the same events as a simulation of fewer years.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import math

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.ageing import kinds, plots
from cns_drake.ageing.events import PUT_UP, TAKEN_DOWN, Event
from cns_drake.ageing.old_world import OldWorld
from cns_drake.ageing.plots import Plot
from cns_drake.ageing.rates import MOVED, Tally
from cns_drake.base.errors import InputError
from cns_drake.city.geometry import (
    Part,
    Structure,
    assemble,
    block,
    from_above,
    polygons_of,
)
from cns_drake.city.growth.lot_uses import lot_objects, use_by_size
from cns_drake.city.growth.lowering import top_of
from cns_drake.city.placement.frontage import lines_along, lot_at
from cns_drake.city.plants.plant_sizes import scaled_plant
from cns_drake.city.plants.trees import SPECIES
from cns_drake.imports.foreign_city import random_generator, random_share
from cns_drake.scene.materials import MATERIALS
from cns_drake.transient.loaded_structures import LoadedStructure

# Share of the demolished buildings that are replaced by others.
_REPLACED = 0.85
# Share of the sites that take two years; all others take one year.
_TWO_YEARS = 0.7
# Share of the renewed fronts with a scaffold in front, in the year of the
# renewal.
_SCAFFOLDED = 0.4
# Share of the free-standing renewed buildings with new insulation.
_INSULATED = 0.5
# Share of the renewed fronts with balconies, if they had none.
_WITH_BALCONIES = 0.35
# Greatest height of buildings that get another storey [m].
_HIGHEST_RAISED = 40.0
# Least height of buildings that get balconies [m].
_LEAST_WITH_BALCONIES = 8.0
# Least and greatest growth of a tree in a year [m].
_GROWTH = (0.3, 0.5)
# Least and greatest height of a tree when it is planted [m].
_PLANTED = (2.6, 3.6)
# After this number of years, a tree is old.
_YOUNG_YEARS = 10
# Lower plants are no trees [m].
_LEAST_TREE = 3.0
# A tree grows about the origin of its frame, unless this is so much lower or
# higher than its foot [m].
_FOOT = 2.0
# A crown keeps this share of its reach away from walls.
_CROWN_PART = 0.8
# Street furniture that moves does so by at least this distance [m].
_LEAST_MOVE = 0.2
# It turns by at most this angle [rad].
_MOST_TURN = 0.1
_TRIES = 6
_KERB = 0.1
# Widths of new plots along streets, tried in turn [m].
_PLOT_WIDTHS = (22.0, 16.0, 11.0)
# Greatest depth of new plots [m].
_PLOT_DEPTH = 14.0
# Distances of new plots from the street that are tried [m].
_SETBACKS = (3.0, 22.0)
_STEEPEST = 0.6
# No building on a small plot is higher than this [m].
_HIGHEST_NEW = 20.0
# Free plots farther than this from all buildings are open country [m].
_IN_TOWN = 30.0
# The ground's height at a plot is taken this far in front of it [m].
_IN_FRONT = 1.0
# Ground that is farther than this below a building's lowest point is not the
# building's: something else lies in front of it [m].
_DEEPEST_BELOW = 0.5
_GROUND = ("road", "parking", "sidewalk", "other-ground", "terrain")
_PASSING = ("car", "truck", "bus", "bicycle", "other-vehicle")


@dataclass
class _Lot:
    """A plot and what stands on it.

    `height` is the usual height of buildings there [m]. `parts` are annexes,
    storeys and balconies. If `coming` is a building, it is finished in the year
    `finished`, and replaces the building `old`, if any. A building gets one
    further storey at most (`is_raised`), and balconies once.
    """

    number: int
    plot: Plot
    height: float
    building: str | None
    parts: list[str]
    finished: int = 0
    coming: Structure | None = None
    old: str = ""
    is_raised: bool = False
    has_balconies: bool = False


@dataclass
class _Tree:
    """A tree that stands or was felled.

    `name` is its present name. The name of `whole` is that of the first tree at
    this place. `whole` is the tree at the height `full`. Its
    present height is 0 if it was felled, and `size` is the greatest height it
    can reach [m]. It is planted again in the year `replanted`.
    """

    name: str
    whole: Structure
    full: float
    height: float
    size: float
    planted: int
    replanted: int = 0

    def structure(self) -> Structure:
        factor = round(self.height / self.full, 4)
        model = scaled_plant(self.whole.model, factor)
        return replace(self.whole, name=self.name, model=model)


class AgeingCity:
    """A city at the end of a year.

    Attributes:
        year: the year; today is 0.
        standing: name of each existing structure -> the structure, or None if
            it is the same as today.
        new: name -> structure, for all structures that are not the same as
            today, in the order in which they were built.
        events: all events since today.
        tally: counts of these events.
    """

    def __init__(
        self,
        world: OldWorld,
        rates: Mapping[str, float],
        seed: int,
        kept_free: BaseGeometry,
    ):
        """Begins with the city of today.

        Args:
            world: the city of today.
            rates: event -> rate per year, see
                `cns_drake.ageing.rates.read_rates`.
            seed: seed of all random draws.
            kept_free: area in W [m] on which nothing is built, because drives
                lead across it.

        Raises:
            InputError: the city has no building.
        """
        self._world = world
        self._rates = rates
        self._seed = seed
        self._kept_free = kept_free
        self.tally = Tally(rates)
        self.year = 0
        self.standing: dict[str, Structure | None] = dict.fromkeys(
            world.visuals
        )
        self.events: list[Event] = []
        self.new: dict[str, Structure] = {}
        self._feet = {name: t.footprint for name, t in world.things.items()}
        self._tree = shapely.STRtree(list(self._feet.values()))
        self._names = list(self._feet)
        self._added: dict[str, BaseGeometry] = {}
        self._lots = list(self._lots_of_buildings())
        if not self._lots:
            raise InputError(
                f"{world.path}: no structure of class building: a map without "
                "lots does not age"
            )
        self._lots += self._free_lots()
        self._trees = list(self._trees_of_today())
        self._furniture = {
            name: event
            for name, one in world.things.items()
            if (event := _renewal(one, world.tags(name))) is not None
        }
        self._places = {name: name for name in self._furniture}
        self._junctions = world.junctions()
        self._kerbs: dict[str, str] = {}
        self._passing: list[str] = []

    # Random numbers.

    def _rng(self, purpose: str, name: str) -> np.random.Generator:
        return random_generator(self._seed, f"{purpose}/{self.year}", name)

    def _share(self, purpose: str, name: str) -> float:
        return random_share(self._seed, f"{purpose}/{self.year}", name)

    def _meets(self, event: str, name: str) -> bool:
        rate = self._rates[event]
        hit = self._share(event, name) < rate
        self.tally.count(event, rate, hit, 1)
        return hit

    # Bookkeeping.

    def _tell(
        self, event: str, structure: str, successor: str = "", detail: str = ""
    ) -> None:
        self.events.append(
            Event(self.year, event, structure, successor, detail)
        )

    def _put(
        self,
        one: Structure,
        foot: BaseGeometry | None = None,
        *,
        event: str = "",
    ) -> None:
        """Adds a structure.

        If `event` is given, the history records that the structure was put up
        because of this event, whose own record does not name it.
        """
        self.standing[one.name] = one
        self.new.setdefault(one.name, one)
        self._added[one.name] = one.footprint_W if foot is None else foot
        if event:
            self._tell(PUT_UP, one.name, detail=event)

    def _remove(self, name: str, *, event: str = "") -> None:
        """Removes a structure; for `event`, see `_put`."""
        is_there = name in self.standing
        self.standing.pop(name, None)
        self._added.pop(name, None)
        if event and is_there:
            self._tell(TAKEN_DOWN, name, detail=event)

    def near(
        self, area: BaseGeometry, ignored: Sequence[str] = ()
    ) -> list[str]:
        """Returns the names of structures, except ground, that touch an area.

        The area is in W. Structures with the names `ignored` are left out.
        """
        rows = sorted(self._tree.query(area, predicate="intersects"))
        found = [
            name
            for name in map(self._names.__getitem__, rows)
            if name in self.standing and name not in self._added
        ]
        found += [n for n, foot in self._added.items() if foot.intersects(area)]
        return [
            name
            for name in found
            if name not in ignored and self._class(name) not in _GROUND
        ]

    def _class(self, name: str) -> str:
        return self._known(name).semantic_class

    def _known(self, name: str) -> Structure | LoadedStructure:
        return self.new.get(name) or self._world.things[name]

    def _foot(self, name: str) -> BaseGeometry:
        return self._added.get(name, self._feet.get(name, Polygon()))

    def _structure(self, name: str) -> Structure:
        return self.standing.get(name) or self._world.structure(name)

    # What there is today.

    def _lots_of_buildings(self) -> Iterator[_Lot]:
        world = self._world
        buildings = world.of_class("building")
        feet = [one.footprint for one in buildings]
        tree = shapely.STRtree(feet)
        for number, one in enumerate(buildings):
            near = tree.query(one.footprint, predicate="intersects")
            others = [feet[k] for k in near if k != number]
            ways = shapely.intersection(
                world.streets, one.footprint.buffer(1.0)
            )
            blocked = shapely.union_all([*others, ways, self._kept_free])
            pieces = polygons_of(one.footprint.difference(blocked.buffer(0.02)))
            pieces = [p for p in pieces if p.area > 0.3 * one.footprint.area]
            if not pieces:
                continue
            area = max(pieces, key=lambda p: p.area).simplify(0.05)
            plot = Plot.facing(area, world.streets, one.bottom)
            z = self._front_height(plot, one.bottom)
            yield _Lot(number, replace(plot, z=z), one.top - z, one.name, [])

    def _front_height(self, plot: Plot, default: float) -> float:
        """Returns the height of the ground in front of a plot [m].

        A building may reach into the ground. `default` is the height of the
        building's lowest point [m]; it is returned where there is no ground in
        front, or where the ground there is much lower.
        """
        x0, y0, x1, _ = plot.inside(plot.area).bounds
        at = plot.place((x0 + x1) / 2, y0 - _IN_FRONT)
        z = self._world.ground.heights(np.array([at]))[0]
        is_known = np.isfinite(z) and z > default - _DEEPEST_BELOW
        return round(float(z), 3) if is_known else default

    def _free_lots(self) -> list[_Lot]:
        """Returns rectangles of open ground along streets as lots.

        Trees and furniture may stand on them.
        """
        world = self._world
        taken: list[BaseGeometry] = []
        streets = world.streets
        solid = [
            one.footprint.buffer(plots.PARTY_WALL)
            for one in world.things.values()
            if one.semantic_class in ("building", "other-structure")
        ]
        open_ground = world.open_ground.difference(shapely.union_all(solid))
        open_ground = open_ground.difference(self._kept_free.buffer(2.0))
        usual = shapely.STRtree([lot.plot.area for lot in self._lots])
        lots: list[_Lot] = []
        if open_ground.is_empty:
            return lots
        shapely.prepare(open_ground)
        for line in itertools.chain.from_iterable(
            lines_along(streets, open_ground, setback) for setback in _SETBACKS
        ):
            start = 0.0
            while start < line.length - _PLOT_WIDTHS[-1]:
                area = _fitting_plot(line, start, open_ground, taken)
                if area is None:
                    start += 4.0
                    continue
                z = world.ground.heights(shapely.get_coordinates(area))
                near = int(usual.nearest(area))
                lot = self._lots[near]
                is_town = lot.plot.area.distance(area) < _IN_TOWN
                if is_town and np.isfinite(z).all() and np.ptp(z) < _STEEPEST:
                    plot = Plot.facing(area, streets, float(z.min()))
                    taken.append(area)
                    side = min(plot.room().bounds[2:])
                    high = min(lot.height, _HIGHEST_NEW, 2.4 * side)
                    number = len(self._lots) + len(lots)
                    lots.append(_Lot(number, plot, high, None, []))
                start += 24.0
        return lots

    def _trees_of_today(self) -> Iterator[_Tree]:
        walls = [t.footprint for t in self._world.of_class("building")]
        tree = shapely.STRtree(walls)
        for one in self._world.of_class("vegetation"):
            height = one.top - one.bottom
            is_tree = one.kind == kinds.TREE or height > 4.0
            if height < _LEAST_TREE or not is_tree:
                continue
            middle = one.footprint.centroid
            whole = self._world.structure(one.name)
            *xy, z = whole.xyz
            is_below = one.outline.covers(shapely.Point(xy))
            if not is_below or abs(z - one.bottom) > _FOOT:
                # The frame of a tree of CityJSON is W.
                foot = (round(middle.x, 3), round(middle.y, 3), one.bottom)
                whole = whole.with_origin(foot)
            species = [
                one
                for part in whole.model.parts
                for name, one in SPECIES.items()
                if getattr(part.shape, "mesh", "").startswith(name)
            ]
            low, high = species[0].height_range if species else (8.0, 11.0)
            if species and "young" in whole.model.parts[0].shape.mesh:  # type: ignore
                low, high = 7.0, 9.0
            rng = random_generator(self._seed, "size", one.name)
            wall = float(middle.distance(walls[int(tree.nearest(middle))]))
            reach = _reach(self._world.triangles(one.name), middle)
            fits = wall / (_CROWN_PART * reach) * height
            size = min(float(rng.uniform(low, high)), fits)
            age = -int(rng.integers(_YOUNG_YEARS, 60))
            if height < size - 1.0:  # It has not grown up yet.
                age = -round((height - _PLANTED[0]) / np.mean(_GROWTH))
            yield _Tree(one.name, whole, height, height, max(size, height), age)

    # A year.

    def live(self) -> None:
        """Simulates one year: samples which structures change."""
        self.year += 1
        for name in self._passing:
            self._remove(name, event="scaffold")
        self._passing = []
        for lot in self._lots:
            if lot.finished:
                self._go_on(lot)
            elif lot.building is not None:
                self._meet(lot, lot.building)
        self._build_on_free_lots()
        self._grow_trees()
        for place in self._furniture:
            event = self._furniture[place]
            if self._places[place] in self.standing and self._meets(
                event, place
            ):
                self._move(place)
        for name, area in self._junctions.items():
            if self._meets("junctions", name):
                self._rebuild_junction(name, area)
        self._paint_markings()

    def _meet(self, lot: _Lot, name: str) -> None:
        if kinds.is_kept(self._known(name).kind):
            return
        for event, change in (
            ("demolished", self._demolish),
            ("extended", self._extend),
            ("renewed", self._renew),
        ):
            if self._meets(event, name):
                change(lot, name)
                return

    def _clear(self, area: BaseGeometry) -> None:
        """Removes what stands on a plot."""
        for name in self.near(area):
            kind, foot = self._class(name), self._foot(name)
            inside = foot.intersection(area).area > 0.5 * foot.area
            is_loose = kind in (*_PASSING, "other-object", "vegetation")
            is_solid = kind in ("building", "other-structure")
            if is_solid or not (inside or is_loose):
                continue
            self._remove(name)
            for tree in self._trees:
                if tree.name == name:
                    tree.height, tree.replanted = 0.0, 0
            event = "felled" if kind == "vegetation" else "removed"
            self._tell(event, name, detail="for a building site")

    def _demolish(self, lot: _Lot, name: str) -> None:
        self._tell("demolished", name)
        self._remove(name)
        self._empty(lot)
        lot.building = None
        rng = self._rng("replaced", name)
        if rng.uniform() < _REPLACED:
            height = lot.height * float(rng.uniform(1.0, 1.7))
            self._open_site(lot, height, self._archetype(name), rng, name)
        if lot.coming is None:
            self._leave_empty(lot)

    def _archetype(self, name: str) -> str:
        # Generated buildings have their district and archetype as tags.
        _, *archetype = self._world.tags(name) or ("",)
        return archetype[-1] if archetype else self._known(name).kind

    def _open_site(
        self,
        lot: _Lot,
        height: float,
        banned: str,
        rng: np.random.Generator,
        old: str = "",
    ) -> None:
        """Opens a building site on a lot, if a new building fits there."""
        plot = lot.plot
        near = [
            self._foot(name)
            for name in self.near(plot.area.buffer(plots.PARTY_WALL))
            if self._class(name) == "building"
        ]
        ending = f"{self.year:03d}y_{lot.number:03d}"
        coming = plots.new_building(plot, height, banned, near, rng, ending)
        if coming is None:
            return
        self._clear(plot.area.buffer(0.5))
        self._empty(lot)
        lot.coming, lot.old = coming, old
        lot.finished = self.year + 1 + int(rng.uniform() < _TWO_YEARS)
        for one in plots.building_site_on(plot, f"site_{ending}", rng):
            fences = [p for p in lot.parts if self._class(p) == "fence"]
            if not self.near(one.footprint_W, fences):
                self._put(one, event="site")
                lot.parts.append(one.name)
        self._tell("site", coming.name, f"site_{ending}")

    def _empty(self, lot: _Lot) -> None:
        for part in lot.parts:
            self._remove(part, event="plot")
        lot.parts = []
        lot.is_raised = lot.has_balconies = False

    def _leave_empty(self, lot: _Lot) -> None:
        """Uses an empty lot as a car park, a market, a yard or a garden."""
        name = f"lot_{self.year:03d}y_{lot.number:03d}"
        ground = lot.plot.inside(lot.plot.area.buffer(-0.5))
        model = replace(assemble(), footprint=ground)
        bare = lot.plot.thing(name, "building", model)
        cars = {"hatchback": 3.0, "saloon": 3.0, "estate": 2.0, "van": 1.0}
        rng = self._rng("lot", name)
        for one in lot_objects(bare, use_by_size(bare), cars, rng):
            if not self.near(one.footprint_W):
                self._put(one, event="empty plot")
                lot.parts.append(one.name)

    def _go_on(self, lot: _Lot) -> None:
        """Continues the building site of a lot, or finishes the building."""
        coming = lot.coming
        assert coming is not None
        self._empty(lot)
        if self.year < lot.finished:
            model = plots.unfinished_frame(coming, seed=lot.number)
            one = replace(coming, name=f"{coming.name}_frame", model=model)
            self._put(one)
            lot.parts.append(one.name)
            plot = plots.building_plot(coming)
            height = 0.5 * lot.height
            self._scaffold(plot, height, one.name, lot.parts)
            self._tell("frame", coming.name, one.name)
            return
        self._put(coming)
        lot.building, lot.coming, lot.finished = coming.name, None, 0
        lot.plot = plots.building_plot(coming)
        lot.height = float(top_of(coming.model))
        if lot.old:
            self._tell("replaced", lot.old, coming.name)
        else:
            self._tell("built", coming.name)

    def _scaffold(
        self, plot: Plot, height: float, name: str, parts: list[str]
    ) -> None:
        rng = self._rng("scaffold", name)
        one = plots.scaffold_before(plot, height, f"scaffold_{name}", rng)
        area = one.footprint_W.buffer(-0.02)
        # Canopies and porches of the building itself may be in the way.
        own = self._triangles(name)
        own = own[own[:, :, 2].min(axis=1) < plot.z + height]
        blocked = shapely.intersects(from_above(own), area).any()
        blocked |= bool(self.near(area))
        free = not area.intersects(self._world.ground.carriageway)
        if free and not blocked and height > 3.5:
            self._put(one, event="scaffold")
            parts.append(one.name)

    def _build_on_free_lots(self) -> None:
        free = [lot for lot in self._lots if not (lot.building or lot.finished)]
        if not free:
            return
        stock = sum(lot.building is not None for lot in self._lots)
        share = min(1.0, self._rates["built"] * stock / len(free))
        for k, lot in enumerate(free):
            name = f"lot_{lot.number:03d}"
            if self._share("built", name) < share:
                rng = self._rng("building", name)
                height = lot.height * float(rng.uniform(0.8, 1.5))
                self._open_site(lot, height, "", rng)
            hit = lot.coming is not None
            self.tally.count("built", share, hit, stock if k == 0 else 0)

    def _extend(self, lot: _Lot, name: str) -> None:
        rng = self._rng("extended", name)
        triangles = self._triangles(name)
        order = ["annex"]
        if lot.height < _HIGHEST_RAISED and not lot.is_raised:
            order.insert(int(rng.integers(2)), "storey")
        one = None
        for kind in order:
            new = f"{name}_{kind}_{self.year:03d}y"
            if kind == "storey":
                one = plots.storey_on(lot.plot, triangles, new, rng)
            else:
                one = plots.annex_to(
                    lot.plot,
                    triangles,
                    new,
                    lambda area: self._is_free(area, name),
                    rng,
                )
            if one is not None:
                break
        if one is None:
            self._tell("extended", name, detail="within its walls")
            return
        self._put(one)
        lot.parts.append(one.name)
        lot.is_raised |= kind == "storey"
        self._tell("extended", name, one.name)

    def _is_free(self, area: BaseGeometry, building: str) -> bool:
        return not (
            area.intersects(self._world.streets)
            or area.intersects(self._kept_free)
            or self.near(area, (building,))
        )

    def _triangles(self, name: str) -> np.ndarray:
        if name in self._world.things and self.standing[name] is None:
            return self._world.triangles(name)
        return plots.structure_triangles(self._structure(name))

    def _renew(self, lot: _Lot, name: str) -> None:
        rng = self._rng("renewed", name)
        foot = self._foot(name)
        alone = not [
            n
            for n in self.near(foot.buffer(0.4), (name, *lot.parts))
            if self._class(n) in ("building", "other-structure", "fence")
        ]
        insulated = alone and rng.uniform() < _INSULATED
        triangles = self._triangles(name)
        self.standing[name] = plots.renovated(
            self._structure(name), insulated, rng
        )
        words = ["colour", *(["insulation"] if insulated else [])]
        may_have = (
            not lot.has_balconies
            and kinds.is_dwelling(self._known(name).kind)
            and lot.height >= _LEAST_WITH_BALCONIES
        )
        added = ""
        if rng.uniform() < _WITH_BALCONIES and may_have:
            one = plots.balconies_on(
                lot.plot, triangles, f"{name}_balconies_{self.year:03d}y", rng
            )
            if one is not None and not one.footprint_W.intersects(
                self._world.ground.carriageway
            ):
                self._put(one, Polygon())
                lot.parts.append(one.name)
                lot.has_balconies = True
                added = one.name
                words.append("balconies")
        if rng.uniform() < _SCAFFOLDED:
            self._scaffold(lot.plot, lot.height, name, self._passing)
        self._tell("renewed", name, added, " ".join(words))

    # Trees and furniture.

    def _grow_trees(self) -> None:
        for tree in self._trees:
            if tree.height == 0.0:
                if tree.replanted == self.year:
                    self._plant(tree)
                continue
            is_young = self.year - tree.planted < _YOUNG_YEARS
            event = "felled_young" if is_young else "felled"
            if self._meets(event, tree.name):
                self._remove(tree.name)
                self._tell("felled", tree.name)
                tree.height = 0.0
                rng = self._rng("replanted", tree.name)
                tree.replanted = self.year + int(rng.integers(1, 3))
            elif tree.height < tree.size - 0.05:
                by = self._rng("grown", tree.name).uniform(*_GROWTH)
                tree.height = round(min(tree.height + by, tree.size), 2)
                self.standing[tree.name] = tree.structure()
                self._tell("grown", tree.name, detail=f"{tree.height:g} m")

    def _plant(self, tree: _Tree) -> None:
        place = shapely.Point(tree.whole.xyz[:2]).buffer(0.4)
        if self.near(place):
            return
        old = tree.name
        tree.name = f"{tree.whole.name}_{self.year:03d}y"
        tree.height = round(
            float(self._rng("planted", old).uniform(*_PLANTED)), 2
        )
        tree.planted = self.year
        self._put(tree.structure(), place)
        self._tell("planted", old, tree.name, f"{tree.height:g} m")

    def _move(self, place: str) -> None:
        """Replaces street furniture nearby, on the same side of the kerb."""
        old = self._places[place]
        rng = self._rng("moved", place)
        foot = self._foot(old)
        middle = np.array(foot.centroid.coords[0])
        ground = self._world.ground
        offset = np.zeros(2)
        turn = 0.0
        rise = 0.0
        farthest = self._rates[MOVED]
        for _ in range(_TRIES if farthest else 0):
            angle = rng.uniform(-np.pi, np.pi)
            by = float(rng.uniform(min(_LEAST_MOVE, farthest), farthest))
            step = by * np.array([math.cos(angle), math.sin(angle)])
            up = ground.rise(middle, middle + step)
            area = affinity.translate(foot, *step)
            if (
                abs(up) < _KERB
                and not self.near(area, (old,))
                and not area.intersects(ground.carriageway)
                and not area.intersects(self._kept_free)
            ):
                turn = float(rng.uniform(-_MOST_TURN, _MOST_TURN))
                offset, rise = step, up
                break
        whole = self._structure(old)
        x, y = _turned(np.array(whole.xyz[:2]) - middle, turn)
        xyz = (
            round(float(middle[0] + offset[0] + x), 3),
            round(float(middle[1] + offset[1] + y), 3),
            round(whole.xyz[2] + rise, 3),
        )
        name = f"{place}_{self.year:03d}y"
        new = replace(whole, name=name, xyz=xyz, yaw=round(whole.yaw + turn, 5))
        self._remove(old)
        foot = affinity.rotate(foot, turn, use_radians=True)
        self._put(new, affinity.translate(foot, *offset))
        self._places[place] = name
        by = math.hypot(*offset)
        self._tell("furniture", old, name, f"moved by {by:.1f} m")

    def _rebuild_junction(self, name: str, area: BaseGeometry) -> None:
        """Replaces the kerb stones, poles and signs of a junction."""
        around = area.buffer(8.0)
        for place in self._furniture:
            old = self._places[place]
            near = self._foot(old).intersects(around)
            is_part = self._furniture[place] != "benches"
            if near and is_part and old in self.standing:
                self._move(place)
        self._remove(self._kerbs.get(name, ""), event="junction")
        stones: list[Part] = []
        ground = self._world.ground
        for kerb in ground.kerbs(1.0):
            for k in range(len(kerb.points) - 1):
                a, b = kerb.points[k : k + 2]
                line = LineString([a, b])
                if not around.contains(line) or line.length > 1.5:
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
        successor = ""
        if stones:
            successor = f"kerb_{name}_{self.year:03d}y"
            model = assemble(*stones)
            one = Structure(successor, "sidewalk", model, (0.0, 0.0, 0.0))
            self._put(one, Polygon())
            self._kerbs[name] = successor
        self._tell("junction", name, successor)

    def _paint_markings(self) -> None:
        for one in self._world.of_class("road"):
            is_paint = any(part.material == _PAINT for part in one.parts)
            if is_paint and self._meets("markings", one.name):
                tint = float(self._rng("tint", one.name).uniform(0.75, 1.0))
                whole = self._world.structure(one.name)
                parts = tuple(
                    replace(p, rgb=(round(0.9 * tint, 3),) * 3)
                    for p in whole.model.parts
                )
                model = replace(whole.model, parts=parts)
                self.standing[one.name] = replace(whole, model=model)
                self._tell("markings", one.name, detail=f"{tint:.2f}")


_STONE = (0.8, 0.8, 0.78)
# The material of road markings.
_PAINT = MATERIALS["markings"]


def _renewal(one: LoadedStructure, tags: Sequence[str]) -> str | None:
    """Returns the event that replaces a piece of street furniture, or None."""
    if one.semantic_class == "traffic-sign":
        return "signs"
    if one.semantic_class == "pole":
        return "signals" if kinds.is_signal(one.kind) else "lamps"
    small = one.footprint.area < 6.0 and one.top - one.bottom < 4.0
    # What stands on an empty lot leaves with the lot.
    if one.semantic_class == "other-object" and small and "lot" not in tags:
        return "benches"
    return None


def _reach(triangles: np.ndarray, middle: BaseGeometry) -> float:
    xy = triangles[:, :, :2].reshape(-1, 2) - middle.coords[0]
    return float(np.hypot(*xy.T).max(initial=0.5))


def _turned(xy: np.ndarray, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * xy[0] - s * xy[1], s * xy[0] + c * xy[1]


def _fitting_plot(
    line: LineString,
    start: float,
    within: BaseGeometry,
    taken: Sequence[BaseGeometry],
) -> Polygon | None:
    """Returns the widest free rectangle along a line; None if none fits."""
    for width in _PLOT_WIDTHS:
        lot = lot_at(line, start, width, min(_PLOT_DEPTH, width))
        if lot is None or not within.contains(lot.footprint_W):
            continue
        room = lot.footprint_W.buffer(plots.PARTY_WALL)
        if not any(room.intersects(one) for one in taken):
            return lot.footprint_W
    return None
