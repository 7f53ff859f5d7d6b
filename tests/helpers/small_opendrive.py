"""Writes small files of OpenDRIVE; reads any by independent means."""

from itertools import pairwise
import math
from xml.etree import ElementTree

import numpy as np


def geometry(s, x, y, heading, length, shape):
    return (
        f'<geometry s="{s!r}" x="{x!r}" y="{y!r}" hdg="{heading!r}"'
        f' length="{length!r}">{shape}</geometry>'
    )


def cubic(tag, start, a, b=0.0, c=0.0, d=0.0, key="sOffset"):
    return f'<{tag} {key}="{start}" a="{a}" b="{b}" c="{c}" d="{d}"/>'


def lane(number, kind, *widths, more=""):
    """A lane; each width is a number or a row of start, a, b, c, d."""
    rows = [w if isinstance(w, tuple) else (0.0, w) for w in widths]
    text = "".join(cubic("width", *row) for row in rows)
    return f'<lane id="{number}" type="{kind}">{text}{more}</lane>'


def section(s, *lanes):
    left = "".join(x for x in lanes if 'id="-' not in x)
    right = "".join(x for x in lanes if 'id="-' in x)
    return (
        f'<laneSection s="{s}"><left>{left}</left>'
        f'<center><lane id="0" type="none"/></center><right>{right}</right>'
        "</laneSection>"
    )


def road(
    name,
    length,
    pieces,
    sections,
    *,
    junction="-1",
    elevation="",
    lateral="",
    offset="",
    more="",
    rule="RHT",
):
    return (
        f'<road id="{name}" length="{length!r}" junction="{junction}"'
        f' rule="{rule}"><planView>{"".join(pieces)}</planView>'
        f"<elevationProfile>{elevation}</elevationProfile>"
        f"<lateralProfile>{lateral}</lateralProfile>"
        f"<lanes>{offset}{''.join(sections)}</lanes>{more}</road>"
    )


def write_roads(path, *roads, header=""):
    path.write_text(
        '<?xml version="1.0"?>\n<OpenDRIVE><header revMajor="1" revMinor="6">'
        f"{header}</header>\n{''.join(roads)}</OpenDRIVE>\n"
    )
    return path


TWO_LANES = (
    lane(3, "sidewalk", 2.0),
    lane(1, "driving", 3.5),
    lane(-1, "driving", 3.5),
    lane(-3, "sidewalk", 2.0),
)


def straight(name, x0, y0, x1, y1, *, junction="-1", lanes=TWO_LANES, **more):
    """A straight road with two lanes and sidewalks."""
    length = math.hypot(x1 - x0, y1 - y0)
    heading = math.atan2(y1 - y0, x1 - x0)
    line = geometry(0.0, float(x0), float(y0), heading, length, "<line/>")
    own = (section(0.0, *lanes),)
    return road(name, length, [line], own, junction=junction, **more)


def turn(name, x, y, heading, radius, angle, *, number=-1, junction="1"):
    """A lane of a junction, on an arc; a positive angle turns left."""
    curvature = math.copysign(1.0 / radius, angle)
    arc = geometry(
        0.0, float(x), float(y), heading, abs(angle) * radius,
        f'<arc curvature="{curvature!r}"/>',
    )  # fmt: skip
    own = (section(0.0, lane(number, "driving", 3.5)),)
    return road(name, abs(angle) * radius, [arc], own, junction=junction)


def _number(element, name, default=0.0):
    return float(element.get(name, default))


def _records(elements, key):
    return sorted(
        (
            _number(e, key), *(_number(e, k) for k in "abcd")
        ) for e in elements
    )  # fmt: skip


def _value(records, s):
    """The value of the record at s, away from joints."""
    held = [r for r in records if r[0] <= s]
    if not held:
        return 0.0
    start, a, b, c, d = held[-1]
    return a + (s - start) * (b + (s - start) * (c + (s - start) * d))


def _integrated(piece, wanted, step=0.02):
    """Places on a piece by the rule of Runge and Kutta, (N, 3) x, y, h."""
    length = _number(piece, "length")
    arc, spiral = piece.find("arc"), piece.find("spiral")
    first = last = 0.0
    if arc is not None:
        first = last = _number(arc, "curvature")
    if spiral is not None:
        first, last = _number(spiral, "curvStart"), _number(spiral, "curvEnd")

    def rate(s, state):
        curvature = first + (last - first) * s / length
        return np.array([math.cos(state[2]), math.sin(state[2]), curvature])

    state = np.array([_number(piece, k) for k in ("x", "y", "hdg")])
    at = 0.0
    found = []
    for goal in wanted:
        count = max(1, math.ceil((goal - at) / step))
        h = (goal - at) / count
        for _ in range(count):
            k1 = rate(at, state)
            k2 = rate(at + h / 2, state + h / 2 * k1)
            k3 = rate(at + h / 2, state + h / 2 * k2)
            k4 = rate(at + h, state + h * k3)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            at += h
        found.append(state)
    return np.array(found)


