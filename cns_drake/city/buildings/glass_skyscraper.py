"""The glass skyscraper."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    outlines,
    piers,
    solids,
    tiers,
    top_band,
)

# Equipment on the roof.
_ROOF_ITEMS = ("lift_house", "mast", *2 * ("cooling_tower",), "air_handler")


class GlassSkyscraper(Building):
    """The glass skyscraper: curtain walls with fins, setbacks, a crown."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        edges = len(site.outline)
        starts = self.pick(((0.62,), (0.45, 0.78)))
        # 0 ribbons, 1 a grid, above that fins.
        style = self.whole(0, 4)
        # Of each tier above the first: the height at which it starts, as a
        # share of the tower's height; how far its edges step back, as a share
        # of the greatest step; and a share by which the start is shifted.
        self.setbacks = [
            (start, self._setback_share(edges), self.uniform(-0.06, 0.06))
            for start in starts
        ]
        walls, glass = (self.kind.choices[part] for part in ("walls", "glass"))
        tint = self.whole(0, len(walls))
        self.walls = walls[tint]
        self.glass = glass[tint]
        wanted = self.pick(("plain", "chamfered", "notched", "rounded"))
        self.corners = wanted if edges == 4 else "plain"
        self.lobby_height = self.uniform(6.0, 9.0, digits=2)
        self.grooves = tiers.Grooves(
            storey_height=self.uniform(3.7, 4.2),
            spandrel=self.uniform(0.6, 1.2, digits=2),
            ledge=self.uniform(0.3, 0.6, digits=2) * (style < 2),
            recess=self.uniform(0.2, 0.4, digits=2),
            pitch=max(self.uniform(2.2, 3.6), site.open_length / 38),
            pier=self.uniform(0.12, 0.3, digits=2) * (style > 0),
            pier_reach=self.uniform(0.2, 0.55, digits=2),
        )
        # Size of cut corners, as a share of the shorter side.
        self.corner_size = self.uniform(0.08, 0.16)
        self.crown = self.pick(("screen", "wedge", "stepped"))
        self.crown_height = self.uniform(5.0, 9.0, digits=1)

    def _setback_share(self, edges: int) -> float | np.ndarray:
        """Returns a random share for how far a tier steps back.

        With four edges, each edge has a share of its own, which is 0 for an
        edge that does not step back. Otherwise, one share holds for all edges.
        """
        if edges == 4:
            return self.rng.uniform(0.06, 0.13, 4) * (self.rng.random(4) < 0.6)
        return self.uniform(0.5, 1.0)

    def build(self) -> None:
        """Adds all parts of the skyscraper; its site can have any outline."""
        base = self.site.outline
        plan = _with_cut_corners(self, base)
        top = _add_lobby(self, plan)
        reach = outlines.shortest_side(base)
        total = np.zeros(len(base))
        if len(base) != 4:
            reach = min(0.08 * reach, 0.5 * outlines.inset_limit(base))
        for k, (start, share, jitter) in enumerate(self.setbacks):
            goal = round((start + jitter) * self.height, 1)
            part = f"tier_{k}"
            top = tiers.add_grooved(
                self, plan, self.grooves, z0=top, goal=goal, part=part, rise=1.1
            )
            terrace = Facade(1.1, bands=(Band(z0=0.8, z1=1.1, depth=-0.1),))
            tiers.add_crown(
                self, plan, terrace, z0=top, parapet=1.0, part=f"terrace_{k}"
            )
            total = total + np.round(share * reach, 1)
            plan = _with_cut_corners(self, outlines.inset(base, total))
        rise = self.crown_height if self.crown == "screen" else 0.0
        goal = self.height - self.crown_height
        part = "tier_top"
        top = tiers.add_grooved(
            self, plan, self.grooves, z0=top, goal=goal, part=part, rise=rise
        )
        _add_crown(self, plan, top)


def _with_cut_corners(
    tower: GlassSkyscraper, outline: np.ndarray
) -> np.ndarray:
    side = outlines.shortest_side(tower.site.outline)
    size = round(tower.corner_size * side, 1)
    if tower.corners == "chamfered":
        return outlines.chamfered(outline, size)
    if tower.corners == "notched":
        return outlines.notched(outline, 0.6 * size)
    if tower.corners == "rounded":
        corners = dict.fromkeys(range(len(outline)), size)
        return outlines.rounded(outline, corners, step=3.5)
    return outline


def _add_lobby(tower: GlassSkyscraper, plan: np.ndarray) -> float:
    height, length = tower.lobby_height, WallFrame(plan, 0).length
    door = bays.entrance(width=min(5.0, length / 3), height=3.6, depth=1.6)
    bar = bays.bar(width=0.12, z0=0.0, z1=height - 0.8, depth=0.4)
    mullions = bays.rhythm(2 * tower.grooves.pitch, [bar], margin=1.0)
    bands = (
        Band(z0=0.0, z1=height - 0.8, depth=0.7),
        Band(z0=0.0, z1=0.3, depth=0.45),
        Band(z0=height - 0.8, z1=height - 0.5, depth=-0.25),
    )
    layout = bays.with_door(mullions, door, width=7.0)
    columns = piers.wall_piers(
        plan,
        pitch=7.0,
        width=0.9,
        reach=0.25,
        z0=0.0,
        z1=height - 0.8,
        depth=0.75,
        margin=0.55,
        entrance=min(5.8, length / 2),
    )
    roof = canopies.front_canopy(plan, half=4.0, reach=1.5, z=4.2)
    lobby = Facade(height, bands=bands, layout=layout, glass=(0.7,))
    return tiers.add_ground(tower, plan, lobby, extras=[columns, roof])


def _add_crown(tower: GlassSkyscraper, plan: np.ndarray, z0: float) -> None:
    height = round(tower.height - z0, 3)
    if tower.crown == "wedge":
        tower.add(
            "crown", solids.sloped_prism(plan, z0=z0, height=height, low=0.35)
        )
        return
    if tower.crown == "stepped":
        low = round(0.45 * height, 2)
        ledge = Facade(low, bands=(top_band(low, height=0.5, reach=0.3),))
        tiers.add_crown(
            tower, plan, ledge, z0=z0, parapet=1.0, part="crown_low"
        )
        reach = 0.12 * outlines.shortest_side(plan)
        plan = outlines.inset(plan, min(reach, outlines.inset_limit(plan)))
        z0, height = round(z0 + low - 1.0, 3), round(height - low + 1.0, 3)
    louvres = tuple(
        Band(z0=z, z1=z + 0.5, depth=0.2)
        for z in np.arange(0.8, height - 1.5, 1.0).tolist()
    )
    parapet = 0.7 * height if tower.crown == "screen" else 1.0
    walls = Facade(height, bands=louvres)
    tiers.add_crown(
        tower, plan, walls, z0=z0, parapet=parapet, items=_ROOF_ITEMS
    )
