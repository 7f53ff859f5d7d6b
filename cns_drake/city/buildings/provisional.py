"""Plain houses that hold the place of archetypes until these are built."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.buildings import bays, tiers
from cns_drake.city.buildings.site import Archetype, Assembly, Site
from cns_drake.city.facades import Band, Facade
from cns_drake.city.structures import Model


@dataclass(frozen=True)
class PlainHouse:
    """Parameters of a plain house; lengths in metres."""

    height: float
    storey_height: float
    pitch: float
    recess: float
    parapet: float
    rgb: tuple[float, float, float]


def draw(site: Site, height: float, rng: np.random.Generator) -> PlainHouse:
    """Draws the parameters of one house."""
    return PlainHouse(
        height=height,
        storey_height=float(rng.uniform(2.7, 3.4)),
        pitch=max(float(rng.uniform(2.2, 4.0)), site.open_length / 30),
        recess=round(float(rng.uniform(0.15, 0.35)), 2),
        parapet=round(float(rng.uniform(0.4, 0.7)), 2),
        rgb=tuple(round(float(v), 2) for v in rng.uniform(0.4, 0.8, 3)),
    )


def build(p: PlainHouse, site: Site, rng: np.random.Generator) -> Model:
    """Builds storeys with windows under a flat roof."""
    assembly = Assembly(site.name, p.rgb)
    outline = site.outline
    body = p.height - p.parapet - 0.3
    groups, per_group, storey = tiers.divided(body - 0.3, p.storey_height, 6)
    base = Facade(0.3, plain=site.blind_edges)
    top = tiers.add_ground(assembly, outline, base)
    window = bays.window(1.4, 0.9, storey - 0.4, p.recess)
    walls = Facade(
        storey,
        (),
        bays.rhythm(p.pitch, [window], 0.5),
        (p.recess,),
        plain=site.blind_edges,
    )
    top = tiers.add_storeys(assembly, outline, walls, top, groups, per_group)
    rim = round(p.height - top, 3)
    crown = Facade(rim, (Band(rim - 0.2, rim, -0.15),), plain=site.blind_edges)
    tiers.add_crown(assembly, outline, crown, top, p.parapet, thickness=0.2)
    return assembly.model(site)


def plain_house(name: str, heights, widths, party_walls=False) -> Archetype:
    """Returns a stand-in for the archetype of this name."""
    return Archetype(
        name=name,
        draw=draw,
        build=build,
        heights=heights,
        widths=widths,
        overhang=0.6,
        party_walls=party_walls,
    )
