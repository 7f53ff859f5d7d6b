"""The elevated station: tracks on a viaduct, platforms under a roof, stairs."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts.porches import add_railing
from cns_drake.city.buildings.parts import bays, details, massing, pitched_roofs
from cns_drake.city.buildings.parts.facades import (
    Band,
    Facade,
    facade_mesh,
    glass_mesh,
)
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh

_CONCRETES = ((0.70, 0.69, 0.67), (0.62, 0.62, 0.60), (0.74, 0.71, 0.64))
_STEELS = ((0.30, 0.42, 0.38), (0.46, 0.28, 0.24), (0.40, 0.44, 0.50))
_TRACK = (0.34, 0.31, 0.29)
_ROOFS = ((0.60, 0.62, 0.64), (0.40, 0.50, 0.48), (0.52, 0.36, 0.30))
_TRACK_M = 3.8


class Parameters:
    """Parameters of a station; lengths in metres.

    Attributes:
        height: of the roof.
        deck: height of the platforms above the street.
        island: whether one platform lies between the tracks, else two
            beside them.
        platform: width of a platform.
        span: distance between the piers.
        pier: `wall`, `twin` columns or `hammer` heads.
        roof: `butterfly`, `barrel` or `gable`.
        covered: part of the platforms under the roof.
        hall: width of the glazed hall below the deck.
        lift: whether a lift tower stands beside the stairs.
    """

    def __init__(self, d: Dice) -> None:
        depth = d.depth
        island = d.chance(0.5)
        rest = depth - 2 * _TRACK_M - 1.2
        self.height = d.height
        self.deck = round(min(d.uniform(5.6, 6.6), d.height - 3.4), 2)
        self.island = island
        self.platform = round(min(rest if island else rest / 2, 7.0), 2)
        self.span = d.uniform(10.0, 14.0)
        self.pier = d.pick(("wall", "twin", "hammer"))
        self.roof = d.pick(("butterfly", "barrel", "gable"))
        self.covered = d.uniform(0.55, 0.8)
        self.hall = d.uniform(9.0, 14.0, 1)
        self.lift = d.chance(0.7)
        self.rgb = d.pick(_CONCRETES)
        self.steel_rgb = d.pick(_STEELS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the station along x, its tracks from end to end of the site."""
    out.paint(
        concrete=p.rgb,
        track=_TRACK,
        steel=p.steel_rgb,
        roof=p.roof_rgb,
        glass=out.glass_rgb,
    )
    x0, y0, x1, y1 = out.site.bounds
    y = (y0 + y1) / 2
    tracks, platforms = _lanes(p, y)
    low = min(a for a, _ in (*tracks, *platforms))
    high = max(b for _, b in (*tracks, *platforms))
    _add_viaduct(out, p, (x0, x1), (low, high), tracks)
    ends = (x0 + 0.06 * (x1 - x0), x1 - 0.06 * (x1 - x0))
    for k, strip in enumerate(platforms):
        _add_platform(out, p, ends, strip)
        _add_roof(out, p, ends, strip)
        _add_fence(out, p, ends, strip, k, y)
    _add_hall(out, p, (x0, x1), (low, high))
    _add_stairs(out, p, ends, (y0 + 0.2, low), platforms)


def _lanes(p: Parameters, y: float) -> tuple[list[bays.Span], list[bays.Span]]:
    """Returns the strips of the tracks and of the platforms, in y."""
    # Half of what lies between the tracks, and where they end.
    half = p.platform / 2 if p.island else 0.0
    end = half + _TRACK_M
    tracks = [(y - end, y - half), (y + half, y + end)]
    if p.island:
        return tracks, [(y - half, y + half)]
    sides = [(y - end - p.platform, y - end), (y + end, y + end + p.platform)]
    return tracks, sides


def _add_viaduct(
    out: Assembly,
    p: Parameters,
    xs: bays.Span,
    ys: bays.Span,
    tracks: list[bays.Span],
) -> None:
    """Adds deck, girders, piers, rails."""
    (x0, x1), (y0, y1) = xs, ys
    bed = p.deck - 1.0
    girders = (
        massing.box(x0, x1, y, y + 0.5, bed - 1.1, bed - 0.3)
        for y in np.linspace(y0 + 0.3, y1 - 0.8, 4).tolist()
    )
    out.add_to(
        "concrete",
        massing.box(x0, x1, y0, y1, bed - 0.35, bed),
        *girders,
        massing.box(x0, x1, y0, y0 + 0.2, bed - 0.05, bed + 0.6),
        massing.box(x0, x1, y1 - 0.2, y1, bed - 0.05, bed + 0.6),
    )
    count = max(2, round((x1 - x0) / p.span) + 1)
    for x in np.linspace(x0 + 1.2, x1 - 1.2, count).tolist():
        out.add_to("concrete", *_pier(p, x, y0, y1, bed - 1.05))
    for a, b in tracks:
        middle = (a + b) / 2
        ballast = (x0, x1, middle - 1.3, middle + 1.3, bed - 0.02, bed + 0.15)
        out.add_to("track", massing.box(*ballast, bottom=False))
        for y in (middle - 0.72, middle + 0.72):
            rail = (x0, x1, y - 0.04, y + 0.04, bed + 0.1, bed + 0.32)
            out.add_to("steel", massing.box(*rail, bottom=False))


