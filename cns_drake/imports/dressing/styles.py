"""The appearance of a building: from its tags, otherwise random."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
import re

from matplotlib.colors import to_rgb
import numpy as np

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.city.dice import Dice
from cns_drake.city.geometry import Finish, triple
from cns_drake.imports.openstreetmap.tags import count

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
# A building whose use is not tagged is an office if it is higher than this [m].
_HIGH_BLOCK = 26.0
# A low building whose use is not tagged is a shed if its area is smaller than
# this [m^2].
_SMALL = 45.0


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
    found = set(re.findall(r"[a-z_]+", " ".join(words).lower()))
    for use, look in _LOOKS["uses"].items():
        if found & set(look["words"].split()):
            return use, True
    if area < _SMALL and height < 4.0:
        return "shed", False
    if area < _LARGE_HOUSE and height < _HIGH_HOUSE:
        return "house", False
    if height > _HIGH_BLOCK:
        return "office", False
    return "flats", False


def tagged_finish(tags: Mapping[str, str], part: str) -> Finish | None:
    """Returns the finish that tags give to a part; None without such tags.

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
    tint = float(rng.uniform(0.92, 1.06))
    is_old = float(rng.random()) < 0.6
    if year is not None:
        is_old = year < _OLD_BEFORE or (year < _NEW_FROM and is_old)
    chances = rng.random(4)
    is_block = use in ("flats", "office", "retail")
    levels = count(tags.get("building:levels")) if tags else None
    storeys = max(1, round(height / storey))
    if levels and _STOREYS[0] <= height / levels <= _STOREYS[1]:
        storeys = max(1, round(levels))
        by_tag.add("levels")
    storey = max(height / storeys, _STOREYS[0])
    window = min(window, 0.58 * storey)
    wall, roof = tagged_finish(tags, "building"), tagged_finish(tags, "roof")
    by_tag |= {"wall"} if wall else set()
    by_tag |= {"roof"} if roof else set()
    wall = wall or _tinted(drawn_wall, tint)
    shops = use == "retail" or (
        is_block
        and not is_tagged
        and storey * storeys > 6.0
        and chances[0] < 0.4
    )
    return Style(
        use=use,
        storey=storey,
        window_pitch=pitch,
        window_width=round(min(width, pitch - 0.6), 2),
        window_sill=round(
            (storey - window) * (0.62 if storey < 5.0 else 0.4), 2
        ),
        window_height=round(window, 2),
        recess=0.22 if is_old else 0.14,
        wall=wall,
        roof=roof or drawn_roof,
        glass=_random_finish(rng, "glass"),
        frame=_random_finish(rng, "frames"),
        trim=_tinted(wall, 1.16 if is_old else 0.82),
        door=_random_finish(rng, "doors"),
        sign=_random_finish(rng, "signs"),
        shops=bool(shops),
        balconies=bool(use == "flats" and storeys >= 3 and chances[1] < 0.45),
        plinth=0.0 if use == "shed" else round(0.3 + 0.4 * chances[2], 2),
        cornice=_cornice(use, is_flat, is_old, float(chances[3])),
        by_tag=frozenset(by_tag),
    )


def _cornice(use: str, is_flat: bool, is_old: bool, chance: float) -> float:
    if use in ("shed", "industrial"):
        return 0.0
    if not is_flat:
        return 0.12  # That is a gutter.
    return round((0.35 if is_old else 0.18) + 0.2 * chance, 2)


def _tinted(finish: Finish, factor: float) -> Finish:
    assert finish.rgb is not None
    rgb = np.clip(np.multiply(finish.rgb, factor), 0.0, 1.0).round(3)
    return finish._replace(rgb=triple(rgb))


def _random_finish(rng: np.random.Generator, *palettes: str) -> Finish:
    """Returns a random finish of some palettes."""
    found = [one for name in palettes for one in _LOOKS["palettes"][name]]
    return Finish.given(Dice(rng).pick(found))
