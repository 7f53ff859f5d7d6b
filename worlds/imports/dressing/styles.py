"""The appearance of a building: from its tags, otherwise random."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
import re

from matplotlib.colors import to_rgb
import numpy as np

from evaluation.base import parse_yaml
from worlds.imports.openstreetmap.tags import count
from worlds.shapes import Dice, Finish, triple

_USE_KEYS = (
    "building",
    "building:use",
    "amenity",
    "function",
    "usage",
    "class",
    "building:part",
)
_LOOKS = parse_yaml(Path(__file__).with_name("styles.yaml").read_bytes())
# A house is old if it was built before this year.
_OLD_BEFORE = 1930
# A house is new if it was built in this year or later.
_NEW_FROM = 1965
# Least and greatest storey height that a tag's number of levels may lead to
# [m].
_STOREYS = (2.3, 6.0)
# A building whose use is not tagged is a house if its area is smaller than this
# [m^2].
_LARGE_HOUSE = 260.0
# A building whose use is not tagged is a house only if it is lower than this
# [m].
_HIGH_HOUSE = 9.5
# A building whose use is not tagged is a shed only if it is lower than this
# [m].
_HIGH_SHED = 4.0
# A building whose use is not tagged is an office if it is higher than this [m].
_HIGH_BLOCK = 26.0
# A low building whose use is not tagged is a shed if its area is smaller than
# this [m^2].
_SMALL = 45.0
# Probability that a house is old if its year does not decide.
_OLD_SHARE = 0.6
# Least and greatest factor of the brightness of random walls.
_TINTS = (0.92, 1.06)
# Greatest height of a window, as a share of its storey's height.
_MOST_WINDOW_SHARE = 0.58
# Least width of the wall between two windows [m].
_BETWEEN_WINDOWS = 0.6
# The part of a storey's height beside the window that is below the window.
_SILL_SHARE = 0.62
# The same in storeys at least this high [m].
_HIGH_STOREY = 5.0
_HIGH_SILL_SHARE = 0.4
# Depth of windows [m].
_OLD_RECESS = 0.22
_NEW_RECESS = 0.14
# Factor of the brightness of trim, relative to the wall.
_OLD_TRIM_TINT = 1.16
_NEW_TRIM_TINT = 0.82
# Houses of more than this height may have shops, with this probability.
_LEAST_SHOP_HOUSE = 6.0
_SHOPS_SHARE = 0.4
# Flats with at least this number of storeys may have balconies, with this
# probability.
_BALCONY_STOREYS = 3
_BALCONIES_SHARE = 0.45
# Least height of a plinth, and greatest random addition [m].
_LEAST_PLINTH = 0.3
_MORE_PLINTH = 0.4
# Height of a gutter [m].
_GUTTER = 0.12
# Least height of a cornice, and greatest random addition [m].
_OLD_CORNICE = 0.35
_NEW_CORNICE = 0.18
_MORE_CORNICE = 0.2


@dataclass(frozen=True)
class Style:
    """The style of a building; all lengths are in [m].

    Attributes:
        use: use of the building, such as `flats`.
        storey: height of a storey.
        window_pitch: distance between the centres of neighbouring windows.
        window_width: width of a window.
        window_sill: height of a window's lower edge above the floor.
        window_height: height of a window.
        recess: depth of a window's recess.
        wall, roof, glass, frame, trim, door, sign: finishes of these parts.
        shops: whether the ground floor may have shops on the street.
        balconies: whether every other window may have a balcony.
        plinth: height of the plinth; 0 for none.
        cornice: height of the cornice; 0 for none.
        by_tag: what the tags of the file determine: any of `use`, `levels` (the
            number of storeys), `wall` and `roof`.
    """

    use: str
    storey: float
    window_pitch: float
    window_width: float
    window_sill: float
    window_height: float
    recess: float
    wall: Finish
    roof: Finish
    glass: Finish
    frame: Finish
    trim: Finish
    door: Finish
    sign: Finish
    shops: bool
    balconies: bool
    plinth: float
    cornice: float
    by_tag: frozenset[str]


def building_use(
    tags: Mapping[str, str], area: float, height: float
) -> tuple[str, bool]:
    """Returns the use of a building, and whether the tags state the use.

    Args:
        tags: tags of the building, as in OpenStreetMap.
        area: area of the footprint [m^2]. Area and height determine the use if
            the tags do not state it.
        height: height of the walls [m].
    """
    words = [tags.get(key, "") for key in _USE_KEYS]
    words += [key for key in ("shop", "office") if key in tags]
    tagged = set(re.findall(r"[a-z_]+", " ".join(words).lower()))
    for use, look in _LOOKS["uses"].items():
        if tagged & set(look["words"].split()):
            return use, True
    if area < _SMALL and height < _HIGH_SHED:
        return "shed", False
    if area < _LARGE_HOUSE and height < _HIGH_HOUSE:
        return "house", False
    if height > _HIGH_BLOCK:
        return "office", False
    return "flats", False


def tagged_finish(tags: Mapping[str, str], part: str) -> Finish | None:
    """Returns the finish that tags give to a part; None without such tags.

    A tag for the colour takes precedence over the colour of the material.

    `part` is the beginning of the tags' keys, `building` or `roof`.
    """
    word = tags.get(f"{part}:material", "").strip().lower()
    given = _LOOKS["materials"].get(word)
    finish = None if given is None else Finish.given(given)
    for key in (f"{part}:colour", f"{part}:color"):
        text = tags.get(key, "").strip().lower()
        for name in (text, re.sub(r"[\s_-]", "", text)):
            try:
                rgb = to_rgb(name)
            except ValueError:
                continue
            return Finish(rgb, finish and finish.material)
    return finish


def make_style(
    tags: Mapping[str, str],
    year: int | None,
    area: float,
    height: float,
    is_flat: bool,
    rng: np.random.Generator,
) -> Style:
    """Returns a building's style: as its tags state, and otherwise random.

    Whatever the tags state, the function samples equally many random numbers.

    Args:
        tags: tags of the building, as in OpenStreetMap.
        year: year of construction; None if unknown.
        area: approximate area of the footprint [m^2].
        height: height of the walls [m].
        is_flat: whether the roof is flat.
        rng: random generator for everything that no tag states.
    """
    use, is_tagged = building_use(tags, area, height)
    by_tag = {"use"} if is_tagged else set()
    look = _LOOKS["uses"][use]
    storey, pitch, width, window = (
        float(rng.uniform(*look[size]))
        for size in ("storey", "pitch", "width", "height")
    )
    drawn_wall = _random_finish(rng, *look["walls"].split())
    drawn_roof = _random_finish(rng, "felts" if is_flat else "tiles")
    tint = float(rng.uniform(*_TINTS))
    is_old = float(rng.random()) < _OLD_SHARE
    if year is not None:
        is_old = year < _OLD_BEFORE or (year < _NEW_FROM and is_old)
    shops_draw, balconies_draw, plinth_draw, cornice_draw = rng.random(4)
    is_block = use in ("flats", "office", "retail")
    levels = count(tags.get("building:levels")) if tags else None
    storeys = max(1, round(height / storey))
    if levels and _STOREYS[0] <= height / levels <= _STOREYS[1]:
        storeys = max(1, round(levels))
        by_tag.add("levels")
    storey = max(height / storeys, _STOREYS[0])
    window = min(window, _MOST_WINDOW_SHARE * storey)
    wall, roof = tagged_finish(tags, "building"), tagged_finish(tags, "roof")
    by_tag |= {"wall"} if wall else set()
    by_tag |= {"roof"} if roof else set()
    wall = wall or _tinted(drawn_wall, tint)
    shops = use == "retail" or (
        is_block
        and not is_tagged
        and storey * storeys > _LEAST_SHOP_HOUSE
        and shops_draw < _SHOPS_SHARE
    )
    sill_share = _SILL_SHARE if storey < _HIGH_STOREY else _HIGH_SILL_SHARE
    has_balconies = (
        use == "flats"
        and storeys >= _BALCONY_STOREYS
        and balconies_draw < _BALCONIES_SHARE
    )
    plinth = round(_LEAST_PLINTH + _MORE_PLINTH * plinth_draw, 2)
    return Style(
        use=use,
        storey=storey,
        window_pitch=pitch,
        window_width=round(min(width, pitch - _BETWEEN_WINDOWS), 2),
        window_sill=round((storey - window) * sill_share, 2),
        window_height=round(window, 2),
        recess=_OLD_RECESS if is_old else _NEW_RECESS,
        wall=wall,
        roof=roof or drawn_roof,
        glass=_random_finish(rng, "glass"),
        frame=_random_finish(rng, "frames"),
        trim=_tinted(wall, _OLD_TRIM_TINT if is_old else _NEW_TRIM_TINT),
        door=_random_finish(rng, "doors"),
        sign=_random_finish(rng, "signs"),
        shops=bool(shops),
        balconies=bool(has_balconies),
        plinth=0.0 if use == "shed" else plinth,
        cornice=_cornice(use, is_flat, is_old, float(cornice_draw)),
        by_tag=frozenset(by_tag),
    )


def _cornice(use: str, is_flat: bool, is_old: bool, draw: float) -> float:
    """Returns the height of a building's cornice or gutter [m]; 0 for none.

    `draw` is a random number from 0 to 1.
    """
    if use in ("shed", "industrial"):
        return 0.0
    if not is_flat:
        return _GUTTER
    least = _OLD_CORNICE if is_old else _NEW_CORNICE
    return round(least + _MORE_CORNICE * draw, 2)


def _tinted(finish: Finish, factor: float) -> Finish:
    """Returns a finish that is brighter by a factor."""
    assert finish.rgb is not None
    rgb = np.clip(np.multiply(finish.rgb, factor), 0.0, 1.0).round(3)
    return finish._replace(rgb=triple(rgb))


def _random_finish(rng: np.random.Generator, *palettes: str) -> Finish:
    """Returns a random finish of some palettes."""
    finishes = [
        finish for name in palettes for finish in _LOOKS["palettes"][name]
    ]
    return Finish.given(Dice(rng).pick(finishes))
