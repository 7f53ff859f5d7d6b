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
    foot_band,
    outlines,
    tiers,
    top_band,
)


class Office(Building):
    """The mid-rise office: a lobby and shops, window bands, a penthouse.

    `style` is `ribbon` (ribbon windows), `frame` (deep square frames) or
    `grooves` (piers from the first floor to the top).
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.ground_height = self.uniform(4.4, 5.4, digits=2)
        self.storey_height = self.uniform(3.4, 3.9)
        self.style = self.pick(("ribbon", "frame", "grooves"))
        self.pitch = max(self.uniform(3.0, 4.4), site.open_length / 42)
        self.recess = self.uniform(0.25, 0.5, digits=2)
        self.sill = self.uniform(0.75, 1.05, digits=2)
        self.pier_reach = self.uniform(0.15, 0.32, digits=2)
        # Low offices have no penthouse.
        penthouse = self.uniform(3.4, 4.4, digits=1)
        self.penthouse_height = penthouse if self.height > 18.0 else 0.0
        self.penthouse_inset = self.uniform(2.2, 4.0, digits=1)
        self.parapet = self.uniform(0.6, 1.2, digits=2)
        self.awnings = self.uniform(0.0, 0.7)
        self.roof_items = self.draw_roof_items(
            "air_handler lift_house ac_unit ac_unit vents dish", low=3, high=7
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
                self,
                outline,
                grooves,
                z0=top,
                goal=goal,
                part="storey",
                rise=0.2,
                most=8,
                plain=blind,
            )
        else:
            top = _add_window_storeys(self, top, goal)
        rim = round(self.height - self.penthouse_height - top, 3)
        bands = (
            Band(z0=0.1, z1=0.4, depth=-0.2 if self.style == "ribbon" else 0.0),
            top_band(rim, height=0.3, reach=0.35),
        )
        edge = Facade(rim, bands=bands, plain=blind)
        roof = tiers.add_crown(
            self, outline, edge, z0=top, parapet=self.parapet
        )
        if self.penthouse_height > 0:
            inset = min(self.penthouse_inset, outlines.inset_limit(outline))
            outline = outlines.inset(outline, inset)
            roof = _add_penthouse(self, outline, roof)
        equip_roof(self, outline, roof, self.roof_items)


def _add_ground(office: Office) -> float:
    outline, h = office.site.outline, office.ground_height
    front = WallFrame(outline, 0)
    pitch = 1.6 * office.pitch
    shop = bays.shop_front(head=h - 1.1, depth=0.5, door=False)
    shops = bays.rhythm(pitch, [shop], margin=0.7)
    window = bays.window(width=2.2, sill=1.2, head=h - 1.2, depth=0.5)
    sides = bays.rhythm(1.5 * office.pitch, [window], margin=0.9)
    lobby = bays.with_middle(
        shops, bays.entrance(width=3.2, height=3.2, depth=1.8), width=5.0
    )
    layout = bays.by_edge({0: lobby}, shops if len(outline) > 4 else sides)
    bands = (
        foot_band(height=0.35, reach=0.06),
        Band(z0=h - 0.9, z1=h - 0.1, depth=-0.15),
    )
    ground = Facade(
        h,
        bands=bands,
        layout=layout,
        glass=(0.5,),
        plain=office.site.blind_edges,
    )
    cells = bays.stretches(front.length, pitch=pitch, margin=0.7)
    shape = canopies.AwningShape(narrower=0.3, reach=1.3, z0=2.7, z1=h - 1.1)
    shades = canopies.awnings(
        front, cells, office.rng, share=office.awnings, shape=shape, door=2.6
    )
    canopies.add_awnings(office, shades)
    roof = canopies.front_canopy(outline, half=2.6, reach=1.45, z=3.4)
    return tiers.add_ground(office, outline, ground, extras=[roof])


def _add_window_storeys(office: Office, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.storey_groups(
        goal - z0, storey=office.storey_height
    )
    head = round(storey - 0.4, 2)
    bands: tuple[Band, ...] = ()
    if office.style == "ribbon":
        pane = bays.ribbon(
            sill=office.sill, head=head, depth=office.recess, post=0.12
        )
        cells = bays.rhythm(office.pitch, [pane], margin=0.8)
        bands = (top_band(office.sill, height=0.15, reach=0.08),)
    else:
        frame = bays.window(
            width=office.pitch - 0.5,
            sill=0.45,
            head=head,
            depth=office.recess,
            pier=0.22,
            mullions=1,
        )
        cells = bays.rhythm(office.pitch, [frame], margin=0.6)
    site = office.site
    walls = Facade(
        storey,
        bands=bands,
        layout=cells,
        glass=(office.recess,),
        plain=site.blind_edges,
    )
    return tiers.add_storeys(
        office, site.outline, walls, z0=z0, groups=groups, per_group=per_group
    )


def _add_penthouse(office: Office, outline: np.ndarray, roof: float) -> float:
    # The penthouse starts on the roof; its parapet ends at the full height.
    height = round(office.height - roof, 3)
    eaves = height - 0.9
    bands = (
        Band(z0=0.9, z1=eaves - 0.3, depth=0.3),
        Band(z0=eaves, z1=eaves + 0.3, depth=-0.7),
    )
    walls = Facade(height, bands=bands, glass=(0.3,))
    return tiers.add_crown(
        office, outline, walls, z0=roof, parapet=0.6, part="penthouse"
    )
