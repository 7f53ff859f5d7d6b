"""Parts of facades: walls, windows, doors, balconies and roofs."""

from worlds.city.facades.balconies import add_railing as add_railing
from worlds.city.facades.building import Building as Building
from worlds.city.facades.reliefs import Band as Band
from worlds.city.facades.reliefs import Patch as Patch
from worlds.city.facades.reliefs import Relief as Relief
from worlds.city.facades.reliefs import foot_band as foot_band
from worlds.city.facades.reliefs import top_band as top_band
from worlds.city.facades.solids import around as around
from worlds.city.facades.wall_frames import WallFrame as WallFrame
from worlds.city.facades.walls import Facade as Facade
from worlds.city.facades.walls import Layout as Layout
from worlds.city.facades.walls import facade_mesh as facade_mesh
from worlds.city.facades.walls import glass_mesh as glass_mesh
from worlds.city.facades.wing_walls import Openings as Openings
from worlds.city.facades.wings import Roof as Roof
from worlds.city.facades.wings import Wing as Wing
from worlds.city.facades.wings import free_stretches as free_stretches
