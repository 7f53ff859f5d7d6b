"""Things of squares, parks and yards: fences, monuments, pavilions, swings."""

from dataclasses import dataclass

import numpy as np

from cns_drake.city.geometry.structures import (
    ROOT_DEPTH,
    Builder,
    MeshShape,
    Model,
    Part,
    assemble,
    block,
    one_mesh,
    post,
)

_LONGEST = 8


@dataclass(frozen=True)
class RunKind:
    """A kind of fence.

    Attributes:
        panel: nominal length of a panel [m].
        height: nominal height [m].
        colours: to choose from.
        end_post: x size, y from, y to, z to of the post that ends the run
            [m], or None.
    """

    panel: float
    height: float
    colours: tuple[tuple[float, float, float], ...]
    end_post: tuple[float, float, float, float] | None = None


# By the stems of their meshes' names.
RUN_KINDS = {
    "railing": RunKind(
        panel=2.0,
        height=1.1,
        colours=((0.15, 0.17, 0.18), (0.35, 0.37, 0.4), (0.16, 0.27, 0.22)),
        end_post=(0.06, -0.03, 0.03, 1.1),
    ),
    "picket_fence": RunKind(
        panel=2.0,
        height=1.2,
        colours=((0.85, 0.84, 0.8), (0.5, 0.36, 0.24), (0.42, 0.42, 0.4)),
        end_post=(0.1, -0.12, -0.05, 1.1),
    ),
    "garden_wall": RunKind(
        panel=3.0,
        height=1.7,
        colours=((0.6, 0.38, 0.3), (0.7, 0.64, 0.54), (0.58, 0.56, 0.53)),
        end_post=(0.4, -0.2, 0.2, 1.7),
    ),
    "hoarding": RunKind(
        panel=2.4,
        height=2.26,
        colours=((0.75, 0.72, 0.66), (0.2, 0.36, 0.58), (0.34, 0.5, 0.36)),
        end_post=(0.1, -0.14, 0.05, 2.2),
    ),
    "site_fence": RunKind(panel=3.5, height=2.0, colours=((0.6, 0.62, 0.63),)),
    "concrete_barrier": RunKind(
        panel=2.0, height=0.81, colours=((0.55, 0.55, 0.54),)
    ),
    "hedge": RunKind(
        panel=2.0,
        height=1.4,
        colours=((0.24, 0.4, 0.19), (0.3, 0.44, 0.22), (0.2, 0.34, 0.2)),
    ),
}


def run(
    rng: np.random.Generator,
    name: str,
    length: float,
    height: float | None = None,
) -> Model:
    """Returns a run of panels.

    Args:
        rng: draws the colour.
        name: a key of `RUN_KINDS`.
        length: length of the run [m]; positive.
        height: [m], positive; the nominal one if not given.
    """
    kind = RUN_KINDS[name]
    height = kind.height if height is None else height
    if not (length > 0 and height > 0):
        raise ValueError(
            f"{name}: length {length}, height {height}: not positive"
        )
    colour = kind.colours[int(rng.integers(len(kind.colours)))]
    tall = round(height / kind.height, 4)
    total = max(1, round(length / kind.panel))
    stretch = round(length / (total * kind.panel), 4)
    parts: list[Part] = []
    done = 0
    while done < total:
        count = _LONGEST
        while count > total - done:
            count //= 2
        parts.append(
            Part(
                f"run_{len(parts):02d}",
                MeshShape(f"{name}_x{count}", (stretch, 1.0, tall)),
                xyz=(done * kind.panel * stretch - length / 2, 0.0, 0.0),
                rgb=colour,
            )
        )
        done += count
    if kind.end_post:
        x, y0, y1, top = kind.end_post
        top *= tall
        parts.append(
            block(
                "end",
                (x, y1 - y0, top + ROOT_DEPTH),
                (length / 2 - x / 2, (y0 + y1) / 2, (top - ROOT_DEPTH) / 2),
                rgb=colour,
            )
        )
    return assemble(*parts)


