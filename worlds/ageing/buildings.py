"""Buildings of an ageing city: demolished, replaced, extended and renewed."""

from collections.abc import Sequence
from dataclasses import replace
import itertools
import math

import numpy as np
import shapely
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from worlds.ageing import alterations, kinds
from worlds.ageing.lots import AgeingLot
from worlds.ageing.old_world import OldWorld
from worlds.ageing.plots import PARTY_WALL, Plot, building_plot
from worlds.ageing.standing_structures import StandingStructures
from worlds.ageing.trees import Trees
from worlds.ageing.yearly_draws import YearlyDraws
from worlds.city import (
    ARCHETYPES,
    building_site,
    lot_objects,
    sample,
    use_by_size,
)
from worlds.shapes import (
    OBJECTS,
    Model,
    Structure,
    from_above,
    largest_rectangle,
    lowered,
    placed,
    polygons_of,
    top_of,
)

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
# Buildings up to this height need no scaffold [m].
_NO_SCAFFOLD = 3.5
# Cars on an empty lot -> their weight in the random choice.
_CARS = {"hatchback": 3.0, "saloon": 3.0, "estate": 2.0, "van": 1.0}
# Classes of what leaves a building site even if it stands there in part.
_LOOSE = (
    "car", "truck", "bus", "bicycle", "other-vehicle", "other-object",
    "vegetation",
)  # fmt: skip


