"""The mid-rise office with shops on the ground floor."""

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    foot_band,
    tiers,
    top_band,
)
from worlds.shapes import equip_roof, outlines

# Greatest number of windows around the whole office.
_MOST_BAYS = 42
# Lower offices have no penthouse [m].
_PENTHOUSE_OFFICE_M = 18.0
# Height of the topmost walls below the parapet [m].
_FRIEZE_M = 0.5
# Depth of the glass of the ground floor [m].
_GROUND_RECESS_M = 0.5
# Depth of the glass of the penthouse [m].
_PENTHOUSE_RECESS_M = 0.3
# Distance of the shops from the ends of a wall [m].
_SHOP_END_M = 0.7
# Half the width of the stretch of the front for the door and its canopy [m].
_DOOR_HALF_M = 2.6
# Height of the walls of the penthouse above its eaves [m].
_PENTHOUSE_RIM_M = 0.9


class Office(Building):
    """The mid-rise office: a lobby and shops, window bands, a penthouse.

    `style` is `ribbon` (ribbon windows), `frame` (deep square frames) or
    `grooves` (piers from the first floor to the top).
    """

    def draw(self) -> None:
        site = self.site
        self.ground_height = self.uniform(4.4, 5.4, digits=2)
        self.storey_height = self.uniform(3.4, 3.9)
        self.style = self.pick(("ribbon", "frame", "grooves"))
        self.pitch = max(self.uniform(3.0, 4.4), site.open_length / _MOST_BAYS)
        self.recess = self.uniform(0.25, 0.5, digits=2)
        self.sill = self.uniform(0.75, 1.05, digits=2)
        self.pier_reach = self.uniform(0.15, 0.32, digits=2)
        # Low offices have no penthouse.
        penthouse = self.uniform(3.4, 4.4, digits=1)
        has_penthouse = self.height > _PENTHOUSE_OFFICE_M
        self.penthouse_height = penthouse if has_penthouse else 0.0
        self.penthouse_inset = self.uniform(2.2, 4.0, digits=1)
        self.parapet = self.uniform(0.6, 1.2, digits=2)
        self.awnings = self.uniform(0.0, 0.7)
        self.roof_items = self.draw_roof_items(
            "air_handler lift_house ac_unit ac_unit vents dish", low=3, high=7
        )

    def build(self) -> None:
        """Adds all parts of the office; its site can have any outline."""
        outline = self.site.outline
        top = _add_ground(self)
        goal = self.height - self.penthouse_height - self.parapet - _FRIEZE_M
        if self.style == "grooves":
            top = _add_grooved_storeys(self, top, goal)
        else:
            top = _add_window_storeys(self, top, goal)
        rim = round(self.height - self.penthouse_height - top, 3)
        bands = (
            Band(z0=0.1, z1=0.4, depth=-0.2 if self.style == "ribbon" else 0.0),
            top_band(rim, height=0.3, reach=0.35),
        )
        walls = Facade(rim, bands=bands, plain=self.site.blind_edges)
        roof = tiers.add_crown(
            self, outline, walls, z0=top, parapet=self.parapet
        )
        if self.penthouse_height > 0:
            inset = min(self.penthouse_inset, outlines.inset_limit(outline))
            outline = outlines.inset(outline, inset)
            roof = _add_penthouse(self, outline, roof)
        equip_roof(self, outline, roof, self.roof_items)


