"""The glass skyscraper."""

from typing import NamedTuple

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    piers,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import outlines

# Equipment on the roof.
_ROOF_ITEMS = ("lift_house", "mast", *2 * ("cooling_tower",), "air_handler")

# Where each tier above the first starts, as shares of the tower's height.
_TIER_STARTS = ((0.62,), (0.45, 0.78))
# Greatest number of piers around the whole tower.
_MOST_PIERS = 38
# Share of the edges of a tier that step back.
_STEPPING_EDGES = 0.6
# Height of the parapet around a terrace [m].
_TERRACE_M = 1.1
# Greatest length of the chords of round corners [m].
_CHORD_M = 3.5
# Depth of the glass of the lobby [m].
_LOBBY_RECESS_M = 0.7
# Height of the wall above the glass of the lobby [m].
_LOBBY_LINTEL_M = 0.8
# Distance between the columns of the lobby [m].
_COLUMN_PITCH_M = 7.0
# Width of the stretch of the front for the door [m].
_DOOR_BAY_M = 7.0
# Height of the lower side of a wedge, as a share of the crown's height.
_WEDGE_LOW = 0.35
# Height of the lower step of a crown, as a share of the crown's height.
_LOW_STEP = 0.45
# How far the upper step stands back, as a share of the plan's shortest side.
_STEP_INSET = 0.12
# Height of a parapet that is no screen [m].
_PARAPET_M = 1.0
# Height of a screen above the roof, as a share of the crown's height.
_SCREEN_SHARE = 0.7


class _Setback(NamedTuple):
    """Where a tier above the first starts, and how far it steps back.

    Attributes:
        start: height of the tier's foot, as a share of the tower's height.
        share: how far the edges step back, as a share of the greatest step: one
            number for all edges, or (4,) one for each edge.
    """

    start: float
    share: float | np.ndarray


class GlassSkyscraper(Building):
    """The glass skyscraper: curtain walls with fins, setbacks, a crown."""

    def draw(self) -> None:
        site = self.site
        edges = len(site.outline)
        starts = self.pick(_TIER_STARTS)
        style = self.pick(("ribbons", "grid", "fins", "fins"))
        self.setbacks = [self._draw_setback(start, edges) for start in starts]
        walls, glass = (self.kind.choices[part] for part in ("walls", "glass"))
        tint = self.whole(0, len(walls))
        self.walls = walls[tint]
        self.glass = glass[tint]
        wanted = self.pick(("plain", "chamfered", "notched", "rounded"))
        self.corners = wanted if edges == 4 else "plain"
        self.lobby_height = self.uniform(6.0, 9.0, digits=2)
        self.grooves = self._draw_grooves(style)
        # Size of cut corners, as a share of the shorter side.
        self.corner_size = self.uniform(0.08, 0.16)
        self.crown = self.pick(("screen", "wedge", "stepped"))
        self.crown_height = self.uniform(5.0, 9.0, digits=1)

    def _draw_grooves(self, style: str) -> tiers.Grooves:
        """Returns random sizes of the windows and the piers.

        `style` is `ribbons` (no piers), `fins` (no ledges) or `grid` (both).
        """
        storey_height = self.uniform(3.7, 4.2)
        spandrel = self.uniform(0.6, 1.2, digits=2)
        ledge = self.uniform(0.3, 0.6, digits=2)
        recess = self.uniform(0.2, 0.4, digits=2)
        pitch = self.uniform(2.2, 3.6)
        pier = self.uniform(0.12, 0.3, digits=2)
        return tiers.Grooves(
            storey_height=storey_height,
            spandrel=spandrel,
            ledge=ledge if style in ("ribbons", "grid") else 0.0,
            recess=recess,
            pitch=max(pitch, self.site.open_length / _MOST_PIERS),
            pier=pier if style != "ribbons" else 0.0,
            pier_reach=self.uniform(0.2, 0.55, digits=2),
        )

    def _draw_setback(self, start: float, edges: int) -> _Setback:
        """Returns a random setback.

        On a site with four edges, each edge steps back by a share of its own;
        some edges do not step back at all.

        Args:
            start: height of the tier's foot, as a share of the tower's height,
                before a random shift.
        """
        share: float | np.ndarray
        if edges == 4:
            shares = self.rng.uniform(0.06, 0.13, edges)
            steps_back = self.rng.random(edges) < _STEPPING_EDGES
            share = np.where(steps_back, shares, 0.0)
        else:
            share = self.uniform(0.5, 1.0)
        return _Setback(start + self.uniform(-0.06, 0.06), share)

    def build(self) -> None:
        """Adds all parts of the skyscraper; its site can have any outline."""
        base = self.site.outline
        plan = _with_cut_corners(self, base)
        top = _add_lobby(self, plan)
        reach = outlines.shortest_side(base)
        total = np.zeros(len(base))
        if len(base) != 4:
            reach = min(0.08 * reach, 0.5 * outlines.inset_limit(base))
        for k, setback in enumerate(self.setbacks):
            goal = round(setback.start * self.height, 1)
            top = tiers.add_grooved(
                self,
                plan,
                self.grooves,
                z0=top,
                goal=goal,
                part=f"tier_{k}",
                rise=_TERRACE_M,
            )
            rim = Band(z0=0.8, z1=_TERRACE_M, depth=-0.1)
            terrace = Facade(_TERRACE_M, bands=(rim,))
            tiers.add_crown(
                self,
                plan,
                terrace,
                z0=top,
                parapet=_PARAPET_M,
                part=f"terrace_{k}",
            )
            total = total + np.round(setback.share * reach, 1)
            plan = _with_cut_corners(self, outlines.inset(base, total))
        top = tiers.add_grooved(
            self,
            plan,
            self.grooves,
            z0=top,
            goal=self.height - self.crown_height,
            part="tier_top",
            rise=self.crown_height if self.crown == "screen" else 0.0,
        )
        _add_crown(self, plan, top)


