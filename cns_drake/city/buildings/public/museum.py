"""The museum: plaza steps, a colonnade, wings with niches, a dome or attic."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import Band, Facade, Relief
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh

_STONES = ((0.82, 0.79, 0.72), (0.75, 0.73, 0.70), (0.80, 0.74, 0.64))
_STEPS_M = 4.5


class Parameters:
    """Parameters of a museum; lengths in metres.

    `crown` is `pediment`, `dome` or `attic`; its top is at `height`.
    """

    def __init__(self, d: Dice) -> None:
        share = d.uniform(0.42, 0.62)
        columns = int(
            np.clip(round(share * d.width / d.rng.uniform(3.4, 4.4)), 4, 12)
        )
        self.height = d.height
        self.crown = d.pick(("pediment", "dome", "attic"))
        self.podium = d.uniform(1.2, 2.0, 2)
        self.porch_depth = d.uniform(4.0, 5.5, 1)
        self.porch_share = share
        self.columns = columns + columns % 2
        self.column_radius = d.uniform(0.45, 0.65, 2)
        self.wing_pitch = max(d.uniform(3.6, 5.0), d.site.open_length / 36)
        self.niche_depth = d.uniform(0.35, 0.5, 2)
        self.statues = d.chance(0.7)
        self.rgb = d.pick(_STONES)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the museum on a rectangle, steps and forecourt included."""
    x0, y0, x1, y1 = out.site.bounds
    share = {"pediment": 0.72, "dome": 0.62, "attic": 0.84}[p.crown]
    top = round(share * p.height, 2)
    porch_y = y0 + _STEPS_M
    front = porch_y + p.porch_depth
    plan = massing.rectangle(x0, front, x1, y1)
    middle, half = (x0 + x1) / 2, p.porch_share * (x1 - x0) / 2
    a, b = porch = (round(middle - half, 2), round(middle + half, 2))
    wall = details.WallFrame(massing.rectangle(a, porch_y, b, front), 0)
    stairs = details.steps(0.0, b - a, _STEPS_M, p.podium, 8)
    podium = (a - 0.8, b + 0.8, porch_y, front, p.podium)
    pieces = [
        massing.prism(plan, -massing.FOUNDATION_M, p.podium),
        massing.standing(*podium),
        wall.place(stairs),
    ]
    for x in (a - 0.8, b):
        cheek = (x, x + 0.8, y0 + 0.6, porch_y, p.podium + 0.2)
        pieces.append(massing.standing(*cheek, bottom=True))
        if p.statues:
            pieces += _statue(x + 0.4, y0 + 1.4, p.podium + 0.2)
    out.add("podium", *pieces)
    _add_walls(out, p, plan, top, porch)
    out.add("porch", *_porch(p, porch, porch_y, front, top))
    roof = top - 1.0
    if p.crown == "dome":
        out.add("dome", *_dome(p, plan, roof), rgb=(0.42, 0.52, 0.47))
    elif p.crown == "attic":
        _add_attic(out, p, plan, roof)
    else:
        gable = _pediment(porch, porch_y, front + 3.0, top, p.height)
        out.add("pediment", *gable)
    back = massing.rectangle(x0 + 1.0, (front + y1) / 2 + 6.0, x1 - 1.0, y1)
    if back[2, 1] - back[0, 1] > 6.0:
        equip_roof(out, back, roof, ("skylight",) * 3 + ("vents",))


def _statue(x: float, y: float, z: float) -> list[Mesh]:
    """A pedestal and a figure in a cloak, of stacked rings."""
    body = ((0.42, z + 1.1), (0.28, z + 2.1), (0.34, z + 2.5), (0.12, z + 2.7))
    head = ((0.1, z + 2.7), (0.17, z + 2.85), (0.0, z + 3.1))
    return [
        massing.box(x - 0.5, x + 0.5, y - 0.5, y + 0.5, z - 0.1, z + 1.1),
        massing.revolved(body, 7, (x, y)),
        massing.revolved(head, 6, (x, y)),
    ]


def _add_walls(
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    top: float,
    porch: bays.Span,
) -> None:
    """Wings with arched niches, and the doors behind the columns."""
    z0, h = p.podium, top - p.podium
    niche = bays.arched(1.9, 1.4, h - 4.2, p.niche_depth)
    blank = bays.window(1.7, h - 2.6, h - 1.7, 0.2)

    def bay(x0: float, x1: float) -> list[Relief]:
        return [*niche(x0, x1), *blank(x0, x1)]

    wings = bays.rhythm(p.wing_pitch, [bay], margin=1.0)
    width = porch[1] - porch[0]

    def front(edge: int, length: float) -> list[Relief]:
        outside = (length - width) / 2 - 0.5
        kept = [
            r
            for r in wings(edge, length)
            if r.x1 < outside or r.x0 > length - outside
        ]
        doors = bays.entrance(2.6, 5.0, 0.9)
        for k in (-1, 0, 1):
            x = length / 2 + k * width / 3.4
            kept += doors(x - 2.2, x + 2.2)
        return kept

    bands = (Band(0.0, 0.8, -0.2), *tiers.cornice(h - 0.8, 0.7))
    layout = bays.by_edge({0: front}, wings)
    walls = Facade(h, bands, layout, (p.niche_depth,))
    tiers.add_crown(out, plan, walls, z0, 1.0, part="walls")