def _add_ground(office: Office) -> float:
    """Adds the ground floor with its lobby; returns the floor's top [m].

    Shops are beside the lobby; on a site that is not a rectangle, they are on
    all sides.
    """
    outline, height = office.site.outline, office.ground_height
    depth = _GROUND_RECESS_M
    shop_pitch = 1.6 * office.pitch
    shop = bays.shop_front(head=height - 1.1, depth=depth, door=False)
    shops = bays.rhythm(shop_pitch, [shop], margin=_SHOP_END_M)
    entrance = bays.entrance(width=3.2, height=3.2, depth=1.8)
    front = bays.with_middle(shops, entrance, width=5.0)
    window = bays.window(width=2.2, sill=1.2, head=height - 1.2, depth=depth)
    sides = bays.rhythm(1.5 * office.pitch, [window], margin=0.9)
    walls = Facade(
        height,
        bands=(
            foot_band(height=0.35, reach=0.06),
            Band(z0=height - 0.9, z1=height - 0.1, depth=-0.15),
        ),
        layout=bays.by_edge({0: front}, shops if len(outline) > 4 else sides),
        glass=(depth,),
        plain=office.site.blind_edges,
    )
    _add_awnings(office, shop_pitch)
    canopy = canopies.front_canopy(
        outline, half=_DOOR_HALF_M, reach=1.45, z=3.4
    )
    return tiers.add_ground(office, outline, walls, extras=[canopy])


def _add_awnings(office: Office, pitch: float) -> None:
    """Adds awnings to some of the shops in front.

    `pitch` is the approximate width of a shop [m].
    """
    front = WallFrame(office.site.outline, 0)
    shops = bays.stretches(front.length, pitch=pitch, margin=_SHOP_END_M)
    shape = canopies.AwningShape(
        narrower=0.3, reach=1.3, z0=2.7, z1=office.ground_height - 1.1
    )
    awnings = canopies.awnings(
        front,
        shops,
        office.rng,
        share=office.awnings,
        shape=shape,
        door=_DOOR_HALF_M,
    )
    canopies.add_awnings(office, awnings)


def _add_grooved_storeys(office: Office, z0: float, goal: float) -> float:
    """Adds storeys between piers up to about `goal`; returns their top [m]."""
    grooves = tiers.Grooves(
        storey_height=office.storey_height,
        spandrel=office.sill,
        recess=office.recess,
        pitch=office.pitch,
        pier=0.5,
        pier_reach=office.pier_reach,
        solid_corner=0.8,
    )
    return tiers.add_grooved(
        office,
        office.site.outline,
        grooves,
        z0=z0,
        goal=goal,
        part="storey",
        rise=0.2,
        most=8,
        plain=office.site.blind_edges,
    )


def _add_window_storeys(office: Office, z0: float, goal: float) -> float:
    """Adds storeys with ribbon windows or square frames up to about `goal`.

    Returns the height of their top [m].
    """
    groups, per_group, storey = tiers.storey_groups(
        goal - z0, storey=office.storey_height
    )
    head = round(storey - 0.4, 2)
    bands: tuple[Band, ...] = ()
    if office.style == "ribbon":
        pane = bays.ribbon(
            sill=office.sill, head=head, depth=office.recess, post=0.12
        )
        layout = bays.rhythm(office.pitch, [pane], margin=0.8)
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
        layout = bays.rhythm(office.pitch, [frame], margin=0.6)
    site = office.site
    walls = Facade(
        storey,
        bands=bands,
        layout=layout,
        glass=(office.recess,),
        plain=site.blind_edges,
    )
    return tiers.add_storeys(
        office, site.outline, walls, z0=z0, groups=groups, per_group=per_group
    )


def _add_penthouse(office: Office, outline: np.ndarray, z0: float) -> float:
    """Adds a glazed storey on the roof; returns the height of its roof [m].

    `outline` contains its corners (N, 2), and `z0` is the height of the roof on
    which it stands [m].
    """
    height = round(office.height - z0, 3)
    eaves = height - _PENTHOUSE_RIM_M
    bands = (
        Band(z0=0.9, z1=eaves - 0.3, depth=_PENTHOUSE_RECESS_M),
        Band(z0=eaves, z1=eaves + 0.3, depth=-0.7),
    )
    walls = Facade(height, bands=bands, glass=(_PENTHOUSE_RECESS_M,))
    return tiers.add_crown(
        office, outline, walls, z0=z0, parapet=0.6, part="penthouse"
    )
