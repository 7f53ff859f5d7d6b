"""Objects on construction sites and at roadworks."""

import numpy as np

from cns_drake.city.geometry.structures import (
    Builder,
    MeshShape,
    Model,
    Part,
    assemble,
    bar,
    block,
    one_mesh,
    triple,
)

_STEEL_COLOURS = (
    (0.25, 0.38, 0.52),
    (0.55, 0.24, 0.18),
    (0.42, 0.44, 0.42),
    (0.24, 0.4, 0.32),
)
_YELLOW = (0.82, 0.62, 0.14)
_ORANGE = (0.86, 0.4, 0.12)
_EARTH = (0.46, 0.38, 0.28)
_DARK = (0.2, 0.21, 0.22)
_PIPE = (0.6, 0.58, 0.54)
_TOILETS = ((0.2, 0.4, 0.55), (0.25, 0.45, 0.3))


def site_cabin(rng: np.random.Generator, *, storeys: int = 1) -> Model:
    """Returns site offices along x, one on top of the other.

    Args:
        rng: draws the colour.
        storeys: number of cabins.
    """
    colours = ((0.75, 0.75, 0.72), (0.3, 0.44, 0.58), (0.72, 0.6, 0.25))
    colour = colours[int(rng.integers(3))]
    parts = [
        Part(
            f"cabin_{k}",
            MeshShape("site_cabin"),
            xyz=(0.0, 0.0, round(2.75 * k, 3)),
            rgb=colour,
        )
        for k in range(storeys)
    ]
    return assemble(*parts)


def skip(rng: np.random.Generator) -> Model:
    """Returns a skip half full of rubble, along x."""
    return assemble(
        Part("shell", MeshShape("skip_shell"), rgb=_YELLOW),
        Part(
            "load",
            MeshShape("heap", (0.3, 0.2, 0.25)),
            xyz=(0.0, 0.0, round(float(rng.uniform(0.7, 0.95)), 3)),
            rpy=(0.0, 0.0, round(float(rng.uniform(0, 0.2)), 3)),
            rgb=_EARTH,
        ),
    )


def soil_heap(rng: np.random.Generator) -> Model:
    """Returns a heap of earth or sand, 4 to 8 m across."""
    size = rng.uniform(0.55, 1.1, 2)
    scale = triple(round(float(s), 3) for s in (*size, size.mean()))
    part = Part(
        "heap",
        MeshShape("heap", scale),
        rpy=(0.0, 0.0, round(float(rng.uniform(-3, 3)), 3)),
        rgb=(_EARTH, (0.72, 0.63, 0.46))[int(rng.integers(2))],
    )
    return assemble(part)


def brick_pallets(rng: np.random.Generator) -> Model:
    """Returns two to five pallets of bricks in a loose row along y."""
    count = int(rng.integers(2, 6))
    parts = [
        Part(
            f"pallet_{k}",
            MeshShape("brick_pallet", (1.0, 1.0, (0.6, 1.0)[k % 2])),
            xyz=(
                round(float(rng.uniform(-0.2, 0.2)), 3),
                round(1.5 * (k - (count - 1) / 2), 3),
                0.0,
            ),
            rpy=(0.0, 0.0, round(float(rng.uniform(-0.15, 0.15)), 3)),
            rgb=(0.62, 0.34, 0.26),
        )
        for k in range(count)
    ]
    return assemble(*parts)


def excavator(rng: np.random.Generator) -> Model:
    """Returns a tracked excavator, its arm stretched out along +x."""
    turn = round(float(rng.uniform(-0.6, 0.6)), 3)
    return assemble(
        Part("tracks", MeshShape("excavator_tracks"), rgb=_DARK),
        Part(
            "upper",
            MeshShape("excavator_upper"),
            rpy=(0.0, 0.0, turn),
            rgb=_YELLOW,
        ),
    )


