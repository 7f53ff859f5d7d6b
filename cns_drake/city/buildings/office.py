"""The mid-rise office with shops on the ground floor."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    equip_roof,
    outlines,
    tiers,
)


class Office(Building):
    """The mid-rise office: a lobby and shops, window bands, a penthouse.

    `style` is `ribbon` (ribbon windows), `frame` (deep square frames) or
    `grooves` (piers from the first floor to the top).
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.ground_height = self.uniform(4.4, 5.4, 2)
        self.storey_height = self.uniform(3.4, 3.9)
        self.style = self.pick(("ribbon", "frame", "grooves"))
        self.pitch = max(self.uniform(3.0, 4.4), site.open_length / 42)
        self.recess = self.uniform(0.25, 0.5, 2)
        self.sill = self.uniform(0.75, 1.05, 2)
        self.pier_reach = self.uniform(0.15, 0.32, 2)
        # Low offices have no penthouse.
        penthouse = self.uniform(3.4, 4.4, 1)
        self.penthouse_height = penthouse if self.height > 18.0 else 0.0
        self.penthouse_inset = self.uniform(2.2, 4.0, 1)
        self.parapet = self.uniform(0.6, 1.2, 2)
        self.awnings = self.uniform(0.0, 0.7)
        self.roof_items = self.draw_roof_items(
            "air_handler lift_house ac_unit ac_unit vents dish", 3, 7
        )

    def build(self) -> None:
        """Adds all parts of the office; its site can have any outline."""
        outline, blind = self.site.outline, self.site.blind_edges
        top = _add_ground(self)
        goal = self.height - self.penthouse_height - self.parapet - 0.5
        if self.style == "grooves":
            grooves = tiers.Grooves(
                storey_height=self.storey_height,
                spandrel=self.sill,
                recess=self.recess,
                pitch=self.pitch,
                pier=0.5,
                pier_reach=self.pier_reach,
                solid_corner=0.8,
            )
            top = tiers.add_grooved(
                self, outline, grooves, top, goal, "storey", 0.2, 8, blind
            )
        else:
            top = _add_window_storeys(self, top, goal)
        rim = round(self.height - self.penthouse_height - top, 3)
        bands = (
            Band(0.1, 0.4, -0.2 if self.style == "ribbon" else 0.0),
            Band(rim - 0.3, rim, -0.35),
        )
        edge = Facade(rim, bands, plain=blind)
        roof = tiers.add_crown(self, outline, edge, top, self.parapet)
        if self.penthouse_height > 0:
            inset = min(self.penthouse_inset, outlines.inset_limit(outline))
            outline = outlines.inset(outline, inset)
            roof = _add_penthouse(self, outline, roof)
        equip_roof(self, outline, roof, self.roof_items)


def _add_ground(p: Office) -> float:
    outline, h = p.site.outline, p.ground_height
    front = WallFrame(outline, 0)
    pitch = 1.6 * p.pitch
    shop = bays.shop_front(h - 1.1, 0.5, door=False)
    shops = bays.rhythm(pitch, [shop], margin=0.7)
    window = bays.window(2.2, 1.2, h - 1.2, 0.5)
    sides = bays.rhythm(1.5 * p.pitch, [window], margin=0.9)
    lobby = bays.with_middle(shops, bays.entrance(3.2, 3.2, 1.8), 5.0)
    layout = bays.by_edge({0: lobby}, shops if len(outline) > 4 else sides)
    bands = (Band(0.0, 0.35, -0.06), Band(h - 0.9, h - 0.1, -0.15))
    ground = Facade(h, bands, layout, (0.5,), p.site.blind_edges)
    cells = bays.stretches(front.length, pitch, 0.7)
    shape = canopies.AwningShape(0.3, 1.3, 2.7, h - 1.1)
    shades = canopies.awnings(front, cells, p.rng, p.awnings, shape, 2.6)
    canopies.add_awnings(p, shades)
    roof = canopies.front_canopy(outline, 2.6, 1.45, 3.4)
    return tiers.add_ground(p, outline, ground, [roof])


def _add_window_storeys(p: Office, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.storey_groups(goal - z0, p.storey_height)
    head = round(storey - 0.4, 2)
    bands: tuple[Band, ...] = ()
    if p.style == "ribbon":
        pane = bays.ribbon(p.sill, head, p.recess, 0.12)
        cells = bays.rhythm(p.pitch, [pane], margin=0.8)
        bands = (Band(p.sill - 0.15, p.sill, -0.08),)
    else:
        frame = bays.window(
            p.pitch - 0.5, 0.45, head, p.recess, pier=0.22, mullions=1
        )
        cells = bays.rhythm(p.pitch, [frame], margin=0.6)
    site = p.site
    walls = Facade(storey, bands, cells, (p.recess,), site.blind_edges)
    return tiers.add_storeys(p, site.outline, walls, z0, groups, per_group)


def _add_penthouse(p: Office, outline: np.ndarray, roof: float) -> float:
    # The penthouse starts on the roof; its parapet ends at the full height.
    height = round(p.height - roof, 3)
    eaves = height - 0.9
    bands = (Band(0.9, eaves - 0.3, 0.3), Band(eaves, eaves + 0.3, -0.7))
    walls = Facade(height, bands, glass=(0.3,))
    return tiers.add_crown(p, outline, walls, roof, 0.6, part="penthouse")