def _traced(piece, wanted, count=200_001):
    """Places on a cubic curve, by the lengths of many chords."""
    poly3, both = piece.find("poly3"), piece.find("paramPoly3")
    length = _number(piece, "length")
    if poly3 is not None:
        p = np.linspace(0.0, length, count)
        u, v = p, sum(_number(poly3, k) * p**n for n, k in enumerate("abcd"))
    else:
        by_arc = both.get("pRange") == "arcLength"
        p = np.linspace(0.0, length if by_arc else 1.0, count)
        u, v = (
            sum(_number(both, k + c) * p**n for n, k in enumerate("abcd"))
            for c in "UV"
        )
    chords = np.hypot(np.diff(u), np.diff(v))
    along = np.concatenate([[0.0], np.cumsum(chords)])
    if poly3 is None:
        along *= length / along[-1]
        if by_arc:
            along = p
    u, v = np.interp(wanted, along, u), np.interp(wanted, along, v)
    at = np.interp(wanted, along, p)
    if poly3 is not None:
        slope = sum(
            n * _number(poly3, k) * at ** (n - 1)
            for n, k in enumerate("abcd") if n
        )  # fmt: skip
        turned = np.arctan(slope)
    else:
        rates = [
            sum(
                n * _number(both, k + c) * at ** (n - 1)
                for n, k in enumerate("abcd") if n
            )
            for c in "UV"
        ]  # fmt: skip
        turned = np.arctan2(rates[1], rates[0])
    x, y, h = (_number(piece, k) for k in ("x", "y", "hdg"))
    return np.column_stack(
        [
            x + u * math.cos(h) - v * math.sin(h),
            y + u * math.sin(h) + v * math.cos(h),
            h + turned,
        ]
    )


def sampled_lanes(path, spacing=1.0, only=None):
    """Yields road id, lane id, type and its edges (N, 3) between the joints.

    By other means than the program: curves are integrated step by step, and
    borders summed up lane by lane at one place after the other.
    """
    tree = ElementTree.parse(path).getroot()
    for one in tree.iter("road"):
        if only is not None and one.get("id") not in only:
            continue
        pieces = sorted(
            (
                g for g in one.iter("geometry") if _number(g, "length") > 1e-5
            ), key=lambda g: _number(g, "s"),
        )  # fmt: skip
        if not pieces:
            continue
        length = min(
            _number(one, "length"),
            _number(pieces[-1], "s") + _number(pieces[-1], "length"),
        )
        elevation = _records(one.iter("elevation"), "s")
        lateral = _records(one.iter("superelevation"), "s")
        offset = _records(one.iter("laneOffset"), "s")
        sections = sorted(
            one.iter("laneSection"), key=lambda e: _number(e, "s")
        )
        bounds = [_number(e, "s") for e in sections]
        bounds = [*bounds, length]
        joints = {*bounds, length, *(_number(g, "s") for g in pieces)}
        for records in (elevation, lateral, offset):
            joints |= {r[0] for r in records}
        for e, start in zip(sections, bounds, strict=False):
            joints |= {start + _number(w, "sOffset") for w in e.iter("width")}
        joints = sorted(j for j in joints if 0.0 <= j <= length)
        # Just before and just after each joint.
        wanted = []
        for a, b in pairwise(joints):
            if b - a > 1e-3:
                inner = np.arange(a + spacing, b - spacing / 2, spacing)
                wanted += [a + 1e-5, *inner.tolist(), b - 1e-5]
        if not wanted:
            continue
        line = []
        starts = [_number(g, "s") for g in pieces]
        for g, a, b in zip(pieces, starts, [*starts[1:], 1e9], strict=True):
            inside = [s - a for s in wanted if a <= s < b]
            if not inside:
                continue
            is_cubic = g.find("poly3") is not None
            is_cubic |= g.find("paramPoly3") is not None
            line += [(_traced if is_cubic else _integrated)(g, inside)]
        line = np.concatenate(line)
        for e, a, b in zip(sections, bounds[:-1], bounds[1:], strict=True):
            chosen = [k for k, s in enumerate(wanted) if a <= s < b]
            if not chosen:
                continue
            for side in (1, -1):
                lanes = [
                    x for x in e.iter("lane") if int(x.get("id")) * side > 0
                ]
                lanes.sort(key=lambda x: abs(int(x.get("id"))))
                edge = [
                    _beside(
                        line[k], wanted[k], _value(offset, wanted[k]),
                        elevation, lateral,
                    ) for k in chosen
                ]  # fmt: skip
                total = [_value(offset, wanted[k]) for k in chosen]
                for x in lanes:
                    widths = _records(x.iter("width"), "sOffset")
                    total = [
                        t + side * max(0.0, _value(widths, wanted[k] - a))
                        for t, k in zip(total, chosen, strict=True)
                    ]
                    outer = [
                        _beside(line[k], wanted[k], t, elevation, lateral)
                        for t, k in zip(total, chosen, strict=True)
                    ]
                    yield (
                        one.get("id"), int(x.get("id")), x.get("type"),
                        np.array(edge), np.array(outer),
                    )  # fmt: skip
                    edge = outer


def _beside(place, s, t, elevation, lateral):
    x, y, heading = place
    roll = _value(lateral, s)
    across = t * math.cos(roll)
    return (
        x + across * math.cos(heading + math.pi / 2),
        y + across * math.sin(heading + math.pi / 2),
        _value(elevation, s) + t * math.sin(roll),
    )
