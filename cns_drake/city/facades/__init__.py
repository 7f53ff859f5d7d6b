"""Parts of facades: walls, windows, doors, balconies and roofs."""

from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.facades.balconies import add_railing
from cns_drake.city.facades.building import Building
from cns_drake.city.facades.reliefs import (
    Band,
    Patch,
    Relief,
    foot_band,
    lifted,
    top_band,
)
from cns_drake.city.facades.roof_equipment import add_chimney, equip_roof
from cns_drake.city.facades.site import Site
from cns_drake.city.facades.solids import around
from cns_drake.city.facades.wall_frames import WallFrame
from cns_drake.city.facades.walls import (
    Facade,
    Layout,
    facade_mesh,
    glass_mesh,
    single_wall,
)
from cns_drake.city.facades.wing_walls import Openings
from cns_drake.city.facades.wings import Roof, Wing, free_stretches

__all__ = [
    "Assembly",
    "Band",
    "Building",
    "Facade",
    "Layout",
    "Openings",
    "Patch",
    "Relief",
    "Roof",
    "Site",
    "WallFrame",
    "Wing",
    "add_chimney",
    "add_railing",
    "around",
    "equip_roof",
    "facade_mesh",
    "foot_band",
    "free_stretches",
    "glass_mesh",
    "lifted",
    "single_wall",
    "top_band",
]