class Buildings:
    """The buildings of an ageing city, on their lots.

    Attributes:
        lots: the lots of all buildings, and free lots.
    """

    def __init__(
        self,
        world: OldWorld,
        standing: StandingStructures,
        draws: YearlyDraws,
        trees: Trees,
        lots: list[AgeingLot],
        kept_free: BaseGeometry,
    ) -> None:
        """Begins with the buildings of today.

        Args:
            world: the city of today.
            standing: the ageing city.
            draws: random numbers of the ageing city.
            trees: trees of the ageing city, which are felled for buildings.
            lots: lots of the ageing city.
            kept_free: area in W [m] on which nothing is built.
        """
        self.lots = lots
        self._world = world
        self._standing = standing
        self._draws = draws
        self._trees = trees
        self._kept_free = kept_free
        # Names of the scaffolds that stand for this year only.
        self._scaffolds: list[str] = []

    def live(self) -> None:
        """Simulates one year of all lots."""
        for name in self._scaffolds:
            self._standing.remove(name, because="scaffold")
        self._scaffolds = []
        for lot in self.lots:
            if lot.finished:
                self._build_on(lot)
            elif lot.building is not None:
                self._change(lot, lot.building)
        self._build_on_free_lots()

    def _change(self, lot: AgeingLot, name: str) -> None:
        """Samples whether and how the building of a lot changes."""
        if kinds.is_kept(self._standing.entry(name).kind):
            return
        for event, change in (
            ("demolished", self._demolish),
            ("extended", self._extend),
            ("renewed", self._renew),
        ):
            if self._draws.happens(event, name):
                change(lot, name)
                return

    def _demolish(self, lot: AgeingLot, name: str) -> None:
        self._standing.record("demolished", name)
        self._standing.remove(name)
        self._remove_parts(lot)
        lot.building = None
        rng = self._draws.generator("replaced", name)
        if rng.uniform() < _REPLACED:
            height = lot.height * float(rng.uniform(1.0, 1.7))
            self._open_site(lot, height, rng, replaced=name)
        if lot.coming is None:
            self._use_empty(lot)

    def _open_site(
        self,
        lot: AgeingLot,
        height: float,
        rng: np.random.Generator,
        *,
        replaced: str = "",
    ) -> None:
        """Opens a building site on a lot, if a new building fits there.

        Args:
            height: approximate height of the new building [m].
            replaced: name of the building that stood there; the new building
                has another archetype.
        """
        plot, standing = lot.plot, self._standing
        near = [
            standing.footprint(name)
            for name in standing.near(plot.area.buffer(PARTY_WALL))
            if standing.entry(name).semantic_class == "building"
        ]
        banned = self._archetype(replaced) if replaced else ""
        ending = f"{standing.year:03d}y_{lot.number:03d}"
        coming = new_building(plot, height, banned, near, rng, ending)
        if coming is None:
            return
        self._clear(plot.area.buffer(0.5))
        self._remove_parts(lot)
        lot.coming, lot.old = coming, replaced
        lot.finished = standing.year + 1 + int(rng.uniform() < _TWO_YEARS)
        for one in _building_site_on(plot, f"site_{ending}", rng):
            fences = [
                part
                for part in lot.parts
                if standing.entry(part).semantic_class == "fence"
            ]
            self._put_part(lot, one, "site", fences)
        standing.record("site", coming.name, f"site_{ending}")

    def _archetype(self, name: str) -> str:
        """Returns the archetype of a building, or else its kind."""
        entry = self._standing.entry(name)
        # Generated buildings have their district and archetype as tags.
        return entry.tags[-1] if len(entry.tags) > 1 else entry.kind

    def _clear(self, area: BaseGeometry) -> None:
        """Removes what stands in an area, except buildings."""
        standing = self._standing
        for name in standing.near(area):
            semantic_class = standing.entry(name).semantic_class
            if semantic_class in ("building", "other-structure"):
                continue
            footprint = standing.footprint(name)
            inside = footprint.intersection(area).area > 0.5 * footprint.area
            if not inside and semantic_class not in _LOOSE:
                continue
            standing.remove(name)
            self._trees.clear(name)
            is_plant = semantic_class == "vegetation"
            event = "felled" if is_plant else "removed"
            standing.record(event, name, detail="for a building site")

    def _remove_parts(self, lot: AgeingLot) -> None:
        """Removes what stands on a lot beside the building itself."""
        for part in lot.parts:
            self._standing.remove(part, because="plot")
        lot.parts = []
        lot.is_raised = lot.has_balconies = False

    def _put_part(
        self,
        lot: AgeingLot,
        one: Structure,
        because: str,
        ignored: Sequence[str] = (),
    ) -> None:
        """Adds a structure to a lot, if nothing but `ignored` is in the way."""
        if not self._standing.near(one.footprint_W, ignored):
            self._standing.put(one, because=because)
            lot.parts.append(one.name)

    def _use_empty(self, lot: AgeingLot) -> None:
        """Uses an empty lot as a car park, a market, a yard or a garden."""
        name = f"lot_{self._standing.year:03d}y_{lot.number:03d}"
        ground = lot.plot.inside(lot.plot.area.buffer(-0.5))
        bare = lot.plot.structure(name, "building", Model((), {}, ground))
        rng = self._draws.generator("lot", name)
        for one in lot_objects(bare, use_by_size(bare), _CARS, rng):
            self._put_part(lot, one, "empty plot")

    def _build_on(self, lot: AgeingLot) -> None:
        """Continues the building site of a lot, or finishes the building."""
        coming = lot.coming
        assert coming is not None
        self._remove_parts(lot)
        if self._standing.year < lot.finished:
            self._put_frame(lot, coming)
        else:
            self._finish(lot, coming)

    def _put_frame(self, lot: AgeingLot, coming: Structure) -> None:
        """Adds the unfinished frame of a building, with a scaffold."""
        model = _unfinished_frame(coming, seed=lot.number)
        frame = replace(coming, name=f"{coming.name}_frame", model=model)
        self._standing.put(frame)
        lot.parts.append(frame.name)
        self._put_scaffold(
            building_plot(coming), 0.5 * lot.height, frame.name, lot.parts
        )
        self._standing.record("frame", coming.name, frame.name)

    def _finish(self, lot: AgeingLot, coming: Structure) -> None:
        self._standing.put(coming)
        lot.building, lot.coming, lot.finished = coming.name, None, 0
        lot.plot = building_plot(coming)
        lot.height = float(top_of(coming.model))
        if lot.old:
            self._standing.record("replaced", lot.old, coming.name)
        else:
            self._standing.record("built", coming.name)

    def _put_scaffold(
        self, plot: Plot, height: float, name: str, scaffolds: list[str]
    ) -> None:
        """Adds a scaffold in front of a building, if nothing is in the way.

        Args:
            plot: plot of the building.
            height: height of the building [m].
            scaffolds: list to which the name of the scaffold is added.
        """
        rng = self._draws.generator("scaffold", name)
        one = alterations.scaffold_before(plot, height, f"scaffold_{name}", rng)
        area = one.footprint_W.buffer(-0.02)
        # Canopies and porches of the building itself may be in the way.
        own = self._standing.triangles(name)
        own = own[own[:, :, 2].min(axis=1) < plot.z + height]
        blocked = shapely.intersects(from_above(own), area).any()
        blocked |= bool(self._standing.near(area))
        free = not area.intersects(self._world.ground.carriageway)
        if free and not blocked and height > _NO_SCAFFOLD:
            self._standing.put(one, because="scaffold")
            scaffolds.append(one.name)

    def _build_on_free_lots(self) -> None:
        free = [lot for lot in self.lots if not (lot.building or lot.finished)]
        if not free:
            return
        stock = sum(lot.building is not None for lot in self.lots)
        share = min(1.0, self._draws.rates["built"] * stock / len(free))
        for k, lot in enumerate(free):
            name = f"lot_{lot.number:03d}"
            if self._draws.share("built", name) < share:
                rng = self._draws.generator("building", name)
                height = lot.height * float(rng.uniform(0.8, 1.5))
                self._open_site(lot, height, rng)
            hit = lot.coming is not None
            self._draws.tally.count("built", share, hit, stock if k == 0 else 0)

    def _extend(self, lot: AgeingLot, name: str) -> None:
        """Adds a storey or an annex to a building, if either fits."""
        rng = self._draws.generator("extended", name)
        triangles = self._standing.triangles(name)
        order = ["annex"]
        if lot.height < _HIGHEST_RAISED and not lot.is_raised:
            order.insert(int(rng.integers(2)), "storey")
        one = None
        for kind in order:
            new = f"{name}_{kind}_{self._standing.year:03d}y"
            if kind == "storey":
                one = alterations.storey_on(lot.plot, triangles, new, rng)
            else:
                one = alterations.annex_to(
                    lot.plot,
                    triangles,
                    new,
                    lambda area: self._is_free(area, name),
                    rng,
                )
            if one is not None:
                break
        if one is None:
            self._standing.record("extended", name, detail="within its walls")
            return
        self._standing.put(one)
        lot.parts.append(one.name)
        lot.is_raised |= kind == "storey"
        self._standing.record("extended", name, one.name)

    def _is_free(self, area: BaseGeometry, building: str) -> bool:
        """Returns whether an annex of a building may stand on an area."""
        return not (
            area.intersects(self._world.streets)
            or area.intersects(self._kept_free)
            or self._standing.near(area, (building,))
        )

    def _renew(self, lot: AgeingLot, name: str) -> None:
        """Gives a building new walls, and perhaps balconies."""
        standing = self._standing
        rng = self._draws.generator("renewed", name)
        alone = not [
            n
            for n in standing.near(
                standing.footprint(name).buffer(0.4), (name, *lot.parts)
            )
            if standing.entry(n).semantic_class
            in ("building", "other-structure", "fence")
        ]
        insulated = alone and rng.uniform() < _INSULATED
        triangles = standing.triangles(name)
        standing.by_name[name] = alterations.renovated(
            standing.structure(name), rng, insulated=insulated
        )
        balconies = ""
        if rng.uniform() < _WITH_BALCONIES and self._may_have_balconies(
            lot, name
        ):
            balconies = self._put_balconies(lot, name, triangles, rng)
        if rng.uniform() < _SCAFFOLDED:
            self._put_scaffold(lot.plot, lot.height, name, self._scaffolds)
        words = ["colour"]
        words += ["insulation"] if insulated else []
        words += ["balconies"] if balconies else []
        standing.record("renewed", name, balconies, " ".join(words))

    def _may_have_balconies(self, lot: AgeingLot, name: str) -> bool:
        return (
            not lot.has_balconies
            and kinds.is_dwelling(self._standing.entry(name).kind)
            and lot.height >= _LEAST_WITH_BALCONIES
        )

    def _put_balconies(
        self,
        lot: AgeingLot,
        name: str,
        triangles: np.ndarray,
        rng: np.random.Generator,
    ) -> str:
        """Adds balconies to a building; returns their name, "" if none fit.

        Args:
            lot: lot of the building.
            triangles: (M, 3, 3) triangles of the building in W [m].
        """
        one = alterations.balconies_on(
            lot.plot,
            triangles,
            f"{name}_balconies_{self._standing.year:03d}y",
            rng,
        )
        if one is None or one.footprint_W.intersects(
            self._world.ground.carriageway
        ):
            return ""
        self._standing.put(one, Polygon())
        lot.parts.append(one.name)
        lot.has_balconies = True
        return one.name