def _porch(
    p: Parameters, porch: bays.Span, y0: float, y1: float, top: float
) -> list[Mesh]:
    """Columns on the podium that carry an entablature."""
    (a, b), r, beam = porch, p.column_radius, top - 2.2
    pieces = [
        massing.box(a, b, y0 + 0.2, y1 + 0.3, beam, top - 0.5),
        massing.box(a - 0.5, b + 0.5, y0 - 0.3, y1 + 0.3, top - 0.5, top),
    ]
    y = y0 + 0.4 + r
    xs = np.round(np.linspace(a + 1.3 * r, b - 1.3 * r, p.columns), 2)
    spots = [(x, y) for x in xs.tolist()]
    for x, _ in (spots[0], spots[-1]):
        spots.append((x, (y + y1) / 2))
    columns = (details.column(*spot, p.podium, beam, r) for spot in spots)
    return [*pieces, *columns]


def _pediment(
    porch: bays.Span, y0: float, y1: float, z0: float, z1: float
) -> tuple[Mesh, Mesh]:
    """A gable over the porch: a raised rim around a recessed triangle."""
    a, b = porch[0] - 0.5, porch[1] + 0.5
    body = massing.gable_roof(y0 + 0.3, -b, y1, -a, z0, z1 - 0.4 - z0)
    shell = _gable_shell(y0 - 0.3, y1, a, b, z0, z1)
    return body.moved(yaw=np.pi / 2), shell


def _gable_shell(
    y0: float, y1: float, a: float, b: float, z0: float, z1: float
) -> Mesh:
    """Two slopes 0.4 m thick, their ends and undersides."""
    x, t = (a + b) / 2, 0.4
    section = [(a, z0), (a, z0 + t), (x, z1), (b, z0 + t), (b, z0), (x, z1 - t)]
    vertices = [(u, v, w) for v in (y0, y1) for u, w in section]
    quads = [(0, 5, 2, 1), (5, 4, 3, 2)]
    faces = [*quads, *(tuple(6 + i for i in q[::-1]) for q in quads)]
    faces += [(k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k) for k in range(6)]
    return Mesh(np.array(vertices), tuple(faces))


def _dome(p: Parameters, plan: np.ndarray, z0: float) -> list[Mesh]:
    """A square base, a drum and a ribbed dome over the middle."""
    center = plan.mean(axis=0)
    radius = min(0.3 * np.ptp(plan[:, 1]), 0.2 * np.ptp(plan[:, 0]), 9.0)
    total = p.height - z0
    square = massing.regular_polygon(1.55 * radius, 4, center, np.pi / 4)
    base = z0 + 0.25 * total
    h = 0.25 * total
    drum = base + h
    ring = massing.regular_polygon(radius, 16, center)
    bands = (Band(0.4, h - 0.7, 0.25), Band(h - 0.4, h, -0.3))
    ribs = details.piers(
        ring, 9.0, 0.5, 0.15, base, drum - 0.4, depth=0.3, margin=0.2
    )
    angles = np.linspace(0.0, 0.45 * np.pi, 6)
    rise = 0.8 * (p.height - drum)
    profile = [(radius * np.cos(a), drum + rise * np.sin(a)) for a in angles]
    lantern = profile[-1][0]
    profile += [(lantern, p.height - 1.2), (0.0, p.height)]
    return [
        massing.prism(square, z0 - 0.2, base),
        tiers.block(ring, Facade(h, bands), base),
        ribs,
        massing.revolved(profile, 16, center),
    ]


def _add_attic(
    out: Assembly, p: Parameters, plan: np.ndarray, z0: float
) -> None:
    """A second, lower storey set back all around."""
    side = massing.shortest_side(plan)
    inner = massing.inset(plan, round(min(0.18 * side, 4.0), 1))
    h = p.height - z0
    window = bays.window(2.2, 1.6, h - 0.9, 0.3)
    layout = bays.rhythm(p.wing_pitch, [window], margin=1.0)
    walls = Facade(h, (Band(h - 0.5, h, -0.3),), layout, (0.3,))
    tiers.add_crown(out, inner, walls, z0, 0.5, part="attic")