def _pier(
    p: Parameters, x: float, y0: float, y1: float, top: float
) -> list[Mesh]:
    if p.pier == "wall":
        inset = 0.16 * (y1 - y0)
        ys = (y0 + inset, y1 - inset)
        return [massing.standing(x - 0.5, x + 0.5, *ys, top)]
    if p.pier == "twin":
        cap = (x - 0.7, x + 0.7, y0 + 0.4, y1 - 0.4, top - 0.9, top)
        pieces = [massing.box(*cap)]
        for y in (y0 + 0.22 * (y1 - y0), y1 - 0.22 * (y1 - y0)):
            ring = massing.regular_polygon(0.6, 10, (x, y))
            pieces.append(
                massing.skirt(ring, ring, -massing.FOUNDATION_M, top - 0.8)
            )
        return pieces
    y, wide = (y0 + y1) / 2, 0.16 * (y1 - y0)
    foot = massing.rectangle(x - 0.7, y - wide, x + 0.7, y + wide)
    head = massing.rectangle(x - 0.7, y0 + 0.5, x + 0.7, y1 - 0.5)
    knee = max(1.5, top - 2.2)
    return [
        massing.skirt(foot, foot, -massing.FOUNDATION_M, knee),
        massing.skirt(foot, head, knee, top - 0.5),
        massing.prism(head, top - 0.5, top),
    ]


def _add_platform(
    out: Assembly, p: Parameters, ends: bays.Span, strip: bays.Span
) -> None:
    a, b = ends
    out.add_to("concrete", massing.box(*ends, *strip, p.deck - 1.05, p.deck))
    y, z = sum(strip) / 2, p.deck
    for x, _ in bays.stretches(b - a, 9.0, 2.0):
        u = a + x + 3.0
        seat = (u - 0.9, u + 0.9, y - 0.25, y + 0.25, z + 0.38, z + 0.48)
        foot = (u - 0.6, u + 0.6, y - 0.1, y + 0.1, z, z + 0.4)
        out.add_to(
            "steel", massing.box(*seat), massing.box(*foot, bottom=False)
        )


def _add_roof(
    out: Assembly, p: Parameters, ends: bays.Span, strip: bays.Span
) -> None:
    """Adds a roof on a row of columns along the middle of a platform."""
    a, b = ends
    run = p.covered * (b - a)
    a, b = (a + b - run) / 2, (a + b + run) / 2
    y0, y1 = strip
    middle, half = (y0 + y1) / 2, (y1 - y0) / 2 + 0.5
    low, top = p.deck + 2.9, p.height
    low = max(min(low, top - 0.5), top - 0.45 * half)
    if p.roof == "butterfly":
        line = [(middle - half, top), (middle, low + 0.2), (middle + half, top)]
    elif p.roof == "gable":
        line = pitched_roofs.gable_line(middle - half, middle + half, low, top)
    else:
        line = pitched_roofs.barrel_line(middle - half, middle + half, low, top)
    out.add_to("roof", pitched_roofs.shell(line, a, b, 0.18))
    under = pitched_roofs.line_height(line, middle) - 0.16
    for x in np.linspace(a + 1.0, b - 1.0, max(2, round(run / 8.0))).tolist():
        post = massing.post(x, middle, 0.13, under, p.deck - 0.02)
        out.add_to("steel", post)
        for side in (-1.0, 1.0):
            y = middle + side * 0.7 * half
            z = pitched_roofs.line_height(line, y) - 0.2
            foot = (x, middle + side * 0.05, min(under, z) - 0.7)
            out.add_to("steel", details.beam(foot, (x, y, z), 0.14))


