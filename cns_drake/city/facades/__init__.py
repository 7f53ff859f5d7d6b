"""Parts of facades: walls, windows, doors, balconies and roofs."""

from cns_drake.city.facades.assembly import Assembly as Assembly
from cns_drake.city.facades.balconies import add_railing as add_railing
from cns_drake.city.facades.building import Building as Building
from cns_drake.city.facades.reliefs import Band as Band
from cns_drake.city.facades.reliefs import Patch as Patch
from cns_drake.city.facades.reliefs import Relief as Relief
from cns_drake.city.facades.reliefs import foot_band as foot_band
from cns_drake.city.facades.reliefs import top_band as top_band
from cns_drake.city.facades.roof_equipment import add_chimney as add_chimney
from cns_drake.city.facades.roof_equipment import equip_roof as equip_roof
from cns_drake.city.facades.site import Site as Site
from cns_drake.city.facades.solids import around as around
from cns_drake.city.facades.wall_frames import WallFrame as WallFrame
from cns_drake.city.facades.walls import Facade as Facade
from cns_drake.city.facades.walls import Layout as Layout
from cns_drake.city.facades.walls import facade_mesh as facade_mesh
from cns_drake.city.facades.walls import glass_mesh as glass_mesh
from cns_drake.city.facades.wing_walls import Openings as Openings
from cns_drake.city.facades.wings import Roof as Roof
from cns_drake.city.facades.wings import Wing as Wing
from cns_drake.city.facades.wings import free_stretches as free_stretches
