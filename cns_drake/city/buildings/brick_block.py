"""The old brick block: punched windows, cornice, fire stairs, water tower."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.buildings import bays, details, tiers
from cns_drake.city.buildings.facades import Band, Facade
from cns_drake.city.buildings.roof_equipment import equip_roof
from cns_drake.city.buildings.site import Archetype, Assembly, Site
from cns_drake.city.geometry.structures import MeshShape, Model

_BRICKS = (
    (0.56, 0.33, 0.27),
    (0.62, 0.42, 0.33),
    (0.48, 0.31, 0.27),
    (0.69, 0.55, 0.43),
)

# Higher houses have their fire stairs inside.
_MOST_FLIGHTS = 8


@dataclass(frozen=True)
class BrickBlock:
    """Parameters of a brick block; lengths in metres."""

    height: float
    ground_height: float
    storey_height: float
    pitch: float
    window_width: float
    sill: float
    head: float
    recess: float
    mullions: int
    transom: float | None
    ledge: float
    hood: float
    sill_course: float
    corbels: bool
    pilasters: bool
    cornice_reach: float
    parapet: float
    stairs_edge: int | None
    stairs_at: float
    roof_items: tuple[str, ...]
    rgb: tuple[float, float, float]


def draw(site: Site, height: float, rng: np.random.Generator) -> BrickBlock:
    """Draws the parameters of one block."""
    storey = float(rng.uniform(3.1, 3.7))
    free = [k for k in range(1, len(site.outline)) if k not in site.blind_edges]
    items = ["roof_stair_house", "roof_vents", "roof_ac_unit", "roof_skylight"]
    if rng.random() < 0.6:
        items.insert(0, "roof_water_tower")
    style = int(rng.integers(4))
    return BrickBlock(
        height=height,
        ground_height=round(float(rng.uniform(4.0, 4.8)), 2),
        storey_height=storey,
        pitch=max(float(rng.uniform(2.3, 3.4)), site.open_length / 46),
        window_width=round(float(rng.uniform(1.0, 1.6)), 2),
        sill=round(float(rng.uniform(0.75, 0.95)), 2),
        head=round(float(rng.uniform(2.4, 2.7)), 2),
        recess=round(float(rng.uniform(0.18, 0.35)), 2),
        mullions=1 if style == 0 else 0,
        transom=1.65 if style == 1 else None,
        ledge=0.12 if style == 2 else 0.0,
        hood=0.12 if style == 3 else 0.0,
        sill_course=0.1 if style < 2 else 0.0,
        corbels=bool(rng.random() < 0.4),
        pilasters=bool(rng.random() < 0.5),
        cornice_reach=round(float(rng.uniform(0.5, 1.0)), 2),
        parapet=round(float(rng.uniform(0.7, 1.3)), 2),
        stairs_edge=int(rng.choice(free)) if free else None,
        stairs_at=float(rng.uniform(0.3, 0.7)),
        roof_items=tuple(items),
        rgb=_BRICKS[int(rng.integers(len(_BRICKS)))],
    )


def build(p: BrickBlock, site: Site, rng: np.random.Generator) -> Model:
    """Builds the block on any outline."""
    outline = site.outline
    assembly = Assembly(site.name, p.rgb)
    crown_height = p.parapet + 1.4
    groups, per_group, storey = tiers.divided(
        p.height - p.ground_height - crown_height, p.storey_height
    )
    front = details.WallFrame(outline, 0)
    shops = bays.rhythm(
        2 * p.pitch, [bays.shop_front(p.ground_height - 1.1)], margin=0.6
    )
    door = bays.entrance(1.8, 3.0)
    back = bays.rhythm(
        p.pitch, [bays.window(p.window_width, 1.4, 2.9, p.recess)], margin=0.8
    )
    belt = Band(p.ground_height - 1.0, p.ground_height - 0.1, -0.15)
    ground = Facade(
        p.ground_height,
        (Band(0.0, 0.4, -0.08), belt),
        bays.by_edge(
            {0: bays.with_middle(shops, door, 3.4)},
            shops if len(outline) > 4 else back,
        ),
        glass=(0.35, p.recess),
        plain=site.blind_edges,
    )
    middle = front.length / 2
    roof = details.canopy(middle - 1.5, middle + 1.5, 1.3, 3.1)
    shades = []
    for x0, x1 in bays.stretches(front.length, 2 * p.pitch, 0.6):
        clear = x1 < middle - 1.7 or x0 > middle + 1.7
        if clear and rng.random() < 0.6:
            shade = details.awning(
                x0 + 0.4, x1 - 0.4, 1.2, 2.6, p.ground_height - 0.9
            )
            shades.append(front.place(shade))
    tiers.add_awnings(assembly, shades, rng)
    top = tiers.add_ground(assembly, outline, ground, [front.place(roof)])

    sash = bays.window(
        p.window_width,
        p.sill,
        min(p.head, storey - 0.5),
        p.recess,
        mullions=p.mullions,
        transom=p.transom,
        ledge=p.ledge,
        hood=p.hood,
    )
    layout = bays.rhythm(p.pitch, [sash], margin=0.9)
    course = Band(p.sill - 0.2, p.sill, -p.sill_course)
    walls = Facade(
        storey, (course,), layout, (p.recess,), plain=site.blind_edges
    )
    bottom = top
    top = tiers.add_storeys(assembly, outline, walls, top, groups, per_group)

    if p.pilasters:
        strips = details.pilasters(
            outline, p.pitch, 0.9, 3, 0.5, 0.2, bottom, top, site.blind_edges
        )
        assembly.add("pilasters", strips)
    crown_height = round(p.height - top, 3)
    corbel = bays.bar(0.35, 0.0, crown_height - p.parapet - 0.9, -0.3)
    frieze = Facade(
        crown_height,
        tiers.cornice(crown_height - p.parapet, p.cornice_reach),
        bays.rhythm(p.pitch, [corbel if p.corbels else bays.blank], 0.9),
        plain=site.blind_edges,
    )
    roof = tiers.add_crown(assembly, outline, frieze, top, p.parapet)
    equip_roof(assembly, outline, roof, p.roof_items, rng)
    if p.stairs_edge is not None and groups * per_group <= _MOST_FLIGHTS:
        _add_fire_stairs(assembly, p, site, bottom, storey, top)
    return assembly.model(site)


def _add_fire_stairs(assembly, p, site, bottom, storey, top) -> None:
    wall = details.WallFrame(site.outline, p.stairs_edge)
    if wall.length < 9.0:
        return
    x, y = wall.point(2.8 + p.stairs_at * (wall.length - 5.6), 0.0)
    assembly.share("fire_stairs_flight", details.fire_stairs_flight())
    scale = (1.0, 1.0, round(storey / details.FIRE_STAIRS_STOREY_M, 3))
    for k in range(round((top - bottom) / storey) - 1):
        assembly.place(
            f"fire_stairs_{k}",
            MeshShape("fire_stairs_flight", scale),
            (x, y, bottom + k * storey),
            wall.heading,
            rgb=(0.2, 0.2, 0.22),
        )


BRICK_BLOCK = Archetype(
    name="brick_block",
    draw=draw,
    build=build,
    heights=(12.0, 40.0),
    widths=(10.0, 60.0),
    any_outline=True,
    party_walls=True,
)
