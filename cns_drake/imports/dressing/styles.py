"""The look of a building: from its tags, or else at random."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
import re

from matplotlib.colors import to_rgb
import numpy as np

from cns_drake.city.facades.assembly import Rgb, pick
from cns_drake.imports.openstreetmap.tags import count


class Use(Enum):
    """The use of a building."""

    HOUSE = "house"
    FLATS = "flats"
    OFFICE = "office"
    RETAIL = "retail"
    PUBLIC = "public"
    INDUSTRIAL = "industrial"
    CHURCH = "church"
    SHED = "shed"


# Words of tags and attributes -> use, the more specific first.
_USES = (
    (Use.CHURCH, "church cathedral chapel mosque synagogue temple worship"),
    (Use.SHED, "garage garages carport shed hut roof service barn cabin"),
    (Use.RETAIL, "retail supermarket kiosk shop mall store restaurant cafe"),
    (Use.OFFICE, "office commercial government bank"),
    (Use.INDUSTRIAL, "industrial warehouse hangar manufacture factory"),
    (
        Use.PUBLIC,
        "public civic school university college hospital kindergarten museum"
        " theatre train_station library townhall hotel",
    ),
    (Use.FLATS, "apartments residential dormitory flats woonfunctie"),
    (
        Use.HOUSE,
        "house detached semidetached_house terrace bungalow villa farm",
    ),
)
_USE_KEYS = (
    "building",
    "building:use",
    "amenity",
    "function",
    "usage",
    "class",
    "building:part",
)
_BRICK: Rgb = (0.58, 0.33, 0.25)
_PLASTER: tuple[Rgb, ...] = (
    (0.86, 0.80, 0.66),
    (0.80, 0.70, 0.55),
    (0.88, 0.85, 0.78),
    (0.78, 0.62, 0.50),
    (0.72, 0.73, 0.70),
    (0.84, 0.74, 0.58),
    (0.66, 0.70, 0.72),
    (0.90, 0.87, 0.74),
)
_BRICKS: tuple[Rgb, ...] = (
    _BRICK,
    (0.50, 0.28, 0.22),
    (0.66, 0.44, 0.33),
    (0.70, 0.55, 0.42),
    (0.44, 0.33, 0.29),
)
_GREYS: tuple[Rgb, ...] = (
    (0.62, 0.63, 0.64),
    (0.74, 0.73, 0.70),
    (0.52, 0.54, 0.57),
    (0.80, 0.79, 0.77),
)
_STONES: tuple[Rgb, ...] = (
    (0.72, 0.66, 0.56),
    (0.64, 0.58, 0.50),
    (0.78, 0.73, 0.65),
)
_WALLS = {
    Use.HOUSE: _BRICKS + _PLASTER,
    Use.FLATS: _PLASTER + _BRICKS,
    Use.OFFICE: _GREYS + _STONES,
    Use.RETAIL: _PLASTER + _GREYS,
    Use.PUBLIC: _STONES + _BRICKS,
    Use.INDUSTRIAL: _GREYS,
    Use.CHURCH: _STONES + _BRICKS[:2],
    Use.SHED: _GREYS + _BRICKS[:2],
}
_TILES: tuple[Rgb, ...] = (
    (0.55, 0.30, 0.24),
    (0.47, 0.26, 0.21),
    (0.61, 0.37, 0.27),
    (0.35, 0.33, 0.33),
    (0.42, 0.32, 0.28),
)
_FELTS: tuple[Rgb, ...] = (
    (0.42, 0.42, 0.43),
    (0.53, 0.52, 0.50),
    (0.35, 0.36, 0.38),
    (0.60, 0.58, 0.55),
)
_DOORS: tuple[Rgb, ...] = (
    (0.28, 0.20, 0.15),
    (0.16, 0.26, 0.22),
    (0.22, 0.25, 0.32),
    (0.45, 0.30, 0.18),
    (0.40, 0.14, 0.13),
)
_SIGNS: tuple[Rgb, ...] = (
    (0.55, 0.15, 0.14),
    (0.16, 0.30, 0.24),
    (0.18, 0.24, 0.42),
    (0.75, 0.60, 0.20),
    (0.25, 0.25, 0.27),
)
_GLASS: tuple[Rgb, ...] = ((0.20, 0.26, 0.31), (0.24, 0.30, 0.34))
_FRAMES: tuple[Rgb, ...] = (
    (0.90, 0.90, 0.88),
    (0.88, 0.87, 0.82),
    (0.34, 0.27, 0.21),
    (0.30, 0.32, 0.34),
)
_MATERIALS: Mapping[str, Rgb] = {
    "brick": _BRICK,
    "concrete": (0.66, 0.66, 0.64),
    "glass": (0.45, 0.55, 0.62),
    "metal": (0.62, 0.64, 0.66),
    "plaster": (0.86, 0.80, 0.66),
    "stone": (0.70, 0.65, 0.56),
    "sandstone": (0.76, 0.66, 0.50),
    "wood": (0.52, 0.38, 0.26),
    "timber_framing": (0.80, 0.74, 0.64),
    "roof_tiles": (0.55, 0.30, 0.24),
    "slate": (0.34, 0.36, 0.39),
    "copper": (0.40, 0.58, 0.50),
    "tar_paper": (0.30, 0.30, 0.31),
    "grass": (0.38, 0.50, 0.28),
    "thatch": (0.55, 0.46, 0.32),
}
# A house is old if built before the first year, and new if after the second.
_OLD, _NEW = 1930, 1965
# Range of storey heights that a tag's levels may lead to [m].
_STOREYS = (2.3, 6.0)
_LARGE_HOUSE, _HIGH_HOUSE = 260.0, 9.5  # [m^2], [m]
_HIGH_BLOCK = 26.0  # [m]
_SMALL = 45.0  # [m^2]


@dataclass(frozen=True)
class Style:
    """How a building is dressed; lengths in metres.

    Attributes:
        use: the use of the building.
        storey: height of a storey.
        pitch: distance of windows from middle to middle.
        width, sill, height: of a window; its sill from the floor.
        depth: of its recess.
        wall, roof, glass, frame, trim, door, sign: colours.
        shops: whether the ground floor has shops on the street.
        balconies: whether every other window has a balcony.
        plinth: its height; 0 for none.
        cornice: its height; 0 for none.
        by_tag: the fields that come from the file.
    """

    use: Use
    storey: float
    pitch: float
    width: float
    sill: float
    height: float
    depth: float
    wall: Rgb
    roof: Rgb
    glass: Rgb
    frame: Rgb
    trim: Rgb
    door: Rgb
    sign: Rgb
    shops: bool
    balconies: bool
    plinth: float
    cornice: float
    by_tag: frozenset[str]


# Use -> storey, pitch, width and height of windows, least and greatest [m].
_SIZES = {
    Use.HOUSE: ((2.7, 3.0), (2.6, 3.4), (1.0, 1.4), (1.2, 1.5)),
    Use.FLATS: ((2.9, 3.3), (2.3, 3.0), (1.0, 1.4), (1.4, 1.8)),
    Use.OFFICE: ((3.3, 3.8), (2.2, 3.0), (1.4, 2.1), (1.6, 2.0)),
    Use.RETAIL: ((3.2, 3.8), (2.6, 3.4), (1.3, 2.0), (1.4, 1.8)),
    Use.PUBLIC: ((3.4, 4.0), (2.8, 3.6), (1.3, 1.8), (1.8, 2.2)),
    Use.INDUSTRIAL: ((4.0, 5.0), (4.0, 6.0), (2.0, 3.4), (1.0, 1.4)),
    Use.CHURCH: ((7.0, 9.0), (3.6, 4.6), (1.1, 1.5), (3.4, 4.6)),
    Use.SHED: ((2.6, 2.8), (3.4, 4.4), (0.8, 1.0), (0.7, 0.9)),
}


def building_use(
    tags: Mapping[str, str], area: float, height: float
) -> tuple[Use, bool]:
    """Returns the use of a building, and whether it comes from its tags.

    Args:
        tags: of the building, or attributes.
        area: of its footprint, about [m^2].
        height: of its walls [m].
    """
    words = [tags.get(key, "") for key in _USE_KEYS]
    if "shop" in tags:
        words.append("shop")
    if "office" in tags:
        words.append("office")
    found = set(re.findall(r"[a-z_]+", " ".join(words).lower()))
    for use, names in _USES:
        if found & set(names.split()):
            return use, True
    if area < _SMALL and height < 4.0:
        return Use.SHED, False
    if area < _LARGE_HOUSE and height < _HIGH_HOUSE:
        return Use.HOUSE, False
    if height > _HIGH_BLOCK:
        return Use.OFFICE, False
    return Use.FLATS, False


def tagged_colour(tags: Mapping[str, str], part: str) -> Rgb | None:
    """Returns the colour that a tag gives a part, such as `building`."""
    for key in (f"{part}:colour", f"{part}:color"):
        text = tags.get(key, "").strip().lower()
        for name in (text, re.sub(r"[\s_-]", "", text)):
            try:
                red, green, blue = to_rgb(name)
            except ValueError:
                continue
            return red, green, blue
    material = tags.get(f"{part}:material", "").strip().lower()
    return _MATERIALS.get(material)


def make_style(
    tags: Mapping[str, str],
    year: int | None,
    area: float,
    height: float,
    is_flat: bool,
    rng: np.random.Generator,
) -> Style:
    """Draws the style of a building; its tags take precedence.

    Args:
        tags: of the building, or attributes; they win.
        year: in which it was built, if known.
        area: of its footprint, about [m^2].
        height: of its walls [m].
        is_flat: whether its roof is.
        rng: of the building; the number of draws does not depend on the tags.
    """
    use, is_tagged = building_use(tags, area, height)
    by_tag = {"use"} if is_tagged else set()
    storeys, pitches, widths, tall = _SIZES[use]
    storey, pitch, width, window = (
        float(rng.uniform(*limits))
        for limits in (storeys, pitches, widths, tall)
    )
    drawn_wall = pick(rng, _WALLS[use])
    drawn_roof = pick(rng, _FELTS if is_flat else _TILES)
    tint = float(rng.uniform(0.92, 1.06))
    is_old = float(rng.random()) < 0.6
    if year is not None:
        is_old = year < _OLD or (year < _NEW and is_old)
    chances = rng.random(4)
    is_block = use in (Use.FLATS, Use.OFFICE, Use.RETAIL)
    levels = count(tags.get("building:levels")) if tags else None
    numbered = max(1, round(height / storey))
    if levels and _STOREYS[0] <= height / levels <= _STOREYS[1]:
        numbered = max(1, round(levels))
        by_tag.add("levels")
    storey = max(height / numbered, _STOREYS[0])
    window = min(window, 0.58 * storey)
    wall, roof = tagged_colour(tags, "building"), tagged_colour(tags, "roof")
    by_tag |= {"wall"} if wall else set()
    by_tag |= {"roof"} if roof else set()
    wall = wall or _tinted(drawn_wall, tint)
    shops = use is Use.RETAIL or (
        is_block
        and not is_tagged
        and storey * numbered > 6.0
        and chances[0] < 0.4
    )
    return Style(
        use=use,
        storey=storey,
        pitch=pitch,
        width=round(min(width, pitch - 0.6), 2),
        sill=round((storey - window) * (0.62 if storey < 5.0 else 0.4), 2),
        height=round(window, 2),
        depth=0.22 if is_old else 0.14,
        wall=wall,
        roof=roof or drawn_roof,
        glass=pick(rng, _GLASS),
        frame=pick(rng, _FRAMES),
        trim=_tinted(wall, 1.16 if is_old else 0.82),
        door=pick(rng, _DOORS),
        sign=pick(rng, _SIGNS),
        shops=bool(shops),
        balconies=bool(
            use is Use.FLATS and numbered >= 3 and chances[1] < 0.45
        ),
        plinth=0.0 if use is Use.SHED else round(0.3 + 0.4 * chances[2], 2),
        cornice=_cornice(use, is_flat, is_old, float(chances[3])),
        by_tag=frozenset(by_tag),
    )


def _cornice(use: Use, is_flat: bool, is_old: bool, chance: float) -> float:
    if use in (Use.SHED, Use.INDUSTRIAL):
        return 0.0
    if not is_flat:
        return 0.12  # It is a gutter.
    return round((0.35 if is_old else 0.18) + 0.2 * chance, 2)


def _tinted(rgb: Rgb, factor: float) -> Rgb:
    red, green, blue = np.clip(np.multiply(rgb, factor), 0.0, 1.0).round(3)
    return float(red), float(green), float(blue)
