"""Bays of facades (windows, shop fronts, doors), and layouts that repeat them.

A bay is a function that returns the reliefs (recesses and protrusions) on a
stretch x0..x1 of a wall. A layout is a function that repeats bays along the
walls of a storey. All heights are above the storey's floor [m].
"""

from collections.abc import Callable, Sequence

from worlds.city.facades.reliefs import Arch, Patch, Relief
from worlds.city.facades.walls import Layout, no_relief

Bay = Callable[[float, float], list[Relief]]
# Start and end of a stretch of a wall [m].
Span = tuple[float, float]


def _cm(value: float) -> float:
    """Returns a length rounded to centimetres, which keeps mesh files small."""
    return round(value, 2)


def _centred(x0: float, x1: float, width: float) -> tuple[float, float]:
    width = min(width, x1 - x0)
    return _cm((x0 + x1 - width) / 2), _cm((x0 + x1 + width) / 2)


def blank(x0: float, x1: float) -> list[Relief]:
    """A bay of plain wall: a function that returns no reliefs."""
    return []


def window(
    width: float,
    sill: float,
    head: float,
    depth: float,
    *,
    mullions: int = 0,
    transom: float | None = None,
    ledge: float = 0.0,
    hood: float = 0.0,
    pier: float = 0.35,
) -> Bay:
    """Returns a bay with a recessed window.

    Args:
        width: width of the window [m]; the window is narrower in a bay that is
            too narrow.
        sill: height of the bottom of the glass [m].
        head: height of the top of the glass [m].
        depth: distance of the glass behind the wall [m].
        mullions: number of upright bars.
        transom: height of a horizontal bar [m]; None for no bar.
        ledge: how far the sill sticks out of the wall [m].
        hood: how far the lintel sticks out of the wall [m].
        pier: least width of wall on either side [m].
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, min(width, x1 - x0 - 2 * pier))
        if b - a < 0.3:
            return []
        relief: list[Relief] = [Patch(a, b, sill, head, depth)]
        bar = max(0.05, depth - 0.12)
        for k in range(1, mullions + 1):
            x = _cm(a + (b - a) * k / (mullions + 1))
            relief.append(Patch(x - 0.05, x + 0.05, sill, head, bar))
        if transom is not None:
            relief.append(Patch(a, b, transom - 0.04, transom + 0.04, bar))
        if ledge > 0:
            relief.append(Patch(a - 0.1, b + 0.1, sill - 0.15, sill, -ledge))
        if hood > 0:
            relief.append(Patch(a - 0.15, b + 0.15, head, head + 0.25, -hood))
        return relief

    return bay


def ribbon(sill: float, head: float, depth: float, post: float) -> Bay:
    """Returns a bay of a ribbon window, with half a post at each end.

    Two such bays side by side have a whole post between them.

    Args:
        sill, head, depth: see `window`.
        post: width of a whole post [m].
    """
    return window(1e3, sill, head, depth, pier=post / 2)


def arched(
    width: float,
    bottom: float,
    spring: float,
    depth: float,
    *,
    rise: float | None = None,
) -> Bay:
    """Returns a bay with a round-headed recess in its middle.

    Args:
        width: width of the recess [m]; the recess is narrower in a bay that is
            too narrow.
        bottom: height of the bottom of the recess [m].
        spring: height at which the arch begins [m].
        depth: distance of the back of the recess behind the wall [m].
        rise: height of the arch [m]; by default half the width, which gives a
            half circle.
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, min(width, x1 - x0 - 0.6))
        if b - a < 0.4:
            return []
        top = spring + (_cm((b - a) / 2) if rise is None else rise)
        return [Arch(a, b, bottom, spring, top, depth)]

    return bay


def shop_front(
    head: float,
    depth: float = 0.35,
    *,
    pier: float = 0.3,
    door: bool = True,
) -> Bay:
    """Returns a bay with a shop front: glass over a low riser, and a door.

    The door is recessed. Bays with less than 1.6 m of space stay plain.

    Args:
        head: height of the top of the glass [m].
        depth: distance of the glass behind the wall [m].
        pier: width of wall on each side [m].
        door: whether there is a door; otherwise a post divides the glass.
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, x1 - x0 - 2 * pier)
        if b - a < 1.6:
            return []
        relief: list[Relief] = [
            Patch(a, b, 0.0, 0.45, depth - 0.2),
            Patch(a, b, 0.45, head, depth),
        ]
        if door:
            x = _cm(a + 0.62 * (b - a))
            relief.append(Patch(x, min(x + 1.1, b), 0.0, head, depth + 0.6))
        else:
            x = _cm((a + b) / 2)
            relief.append(Patch(x - 0.06, x + 0.06, 0.45, head, depth - 0.15))
        return relief

    return bay


def entrance(
    width: float, height: float, depth: float = 0.9, *, surround: float = 0.2
) -> Bay:
    """Returns a bay with a deep doorway in a frame that protrudes.

    Args:
        width: width of the doorway [m]; the doorway is narrower in a bay that
            is too narrow.
        height: height of the doorway [m].
        depth: distance of the door behind the wall [m].
        surround: how far the frame protrudes from the wall [m].
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, min(width, x1 - x0 - 1.0))
        middle = _cm((a + b) / 2)
        return [
            Patch(a - 0.4, b + 0.4, 0.0, height + 0.5, -surround),
            Patch(a, b, 0.0, height, depth),
            Patch(a, b, 2.5, 2.62, depth - 0.2),
            Patch(middle - 0.06, middle + 0.06, 0.0, height, depth - 0.2),
        ]

    return bay


