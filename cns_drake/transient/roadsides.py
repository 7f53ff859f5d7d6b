"""Fills free places beside kerbs near a drive, such as with parked cars."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
import math
from pathlib import Path

import numpy as np

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.kerb_stretches import straight_kerbs
from cns_drake.transient.surroundings import Surroundings, change_rng
from evaluation.base import parse_yaml
from worlds.shapes import GROUND_CLASSES, OBJECTS, Area, Obstacles

# Cell size of the grid, in W, of kerb stretches [m].
_CELL = 6.5
# Least length of a stretch [m].
_SHORTEST = 3.0
# Distance between the places that are tried, away from the kerb [m].
_STEP = 0.4


@dataclass(frozen=True)
class _Row:
    """A row of objects along kerbs; `roadsides.yaml` explains the fields."""

    kinds: list[str]
    share: float
    nearest: tuple[float, float]
    farthest: float
    sizes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    along: Sequence[float] = (0.0,)
    turns: Sequence[float] = (0.0,)
    moves: bool = False

    @property
    def is_of_plants(self) -> bool:
        """Whether all objects of the row are plants."""
        classes = {OBJECTS[kind].semantic_class for kind in self.kinds}
        return classes == {"vegetation"}


_ROWS = {
    name: _Row(**values)
    for name, values in parse_yaml(
        Path(__file__).with_name("roadsides.yaml").read_bytes()
    ).items()
}


def fill_roadsides(around: Surroundings, density: float) -> None:
    """Adds objects to free places beside kerbs near a drive.

    The objects are, for example, parked cars, hedges, trees and garages. The
    seed of the temporary changes (`around.seed`) decides only where cars are
    parked; all other objects are the same for every seed.

    Args:
        around: surroundings of the drive, to which the objects are added.
        density: up to 1, the share of the free places that get an object.
            Above 1, all of these get one, and rows of plants come again in the
            room that is left: once for each further 1, and the last time to a
            share of the places.
    """
    stretches = straight_kerbs(around, "roadsides", _CELL, _SHORTEST)
    standing = around.obstacles_except(GROUND_CLASSES)
    standing.add("", around.ground.carriageway)
    for earlier, (name, row) in product(
        range(math.ceil(density)), _ROWS.items()
    ):
        if earlier > 0:
            if not row.is_of_plants:
                continue
            name = f"{name}_{earlier + 1}"
        seed = around.seed if row.moves else 0
        for stretch in stretches:
            rng = change_rng(seed, f"roadsides {name}", stretch.name)
            is_put_up = rng.uniform() < density - earlier
            if rng.uniform() >= row.share:
                continue
            builder = OBJECTS[str(rng.choice(row.kinds))]
            sizes = {k: float(rng.uniform(*v)) for k, v in row.sizes.items()}
            model = builder.build(rng, **sizes)
            length = sizes.get("length", 0)
            turn = float(rng.choice(row.turns))
            first = float(rng.uniform(*row.nearest))
            places = product(np.arange(first, row.farthest, _STEP), row.along)
            found = _first_free(
                (
                    (x, y, stretch.footprint(model, x, y, turn))
                    for y, x in places
                ),
                standing,
            )
            if found is None:
                continue
            x, y, area = found
            # Objects that a lower density leaves out take up room as well.
            standing.add(name, area)
            if is_put_up:
                stretch.put(
                    around,
                    suffix=name,
                    semantic_class=builder.semantic_class,
                    model=model,
                    x=x,
                    y=y,
                    turn=turn,
                    length=length,
                )


EFFECT = Effect("roadsides", Phase.MORE_OBJECTS, fill_roadsides)


def _first_free(
    places: Iterable[tuple[float, float, Area]],
    standing: Obstacles,
) -> tuple[float, float, Area] | None:
    """Returns the first place whose area is free; None if there is none.

    Args:
        places: x and y of each place in the frame of the stretch, and the area
            in W that the object would take there [m].
        standing: what the area must not touch.
    """
    for x, y, area in places:
        if standing.is_free(area):
            return x, y, area
    return None