def _add_fence(
    out: Assembly,
    p: Parameters,
    ends: bays.Span,
    strip: bays.Span,
    number: int,
    middle: float,
) -> None:
    """Adds railings on the outer side and at the ends of a platform."""
    a, b = ends
    y0, y1 = strip
    plan = massing.rectangle(a, y0, b, y1)
    edges = [1, 3]
    if not p.island:
        edges.append(0 if (y0 + y1) / 2 < middle else 2)
    for edge in edges:
        wall = details.WallFrame(plan, edge)
        step = wall.length / max(1, round(wall.length / 24.0))
        for k in range(round(wall.length / step)):
            start = (k * step + 0.05, -0.1)
            end = ((k + 1) * step - 0.05, -0.1)
            name = f"railing_{number}{edge}{k}"
            add_railing(out, name, wall, start, end, p.deck, p.steel_rgb)


def _add_hall(
    out: Assembly, p: Parameters, xs: bays.Span, ys: bays.Span
) -> None:
    """Adds the glazed hall with the ticket office under the deck."""
    (x0, x1), (y0, y1) = xs, ys
    x, half = (x0 + x1) / 2 + 0.5, min(p.hall / 2, 0.2 * (x1 - x0))
    top = p.deck - 1.9
    plan = massing.rectangle(x - half, y0 + 0.8, x + half, y1 - 0.8)
    plan = np.round(plan, 2)
    glazing = bays.rhythm(2.4, [bays.ribbon(0.3, top - 0.5, 0.15, 0.2)], 0.3)
    door = bays.entrance(2.2, 2.4, 0.6, surround=0.08)
    doors = bays.with_middle(glazing, door, 3.6)
    layout = bays.by_edge({0: doors, 2: doors}, glazing)
    band = Band(top - 0.35, top, -0.15)
    facade = Facade(round(top, 2), (band,), layout, (0.15,))
    out.add_to(
        "steel",
        massing.foundation(plan),
        facade_mesh(plan, facade),
        massing.flat(plan, round(top, 2)),
    )
    out.add_to("glass", glass_mesh(plan, facade))


def _add_stairs(
    out: Assembly,
    p: Parameters,
    ends: bays.Span,
    room: bays.Span,
    platforms: list[bays.Span],
) -> None:
    """Adds stairs beside the viaduct up to the platforms, and a lift.

    Where there is no room beside it, a lift must do.
    """
    (a, b), (y0, y1) = ends, room
    run, wide = 1.7 * p.deck, min(y1 - y0 - 0.1, 2.6)
    if wide < 1.2 or b - a < run + 8.0:
        y = platforms[0][0] + 0.2
        _add_lift(out, p, (a + 2.0, a + 4.0), (y, y + 2.0))
        return
    y0 = y1 - wide
    for start, sign in ((a + 1.0, 1.0), (b - 1.0, -1.0)):
        if b - a < 2 * run + 6.0 and sign < 0:
            continue
        out.add_to("concrete", *_flight(start, sign, run, (y0, y1), p.deck))
        top = start + sign * run
        u0, u1 = sorted((top - 0.05 * sign, top + sign * 2.4))
        reach = (y0, platforms[0][0] + 0.1)
        landing = massing.box(u0, u1, *reach, p.deck - 0.3, p.deck)
        post = (u0 + 0.8, u1 - 0.8, y0 + 0.1, y0 + 0.5)
        out.add_to("concrete", landing, massing.standing(*post, p.deck - 0.2))
        if p.lift and sign > 0:
            ys = (y0, y0 + min(wide, 2.2))
            _add_lift(out, p, (u1 - 0.02, u1 + 2.2), ys)


def _add_lift(
    out: Assembly, p: Parameters, xs: bays.Span, ys: bays.Span
) -> None:
    shaft = massing.standing(*xs, *ys, p.deck + 2.8, bottom=True)
    out.add_to("glass", shaft)


def _flight(
    start: float, sign: float, run: float, strip: bays.Span, rise: float
) -> list[Mesh]:
    """Stairs that rise along x from the ground, between sloped walls."""
    y0, y1 = strip
    count = max(8, round(rise / 0.32))
    step, tread = rise / count, run / count
    pieces, foot = [], -massing.FOUNDATION_M
    for k in range(count):
        ends = (start + sign * k * tread, start + sign * (k + 1) * tread)
        z = (k + 1) * step
        low = max(z - 0.75, foot) if k > 1 else foot
        limits = (*sorted(ends), y0 + 0.12, y1 - 0.12, low, z)
        pieces.append(massing.box(*limits))
    for y in (y0, y1 - 0.12):
        corners = [
            (start, -0.3), (start + sign * run, rise - 0.5),
            (start + sign * run, rise + 1.0), (start, 1.0),
        ]  # fmt: skip
        wall = massing.bar(corners, y, y + 0.12)
        if sign < 0:
            wall = Mesh(wall.vertices, tuple(f[::-1] for f in wall.faces))
        pieces.append(wall)
    return pieces