def traffic_cones(rng: np.random.Generator, *, count: int = 5) -> Model:
    """Returns a row of traffic cones along x, 1.5 m apart.

    Args:
        rng: sets each cone a little off the line.
        count: number of cones.
    """
    parts = [
        Part(
            f"cone_{k}",
            MeshShape("traffic_cone"),
            xyz=(
                round(1.5 * (k - (count - 1) / 2), 3),
                round(float(rng.uniform(-0.15, 0.15)), 3),
                0.0,
            ),
            rgb=_ORANGE,
        )
        for k in range(count)
    ]
    return assemble(*parts)


SITE_EQUIPMENT = {
    "container": one_mesh("container", _STEEL_COLOURS, "other-structure"),
    "site_cabin": Builder("other-structure", site_cabin),
    "skip": Builder("other-object", skip),
    "soil_heap": Builder("terrain", soil_heap),
    "pipe_stack": one_mesh("pipe_stack", [_PIPE], x=(0.8, 1.3)),
    "brick_pallets": Builder("other-object", brick_pallets),
    "excavator": Builder("other-vehicle", excavator),
    "portable_toilet": one_mesh("portable_toilet", _TOILETS),
    "traffic_cones": Builder("other-object", traffic_cones),
}
_CRANE_YELLOW = (0.84, 0.66, 0.16)
_CONCRETE = (0.62, 0.61, 0.58)
_SECTION = 4.0


def tower_crane(
    rng: np.random.Generator,
    *,
    height: float | None = None,
    reach: float | None = None,
) -> Model:
    """Returns a tower crane whose jib points along a drawn heading.

    Args:
        rng: draws the heading and each value that is not given.
        height: height of the jib, made up of whole mast sections of 4 m [m].
        reach: reach of the jib, made up of whole sections of 4 m [m].
    """
    drawn_height, drawn_reach = rng.uniform(36.0, 56.0), rng.uniform(28, 44)
    heading = round(float(rng.uniform(-np.pi, np.pi)), 3)
    height = drawn_height if height is None else height
    reach = drawn_reach if reach is None else reach
    storeys = max(3, round(height / _SECTION))
    bays = max(3, round(reach / _SECTION))
    top = storeys * _SECTION
    parts = [block("base", (5.0, 5.0, 1.0), (0, 0, 0.2), rgb=_CONCRETE)]
    parts += [
        Part(
            f"mast_{k:02d}",
            MeshShape("crane_mast"),
            xyz=(0.0, 0.0, k * _SECTION),
            rgb=_CRANE_YELLOW,
        )
        for k in range(storeys)
    ]
    turned = (0.0, 0.0, heading)
    c, s = float(np.cos(heading)), float(np.sin(heading))

    def at(along: float, z: float) -> tuple[float, float, float]:
        return (along * c, along * s, z)

    for k in range(-3, bays):
        parts.append(
            Part(
                f"jib_{k + 3:02d}",
                MeshShape("crane_jib"),
                xyz=at(k * _SECTION, top + 0.6),
                rpy=turned,
                rgb=_CRANE_YELLOW,
            )
        )
    peak = at(0.0, top + 7.5)
    trolley = 0.6 * bays * _SECTION
    hook = top - 0.45 * top
    parts += [
        Part(
            "cab",
            MeshShape("crane_cab"),
            (0, 0, top),
            turned,
            _CRANE_YELLOW,
        ),
        bar("peak", at(0, top), peak, 0.25, _CRANE_YELLOW),
        bar("stay", peak, at(0.7 * bays * _SECTION, top + 1.8), 0.06),
        bar("back_stay", peak, at(-2.8 * _SECTION, top + 1.8), 0.06),
        block(
            "counterweight",
            (2.2, 1.6, 2.4),
            at(-2.6 * _SECTION, top + 0.2),
            heading,
            _CONCRETE,
        ),
        bar("rope", at(trolley, hook), at(trolley, top + 0.6), 0.04),
        block(
            "hook",
            (0.4, 0.5, 0.9),
            at(trolley, hook),
            heading,
            _CRANE_YELLOW,
        ),
    ]
    return assemble(*parts)


CRANES = {"tower_crane": Builder("other-structure", tower_crane)}