def house_door(width: float, z0: float, z1: float, depth: float) -> Bay:
    """Returns a bay with a house's doorway; the doorway can be above steps.

    The door has two leaves, a fanlight and a flat surround.

    Args:
        width, depth: see `entrance`.
        z0: height of the threshold [m].
        z1: height of the top of the doorway [m].
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, min(width, x1 - x0 - 0.6))
        middle, light = _cm((a + b) / 2), _cm(z1 - 0.4)
        return [
            Patch(a - 0.25, b + 0.25, z0, _cm(z1 + 0.25), -0.1),
            Patch(a, b, z0, z1, depth),
            Patch(a, b, light, _cm(light + 0.08), depth - 0.12),
            Patch(middle - 0.05, middle + 0.05, z0, light, depth - 0.06),
        ]

    return bay


def bar(width: float, z0: float, z1: float, depth: float) -> Bay:
    """Returns a bay with an upright bar in its middle.

    Args:
        width: width of the bar [m].
        z0: height of the bar's lower end [m].
        z1: height of the bar's upper end [m].
        depth: distance of the bar's front behind the wall [m]; negative if the
            bar protrudes.
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, width)
        return [Patch(a, b, z0, z1, depth)]

    return bay


def gate(width: float, height: float, depth: float = 0.3) -> Bay:
    """Returns a bay with a ribbed roller shutter in its middle.

    The shutter is `width` wide (narrower in a narrow bay), `height` high, and
    `depth` behind the wall [m].
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, min(width, x1 - x0 - 0.6))
        relief: list[Relief] = [Patch(a, b, 0.0, height, depth)]
        for k in range(1, 4):
            z = _cm(height * k / 4)
            relief.append(Patch(a, b, z - 0.05, z + 0.05, depth - 0.1))
        return relief

    return bay


def loggia(width: float, depth: float, rail: float, head: float) -> Bay:
    """Returns a bay with a balcony inside the wall, behind a solid rail.

    Args:
        width: width of the balcony [m]; the balcony is narrower in a bay that
            is too narrow.
        depth: distance of the balcony's back wall behind the wall [m].
        rail: height of the top of the rail [m].
        head: height of the top of the opening [m].
    """

    def bay(x0: float, x1: float) -> list[Relief]:
        a, b = _centred(x0, x1, min(width, x1 - x0 - 0.3))
        x = _cm(a + 0.3 * (b - a))
        return [
            Patch(a, b, rail, head, depth),
            Patch(x, b - 0.3, rail, head - 0.15, depth + 0.15),
        ]

    return bay


def stretches(length: float, pitch: float, margin: float) -> list[Span]:
    """Divides a wall into equal bays; returns start and end of each [m].

    The bays are about `pitch` wide and keep `margin` away from both ends of the
    wall. A wall that is too short for a bay of this width gets one narrower
    bay, or none.
    """
    room = length - 2 * margin
    count = max(int(room / pitch + 0.4), int(room > 0.6 * pitch))
    return [
        (margin + k * room / count, margin + (k + 1) * room / count)
        for k in range(count)
    ]


def bounds(cells: Sequence[Span]) -> list[float]:
    """Returns the N + 1 boundaries of N adjoining cells, in order [m].

    `cells` contains the start and the end of each cell.
    """
    return [cells[0][0], *(end for _, end in cells)]


def rhythm(pitch: float, bays: Sequence[Bay], margin: float = 0.5) -> Layout:
    """Returns a layout that repeats a sequence of bays along each wall.

    The layout of a wall is symmetric about its middle.

    Args:
        pitch: approximate width of a bay [m].
        bays: the sequence of bays, from an end of the wall to its middle.
        margin: distance of the outermost bays from the ends of the wall [m].
    """

    def layout(edge: int, length: float) -> list[Relief]:
        cells = stretches(length, pitch, margin)
        relief: list[Relief] = []
        for k, (x0, x1) in enumerate(cells):
            nth = min(k, len(cells) - 1 - k)
            relief.extend(bays[nth % len(bays)](x0, x1))
        return relief

    return layout


def with_middle(layout: Layout, bay: Bay, width: float) -> Layout:
    """Returns a layout with an additional bay in the middle of each wall.

    The bay is `width` wide [m] and replaces the reliefs that it touches. Walls
    shorter than the bay stay unchanged.
    """

    def combined(edge: int, length: float) -> list[Relief]:
        x0, x1 = (length - width) / 2, (length + width) / 2
        if x0 < 0.3:
            return list(layout(edge, length))
        kept = [
            r
            for r in layout(edge, length)
            if r.x1 < x0 + 0.05 or r.x0 > x1 - 0.05
        ]
        return [*kept, *bay(x0, x1)]

    return combined


def alone(bay: Bay, width: float) -> Layout:
    """Returns a layout with one bay, `width` wide [m], in each wall's middle.

    Walls shorter than the bay have no bay.
    """
    return with_middle(no_relief, bay, width)


def by_edge(
    layouts: dict[int, Layout], otherwise: Layout = no_relief
) -> Layout:
    """Returns a layout that chooses between other layouts by edge.

    `layouts` maps the number of an edge to the layout of its wall. Walls at all
    other edges get the layout `otherwise`, by default no openings.
    """

    def layout(edge: int, length: float) -> Sequence[Relief]:
        return layouts.get(edge, otherwise)(edge, length)

    return layout


def with_door(layout: Layout, door: Bay, width: float) -> Layout:
    """Returns a layout with a door added in the middle of the front.

    Args:
        layout: the layout to which the door is added.
        door: the bay of the door, which replaces the reliefs that it touches.
        width: width of this bay [m].
    """
    return by_edge({0: with_middle(layout, door, width)}, layout)
