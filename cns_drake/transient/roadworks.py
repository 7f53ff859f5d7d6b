"""Puts up roadworks along kerbs near a drive."""

from dataclasses import dataclass

import numpy as np

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.kerb_stretches import KerbStretch, straight_kerbs
from cns_drake.transient.surroundings import Surroundings
from worlds.shapes import (
    GROUND_CLASSES,
    OBJECTS,
    Area,
    Obstacles,
    assemble,
    block,
    pick_key,
)

# Cell size of the grid, in W, of kerb stretches [m].
_CELL = 20.0
# Least and greatest length of a site [m].
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
# Classes of objects that a site may enclose.
_ENCLOSED = frozenset({"pole", "traffic-sign", "vegetation"}) | GROUND_CLASSES


def put_up_works(around: Surroundings, share: float) -> None:
    """Puts up roadworks along a share of the kerbs near a drive.

    Kerbs without free space get no roadworks.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the kerbs, from 0 to 1.
    """
    stretches = straight_kerbs(around, "works", _CELL, _LENGTHS[0])
    solid = around.obstacles_except(_ENCLOSED)
    standing = around.obstacles_except(GROUND_CLASSES)
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
                _Site(around, stretch, x, length, free[0], rng).build(standing)
                break


EFFECT = Effect("works", Phase.OBJECTS, put_up_works, order=5)


@dataclass
class _Site:
    """One roadworks site along a stretch of kerb.

    Attributes:
        around: surroundings of the drive, to which the site is added.
        stretch: the stretch of kerb.
        x: middle of the site in the frame of the stretch [m].
        length: length of the site along the kerb [m].
        width: distance of the outer fence from the kerb [m].
        rng: random generator of the site.
    """

    around: Surroundings
    stretch: KerbStretch
    x: float
    length: float
    width: float
    rng: np.random.Generator

    def build(self, standing: Obstacles) -> None:
        """Adds fences and new kerb stones, and machines where there is room.

        Args:
            standing: areas of all objects that stand on the ground.
        """
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
        self._add_machines(standing, middle)
        stones = self.stretch.rectangle(x, length, -_KERB_WIDTH, 0.0)
        if not stones.intersects(self.around.drive.area(1.3)):
            size = (length, _KERB_WIDTH, 2 * _KERB_HEIGHT)
            model = assemble(block("stones", size, (0, 0, 0), rgb=_KERB_RGB))
            y = -_KERB_WIDTH / 2
            self.stretch.put(
                self.around, "kerb", "sidewalk", model, x, y, 0.0, length
            )

    def _add_machines(self, standing: Obstacles, y: float) -> None:
        shares = _WIDE if self.width > 4.0 else _NARROW
        taken: list[Area] = []
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
                and standing.is_free(area)
                and not any(area.intersects(other) for other in taken)
            ):
                self.stretch.put(
                    self.around,
                    f"{name}_{len(taken)}",
                    OBJECTS[name].semantic_class,
                    model,
                    x,
                    y,
                    turn,
                )
                taken.append(area)
