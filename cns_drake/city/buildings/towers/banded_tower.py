"""The banded office tower: round corners, bands of glass, gardens between."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade, Relief, facade_mesh
from cns_drake.city.geometry.mesh import merge_meshes
from cns_drake.city.geometry.structures import MeshShape

_BANDS = (
    (0.84, 0.84, 0.82),
    (0.74, 0.70, 0.62),
    (0.58, 0.60, 0.62),
    (0.66, 0.52, 0.42),
)
_GLASSES = ((0.22, 0.30, 0.36), (0.24, 0.36, 0.36), (0.18, 0.22, 0.28))


class Parameters:
    """Parameters of a tower; lengths in metres.

    Attributes:
        height: of the parapet.
        radius: of the rounded corners.
        corners: which corners of the rectangle are round.
        stacks: of storeys, with an open floor between two.
        turn: by which every other stack is smaller.
        lobby: height of the ground floor.
        storey: wanted height of a storey.
        spandrel: height of the bands between the glass.
        ledge: how far a sunshade above the glass sticks out.
        recess: of the glass.
        fins: distance between upright fins; 0 for none.
    """

    def __init__(self, d: Dice) -> None:
        side = massing.shortest_side(d.site.outline)
        self.height = d.height
        self.radius = round(d.uniform(0.18, 0.42) * side, 2)
        self.corners = d.pick(((0, 1, 2, 3), (0, 2), (0, 1), (1,)))
        self.stacks = int(np.clip(round(d.height / d.uniform(24, 40)), 1, 3))
        self.turn = d.uniform(0.03, 0.08) * side
        self.lobby = d.uniform(5.0, 7.5, 2)
        self.storey = d.uniform(3.5, 4.0)
        self.spandrel = d.uniform(0.9, 1.3, 2)
        self.ledge = d.pick((0.15, 0.5, 0.8))
        self.recess = d.uniform(0.2, 0.4, 2)
        self.fins = d.pick((0.0, 5.0, 7.0))
        self.roof_items = d.some_of(
            "lift_house cooling_tower air_handler ac_unit mast", 2, 6
        )
        self.rgb = d.pick(_BANDS)
        self.glass_rgb = d.pick(_GLASSES)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the tower on a rectangle."""
    out.glass_rgb = p.glass_rgb
    x0, y0, x1, y1 = out.site.bounds
    base = massing.rectangle(x0 + 0.8, y0 + 0.8, x1 - 0.8, y1 - 0.8)
    step = max(2.8, 0.5 * p.radius)
    outer = np.round(
        massing.rounded(base, dict.fromkeys(p.corners, p.radius), step), 3
    )
    inner = massing.inset(outer, min(p.turn, 0.5 * massing.inset_limit(outer)))
    z = _add_lobby(out, p, inner)
    gap = 3.4
    room = (p.height - 1.2 - z - gap * (p.stacks - 1)) / p.stacks
    counts = tiers.divided(room, p.storey, 12 // p.stacks)
    shapes = [
        _Stack(out, p, plan, counts, name)
        for plan, name in ((outer, "wide"), (inner, "slim"))[: p.stacks]
    ]
    for k in range(p.stacks):
        z = shapes[k % 2].place(z, k)
        if k + 1 < p.stacks:
            z = _add_garden(out, shapes[k % 2].plan, inner, z, gap, k)
    plan = shapes[(p.stacks - 1) % 2].plan
    rim = round(p.height - z, 3)
    crown = Facade(rim, (Band(rim - 0.4, rim, -min(0.3, p.ledge)),))
    roof = tiers.add_crown(
        out, plan, crown, z, min(0.9, rim - 0.1), thickness=0.3
    )
    equip_roof(out, plan, roof, p.roof_items)


def _add_lobby(out: Assembly, p: Parameters, plan: np.ndarray) -> float:
    h = p.lobby
    pane = bays.ribbon(0.2, h - 0.9, 0.3, 0.16)
    # Long walls may meet at right angles, where recesses must not touch.
    short, long = (bays.rhythm(3.2, [pane], m) for m in (0.1, 0.45))

    def glazing(edge: int, length: float) -> Sequence[Relief]:
        return (short if length < 4.5 else long)(edge, length)

    door = bays.entrance(3.4, 3.0, 1.2, surround=0.1)
    layout = bays.with_door(glazing, door, 5.2)
    facade = Facade(h, (Band(h - 0.6, h, -0.15),), layout, (0.3,))
    half = min(3.5, max(1.2, details.WallFrame(plan, 0).length / 2 - 0.5))
    lid = details.front_canopy(plan, half, 2.0, 3.5)
    return tiers.add_ground(out, plan, facade, [lid])


class _Stack:
    """Storeys of one outline, to be placed several times."""

    def __init__(
        self,
        out: Assembly,
        p: Parameters,
        plan: np.ndarray,
        counts: tuple[int, int, float],
        name: str,
    ):
        self.plan = plan
        self._out = out
        self._groups, per_group, storey = counts
        self._step = per_group * storey
        bands = (
            Band(0.0, p.spandrel, 0.0),
            Band(p.spandrel, storey, p.recess),
            Band(storey - 0.2, storey, -p.ledge),
        )
        facade = Facade(storey, bands, glass=(p.recess,)).stacked(per_group)
        pieces = [facade_mesh(plan, facade)]
        if p.fins > 0:
            # They cross the sunshades and meet those above and below.
            fins = details.piers(
                plan, p.fins, 0.18, p.ledge + 0.1, 0.0, self._step,
                depth=p.recess + 0.05, margin=0.8,
            )  # fmt: skip
            pieces.append(fins)
        self._height = round(self._groups * self._step, 3)
        pane = massing.inset(plan, p.recess - 0.004)
        glass = massing.skirt(pane, pane, 0.0, self._height)
        soffit = massing.flat(plan, 0.0, up=False)
        self._walls, self._glass, self._soffit = (
            MeshShape(out.define(f"{name}{part}", mesh))
            for part, mesh in (
                ("", merge_meshes(*pieces)),
                ("_glass", glass),
                ("_soffit", soffit),
            )
        )

    def place(self, z0: float, number: int) -> float:
        """Places the storeys; returns their top [m]."""
        at, part, out = (0.0, 0.0, z0), f"stack_{number}", self._out
        out.place(f"{part}_glass", self._glass, at, rgb=out.glass_rgb)
        out.place(f"{part}_soffit", self._soffit, at)
        for k in range(self._groups):
            z = z0 + k * self._step
            out.place(f"{part}_storey_{k:02d}", self._walls, (0.0, 0.0, z))
        return round(z0 + self._height, 3)


def _add_garden(
    out: Assembly,
    plan: np.ndarray,
    inner: np.ndarray,
    z0: float,
    height: float,
    number: int,
) -> float:
    """Adds an open floor: columns around a smaller glazed core.

    Args:
        out: the building.
        plan: outline of the floor.
        inner: the smallest outline of the storeys above.
        z0, height: of the floor [m].
        number: of the garden.
    """
    limit = massing.inset_limit(inner)
    core = massing.inset(inner, min(2.8, 0.6 * limit))
    walls = tiers.block(core, Facade(height, (Band(0.4, 2.9, 0.15),)), z0)
    ring = massing.inset(inner, min(0.8, 0.2 * limit))
    columns = []
    for edge in range(len(ring)):
        wall = details.WallFrame(ring, edge)
        count = max(1, round(wall.length / 7.0))
        for k in range(count):
            spot = wall.point((k + 0.5) * wall.length / count, 0.0)
            shaft = massing.regular_polygon(0.3, 8, spot)
            columns.append(massing.skirt(shaft, shaft, z0, z0 + height))
    floor = massing.roof_pan(plan, z0, z0 + 1.0, 0.2)
    rim = massing.skirt(plan, plan, z0, z0 + 1.0)
    out.add(f"garden_{number}", walls, floor, rim, *columns)
    return round(z0 + height, 3)