# Archetypes that are built today -> their weight in the random choice among
# those that fit.
_BUILT_TODAY = {
    "balcony_flats": 4,
    "gallery_flats": 2,
    "garden_flats": 3,
    "walk_up": 2,
    "brick_block": 2,
    "office": 3,
    "court_block": 2,
    "terrace": 2,
    "row_house": 2,
    "shop_house": 1,
    "semi_detached": 1,
    "detached_house": 1,
    "bungalow": 1,
    "grid_tower": 2,
    "banded_tower": 2,
    "slab_tower": 1,
    "podium_tower": 1,
}
# A frame is at least this high, about one storey [m].
_LEAST_FRAME = 4.0
# The height of each attempt to build, as a share of that of the attempt before,
# in three rounds over all archetypes. The aged cities of published results were
# made with these shares.
_FALLS = (1.0, 0.7, 0.45)


def new_building(
    plot: Plot,
    height: float,
    banned: str,
    neighbours: Sequence[BaseGeometry],
    rng: np.random.Generator,
    ending: str,
) -> Structure | None:
    """Returns a random new building for a plot; None if none fits.

    Args:
        plot: plot on which the building stands.
        height: approximate height of the building [m].
        banned: archetype (kind of building) that must not be used.
        neighbours: footprints of the neighbouring buildings in W.
        rng: random generator for the choice of the building.
        ending: end of the building's name, after the archetype.
    """
    x0, y0, x1, y1 = plot.room().bounds
    names = [name for name in _BUILT_TODAY if name != banned]
    weights = np.array([_BUILT_TODAY[name] for name in names], float)
    order = rng.choice(len(names), len(names), False, weights / weights.sum())
    near = [plot.inside(one) for one in neighbours]
    # The ground of a tower may have room for a lower building only. Therefore,
    # all archetypes are tried at the full height, and then again with a height
    # that falls from attempt to attempt.
    for fall, k in itertools.product(_FALLS, order):
        height *= fall
        name = names[k]
        kind = ARCHETYPES[name]
        w, d = (
            math.floor(10 * min(side, kind.widths[1])) / 10
            for side in (x1 - x0, y1 - y0)
        )
        h = round(float(np.clip(height, *kind.heights)), 1)
        if min(w, d) < kind.widths[0] or not 0.75 < h / height < 1.3:
            continue
        # The front of the new building is at the street, like that of the old
        # one.
        middle = ((x0 + x1) / 2, y0 + d / 2)
        footprint = box(-w / 2, -d / 2, w / 2, d / 2)
        blind = _blind_edges(placed(footprint, middle, 0.0), near)
        try:
            model = sample(name, footprint, h, rng, f"{name}_{ending}", blind)
        except ValueError:
            continue
        at = replace(plot, xy=plot.place(*middle))
        built = at.structure(f"{name}_{ending}", "building", model)
        return replace(built, tags=(name,))
    return None