def _builder(name: str) -> Builder:
    def build(
        rng: np.random.Generator,
        *,
        length: float = 10.0,
        height: float | None = None,
    ) -> Model:
        return run(rng, name, length, height)

    semantic_class = "vegetation" if name == "hedge" else "fence"
    return Builder(semantic_class, build)


FENCES = {name: _builder(name) for name in RUN_KINDS}
_STONE = (0.7, 0.67, 0.61)
_BRONZE = (0.28, 0.34, 0.28)
_WATER = (0.35, 0.5, 0.6)
_WHITE = (0.85, 0.85, 0.85)


def statue(rng: np.random.Generator) -> Model:
    """Returns a bronze figure, arm raised, on a stepped pedestal."""
    size = round(float(rng.uniform(0.9, 1.2)), 3)
    turn = round(float(rng.uniform(-0.4, 0.4)), 3)
    scale = (size, size, size)
    return assemble(
        Part("pedestal", MeshShape("statue_pedestal", scale), rgb=_STONE),
        Part(
            "figure",
            MeshShape("statue_figure", scale),
            xyz=(0.0, 0.0, round(2.9 * size, 3)),
            rpy=(0.0, 0.0, turn),
            rgb=_BRONZE,
        ),
    )


def obelisk(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a stepped obelisk.

    Args:
        rng: draws the height if it is not given.
        height: height of the tip [m].
    """
    drawn = float(rng.uniform(9.0, 14.0))
    height = drawn if height is None else height
    tall = round(height / 10.0, 3)
    wide = round(tall**0.5, 3)
    return assemble(
        Part("body", MeshShape("obelisk", (wide, wide, tall)), rgb=_STONE),
    )


def fountain(rng: np.random.Generator, *, radius: float | None = None) -> Model:
    """Returns a round fountain: basin, water, two bowls on a stem.

    Args:
        rng: draws the radius if it is not given.
        radius: radius of the basin [m].
    """
    drawn = float(rng.uniform(2.5, 3.6))
    radius = drawn if radius is None else radius
    wide = round(radius / 3.0, 3)
    scale = (wide, wide, round(wide**0.5, 3))
    return assemble(
        Part("stone", MeshShape("fountain_stone", scale), rgb=_STONE),
        Part("water", MeshShape("fountain_water", scale), rgb=_WATER),
    )


def flag_poles(
    rng: np.random.Generator, *, count: int = 3, spacing: float = 2.5
) -> Model:
    """Returns a row of flag poles along y, with waving flags.

    Args:
        rng: draws height, wind and colours.
        count: number of poles.
        spacing: between neighbours [m].
    """
    height = float(rng.uniform(7.5, 9.5))
    wind = float(rng.uniform(-np.pi, np.pi))
    parts = []
    for k in range(count):
        y = spacing * (k - (count - 1) / 2)
        turn = round(wind + float(rng.uniform(-0.15, 0.15)), 3)
        parts += [
            post(f"pole_{k}", 0.05, height, (0.0, y), _WHITE),
            Part(
                f"flag_{k}",
                MeshShape("flag"),
                xyz=(0.0, y, height - 0.1),
                rpy=(0.0, 0.0, turn),
                rgb=tuple(rng.uniform(0.15, 0.85, 3).round(3).tolist()),
            ),
        ]
    return assemble(*parts)


MONUMENTS = {
    "statue": Builder("other-structure", statue),
    "obelisk": Builder("other-structure", obelisk),
    "fountain": Builder("other-structure", fountain),
    "flag_poles": Builder("pole", flag_poles),
}
_DARK = (0.2, 0.22, 0.24)
_STEEL = (0.45, 0.47, 0.49)
_GLASS = (0.55, 0.65, 0.68)
_PILLAR = (0.6, 0.62, 0.55)
_KIOSKS = ((0.2, 0.33, 0.28), (0.5, 0.22, 0.18), (0.3, 0.34, 0.42))
_PHONE_BOXES = ((0.68, 0.14, 0.13), (0.3, 0.4, 0.5))


def bus_shelter(rng: np.random.Generator) -> Model:
    """Returns a bus shelter, 4 m by 1.5 m, open towards +x, with a stop."""
    advert = (1, -1)[int(rng.integers(2))]
    # The mirror image is a mesh of its own: a mirrored mesh would be inside
    # out.
    side = "left" if advert > 0 else "right"
    return assemble(
        Part("frame", MeshShape(f"shelter_{side}_frame"), rgb=_DARK),
        Part("panes", MeshShape(f"shelter_{side}_panes"), rgb=_GLASS),
        post("stop", 0.03, 2.9, (0.9, -2.6 * advert), _STEEL),
    )


def cafe_table(rng: np.random.Generator) -> Model:
    """Returns a table with four chairs under an umbrella."""
    colours = ((0.82, 0.78, 0.68), (0.6, 0.2, 0.18), (0.25, 0.4, 0.35))
    height = float(rng.uniform(2.5, 2.75))
    turn = round(float(rng.uniform(-np.pi, np.pi)), 3)
    return assemble(
        Part(
            "table",
            MeshShape("cafe_set"),
            rpy=(0.0, 0.0, turn),
            rgb=(0.5, 0.42, 0.34),
        ),
        post("pole", 0.025, height, rgb=_STEEL),
        Part(
            "umbrella",
            MeshShape("cafe_umbrella"),
            xyz=(0.0, 0.0, height),
            rpy=(0.0, 0.0, turn / 3),
            rgb=colours[int(rng.integers(3))],
        ),
    )


def market_stall(rng: np.random.Generator) -> Model:
    """Returns a market stall with goods under a sloping awning."""
    colours = ((0.72, 0.3, 0.25), (0.3, 0.45, 0.62), (0.8, 0.76, 0.6))
    wide = round(float(rng.uniform(0.9, 1.2)), 3)
    scale = (1.0, wide, 1.0)
    return assemble(
        Part("stall", MeshShape("market_stall", scale), rgb=(0.5, 0.38, 0.26)),
        Part(
            "awning",
            MeshShape("market_awning", scale),
            rgb=colours[int(rng.integers(3))],
        ),
    )


PAVILIONS = {
    "bus_shelter": Builder("other-structure", bus_shelter),
    "kiosk": one_mesh("kiosk", _KIOSKS, "other-structure", y=(0.9, 1.25)),
    "advertising_pillar": one_mesh(
        "advertising_pillar", [_PILLAR], z=(0.95, 1.1)
    ),
    "advertising_panel": one_mesh("advertising_panel", [_DARK], z=(0.92, 1.08)),
    "phone_box": one_mesh("phone_box", _PHONE_BOXES),
    "cafe_table": Builder("other-object", cafe_table),
    "market_stall": Builder("other-structure", market_stall),
}
_COLOURS = ((0.7, 0.2, 0.16), (0.2, 0.38, 0.62), (0.78, 0.62, 0.18))
_WOOD = (0.52, 0.38, 0.25)


def basketball_hoop(rng: np.random.Generator) -> Model:
    """Returns a basketball hoop on a post; its board faces +x."""
    height = float(rng.uniform(3.4, 3.7))
    steel = (0.35, 0.37, 0.4)
    return assemble(
        post("post", 0.07, height, rgb=steel),
        block("arm", (0.9, 0.1, 0.1), (0.4, 0, height - 0.3), rgb=steel),
        block("board", (0.05, 1.8, 1.05), (0.85, 0, height), rgb=_COLOURS[0]),
        block("rim", (0.46, 0.46, 0.03), (1.12, 0, height - 0.4)),
    )


PLAYGROUND = {
    "swing": one_mesh("swing", _COLOURS, y=(0.92, 1.12)),
    "slide": one_mesh("slide", _COLOURS, z=(0.9, 1.1)),
    "picnic_table": one_mesh("picnic_table", [_WOOD], y=(0.9, 1.15)),
    "basketball_hoop": Builder("pole", basketball_hoop),
}