def _with_cut_corners(
    tower: GlassSkyscraper, outline: np.ndarray
) -> np.ndarray:
    """Returns an outline (N, 2) whose corners are cut in the tower's style."""
    side = outlines.shortest_side(tower.site.outline)
    size = round(tower.corner_size * side, 1)
    if tower.corners == "chamfered":
        return outlines.chamfered(outline, size)
    if tower.corners == "notched":
        return outlines.notched(outline, 0.6 * size)
    if tower.corners == "rounded":
        corners = dict.fromkeys(range(len(outline)), size)
        return outlines.rounded(outline, corners, step=_CHORD_M)
    return outline


def _add_lobby(tower: GlassSkyscraper, plan: np.ndarray) -> float:
    """Adds the ground floor: glass behind columns; returns its top [m]."""
    height, length = tower.lobby_height, WallFrame(plan, 0).length
    glass_top = height - _LOBBY_LINTEL_M
    door = bays.entrance(width=min(5.0, length / 3), height=3.6, depth=1.6)
    mullion = bays.bar(width=0.12, z0=0.0, z1=glass_top, depth=0.4)
    mullions = bays.rhythm(2 * tower.grooves.pitch, [mullion], margin=1.0)
    columns = piers.wall_piers(
        plan,
        pitch=_COLUMN_PITCH_M,
        width=0.9,
        reach=0.25,
        z0=0.0,
        z1=glass_top,
        depth=_LOBBY_RECESS_M + 0.05,
        margin=0.55,
        entrance=min(5.8, length / 2),
    )
    canopy = canopies.front_canopy(plan, half=4.0, reach=1.5, z=4.2)
    lobby = Facade(
        height,
        bands=(
            Band(z0=0.0, z1=glass_top, depth=_LOBBY_RECESS_M),
            Band(z0=0.0, z1=0.3, depth=0.45),
            Band(z0=glass_top, z1=height - 0.5, depth=-0.25),
        ),
        layout=bays.with_door(mullions, door, width=_DOOR_BAY_M),
        glass=(_LOBBY_RECESS_M,),
    )
    return tiers.add_ground(tower, plan, lobby, extras=[columns, canopy])


def _add_crown(tower: GlassSkyscraper, plan: np.ndarray, z0: float) -> None:
    """Adds the crown: a wedge, a smaller storey on a terrace, or a screen.

    Args:
        plan: (N, 2) outline of the topmost tier [m].
        z0: height of the crown's foot [m].
    """
    if tower.crown == "wedge":
        _add_wedge(tower, plan, z0)
    elif tower.crown == "stepped":
        _add_stepped_crown(tower, plan, z0)
    else:
        _add_screen(tower, plan, z0)


def _add_wedge(tower: GlassSkyscraper, plan: np.ndarray, z0: float) -> None:
    """Adds a crown with a sloped top; for the arguments, see `_add_crown`."""
    height = round(tower.height - z0, 3)
    wedge = solids.sloped_prism(plan, z0=z0, height=height, low=_WEDGE_LOW)
    tower.add("crown", wedge)


def _add_stepped_crown(
    tower: GlassSkyscraper, plan: np.ndarray, z0: float
) -> None:
    """Adds a terrace with a smaller storey; for arguments, see `_add_crown`."""
    height = round(tower.height - z0, 3)
    low = round(_LOW_STEP * height, 2)
    walls = Facade(low, bands=(top_band(low, height=0.5, reach=0.3),))
    tiers.add_crown(
        tower, plan, walls, z0=z0, parapet=_PARAPET_M, part="crown_low"
    )
    inset = _STEP_INSET * outlines.shortest_side(plan)
    _add_louvred_storey(
        tower,
        outlines.inset(plan, min(inset, outlines.inset_limit(plan))),
        z0=round(z0 + low - _PARAPET_M, 3),
        height=round(height - low + _PARAPET_M, 3),
        parapet=_PARAPET_M,
    )


def _add_screen(tower: GlassSkyscraper, plan: np.ndarray, z0: float) -> None:
    """Adds high walls around the roof; for the arguments, see `_add_crown`."""
    height = round(tower.height - z0, 3)
    _add_louvred_storey(
        tower, plan, z0=z0, height=height, parapet=_SCREEN_SHARE * height
    )


def _add_louvred_storey(
    tower: GlassSkyscraper,
    plan: np.ndarray,
    *,
    z0: float,
    height: float,
    parapet: float,
) -> None:
    """Adds the topmost walls, with louvres, and the equipped roof.

    Args:
        plan: (N, 2) outline of the walls [m].
        z0: height of the foot of the walls [m].
        height: height of the walls [m].
        parapet: height of the walls above the roof [m].
    """
    louvres = tuple(
        Band(z0=z, z1=z + 0.5, depth=0.2)
        for z in np.arange(0.8, height - 1.5, 1.0).tolist()
    )
    walls = Facade(height, bands=louvres)
    tiers.add_crown(
        tower, plan, walls, z0=z0, parapet=parapet, items=_ROOF_ITEMS
    )