def _blind_edges(footprint: Polygon, near: Sequence[BaseGeometry]) -> set[int]:
    """Returns the numbers of a rectangle's edges that have a neighbour.

    Edge 0 is the front; the others follow counter-clockwise.
    """
    x0, y0, x1, y1 = footprint.bounds
    g, e = PARTY_WALL, 0.5
    strips = (
        box(x0 + e, y0 - g, x1 - e, y0),
        box(x1, y0 + e, x1 + g, y1 - e),
        box(x0 + e, y1, x1 - e, y1 + g),
        box(x0 - g, y0 + e, x0, y1 - e),
    )
    return {
        k for k, strip in enumerate(strips) if any(map(strip.intersects, near))
    }


def _building_site_on(
    plot: Plot, name: str, rng: np.random.Generator
) -> list[Structure]:
    """Returns the structures of a building site: fences, machines and so on."""
    inner = plot.inside(plot.area.buffer(-0.4))
    lot = largest_rectangle(
        max(polygons_of(inner), key=lambda one: round(one.area, 6))
    )
    x0, y0, x1, y1 = lot.bounds
    structures = []
    for k, (x, y, turn, length) in enumerate(
        (
            ((x0 + x1) / 2, y0, 0.0, x1 - x0),
            (x1, (y0 + y1) / 2, math.pi / 2, y1 - y0),
            ((x0 + x1) / 2, y1, math.pi, x1 - x0),
            (x0, (y0 + y1) / 2, -math.pi / 2, y1 - y0),
        )
    ):
        fence = OBJECTS["site_fence"].build(rng, length=length)
        moved = Plot(plot.area, plot.place(x, y), plot.yaw + turn, plot.z)
        structures.append(moved.structure(f"{name}_fence_{k}", "fence", fence))
    empty = plot.structure(name, "building", Model((), {}, lot.buffer(-0.8)))
    digger = OBJECTS["excavator"]
    middle = plot.place(*lot.centroid.coords[0])
    turned = Plot(plot.area, middle, float(rng.uniform(-3.1, 3.1)), plot.z)
    model = digger.build(rng)
    digging = turned.structure(f"{name}_digger", digger.semantic_class, model)
    if plot.area.buffer(-0.8).contains(digging.footprint_W):
        structures.append(digging)
    return structures + list(lot_objects(empty, "yard", {}, rng))


def _unfinished_frame(building: Structure, seed: int) -> Model:
    """Returns the unfinished frame of a building under construction."""
    model, name = building.model, building.name
    height = max(0.55 * top_of(model), _LEAST_FRAME)
    try:
        return building_site(model, height, name, seed)
    except ValueError:  # The plot is too small for a crane.
        return lowered(model, height, f"{name}_frame", seed)
