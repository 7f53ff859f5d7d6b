"""No tag, attribute or member of what an import builds is dropped in silence.

For each of the most used keys on each element that is built: the triangles
change, or the counts name the key, or the report says that the key is read or
changes no shape.
"""

import json
from pathlib import Path
import re
from xml.etree import ElementTree

from helpers.imported_cities import import_osm, read_city, volume
from helpers.small_cityjson import CityWriter, house
from helpers.small_opendrive import straight, write_roads
from helpers.small_osm import OsmWriter
import numpy as np
import pytest

from evaluation.base import parse_yaml
from worlds import imports
from worlds.imports import ImportOptions, import_city

# The most used keys on ways and nodes that can describe a thing, by taginfo,
# with a usual value.
KEYS = {
    "source": "survey", "name": "A", "surface": "asphalt", "access": "private",
    "height": "7", "width": "3", "min_height": "1", "oneway": "yes",
    "lanes": "3", "maxspeed": "30", "service": "alley", "layer": "1",
    "bridge": "yes", "tunnel": "yes", "roof:shape": "pyramidal",
    "operator": "B", "start_date": "1900", "end_date": "2100", "foot": "yes",
    "bicycle": "no", "lit": "yes", "sidewalk": "both", "tracktype": "grade2",
    "building:levels": "5", "roof:levels": "2", "roof:height": "2",
    "roof:material": "metal", "roof:colour": "red", "building:material": "wood",
    "building:colour": "red", "roof:orientation": "across",
    "roof:direction": "90", "roof:angle": "30", "building:min_level": "1",
    "material": "wood", "fence_type": "chain_link", "diameter_crown": "9",
    "circumference": "2", "leaf_type": "needleleaved",
    "leaf_cycle": "deciduous",
    "species": "Tilia", "genus": "Tilia", "denotation": "avenue", "level": "1",
    "location": "roof", "covered": "yes", "area": "yes", "incline": "10%",
    "direction": "90", "crossing": "zebra", "cycleway": "track",
    "parking:both": "lane", "placement": "right_of:1", "turn:lanes": "left|",
    "junction": "roundabout", "maxheight": "3", "smoothness": "good",
    "wheelchair": "yes", "sport": "soccer", "wall": "no", "est_height": "8",
    "diameter": "4", "kerb": "raised", "step_count": "9", "depth": "2",
}  # fmt: skip
PLACES = [(0, 0), (90, 0), (180, 0), (0, 90), (90, 90), (180, 90), (0, 180)]


def write_elements(path, more):
    """Writes one element of each kind; returns their ids."""
    osm = OsmWriter()
    osm.box(-80, -80, 9, 9, building="yes", height="9")

    def box(place, **tags):
        return osm.box(*place, 12, 8, **(tags | more))

    def way(place, **tags):
        x, y = place
        return osm.way([(x, y), (x + 30, y)], **(tags | more))

    ids = [
        f"w{box(PLACES[0], building='house', height='6')}",
        f"w{way(PLACES[1], highway='residential')}",
        f"w{way(PLACES[2], highway='footway')}",
        f"w{box(PLACES[3], landuse='grass')}",
        f"w{way(PLACES[4], barrier='hedge')}",
        f"n{osm.node(*PLACES[5], **({'natural': 'tree'} | more))}",
        f"w{way(PLACES[6], barrier='wall')}",
    ]
    osm.write(path)
    return ids


def triangles_by_element(path, dressed=False):
    city = read_city(path, dressed=dressed)
    found = {}
    for one in city.objects:
        found.setdefault(one.structure.name.split("_")[1], []).append(
            one.triangles
        )
    return city, {name: np.concatenate(parts) for name, parts in found.items()}


@pytest.mark.parametrize("key", KEYS)
def test_each_key_changes_the_triangles_or_is_accounted_for(tmp_path, key):
    path = tmp_path / "a.osm"
    ids = write_elements(path, {})
    _, plain = triangles_by_element(path)
    assert set(ids) <= set(plain)
    write_elements(path, {key: KEYS[key]})
    city, tagged = triangles_by_element(path)
    words = {
        word
        for line in city.faults.parts()
        for word in line.split(": ")[-1].split()
    }
    told = " ".join(fault.kind for fault in city.faults.rows())
    for name in ids:
        is_same = name in tagged and np.array_equal(plain[name], tagged[name])
        if is_same:
            assert key in words or f"tag {key} of" in told, (name, key)
        elif name not in tagged:
            assert "left out" in told, (name, key)


NO_SIZES = ["0", "-1", "zzz", "1e9"]


@pytest.mark.parametrize("value", NO_SIZES)
@pytest.mark.parametrize(
    ("key", "elements"),
    [
        ("width", {"highway": "residential"}),
        ("width", {"highway": "footway"}),
        ("width", {"barrier": "hedge"}),
        ("height", {"barrier": "wall"}),
        ("lanes", {"highway": "residential"}),
    ],
)
def test_sizes_that_cannot_be_are_counted_on_each_element(
    tmp_path, key, elements, value
):
    osm = OsmWriter()
    osm.box(-80, -80, 9, 9, building="yes", height="9")
    osm.way([(0, 0), (30, 0)], **(elements | {key: value}))
    city, _ = import_osm(osm.write(tmp_path / "a.osm"))
    told = {fault.kind: fault.number for fault in city.faults.rows()}
    assert told[f"{key} unreadable or implausible, the usual one taken"] == 1


def write_dressed(path, more):
    """Writes the elements of a dressed city; returns what to look for."""
    osm = OsmWriter()
    osm.box(-80, -80, 9, 9, building="yes", height="9")
    zebra = osm.node(
        15, 0, **({"highway": "crossing", "crossing": "zebra"} | more)
    )
    street = [osm.node(0, 0), zebra, osm.node(30, 0)]
    osm.way_of(street, highway="residential")
    row = {"natural": "tree_row"} | more
    bench = {"amenity": "bench"} | more
    coast = {"natural": "coastline"} | more
    former = {"was:building": "yes"} | more
    osm.way([(0, 40), (40, 40)], **row)
    osm.node(60, 60, **bench)
    osm.way([(-200, -120), (200, -120)], **coast)
    osm.box(120, 0, 9, 9, **former)
    osm.write(path)


@pytest.mark.parametrize("key", KEYS)
def test_each_key_is_accounted_for_in_a_dressed_city(tmp_path, key):
    path = tmp_path / "a.osm"
    write_dressed(path, {key: KEYS[key]})
    city = read_city(path, dressed=True)
    told = [fault.kind for fault in city.faults.rows()]
    lines = [line.split(": ", 2) for line in city.faults.parts()]
    for element in ("tree row", "small object", "coastline", "building",
                    "crossing"):  # fmt: skip
        words = {
            word
            for one, _, names in lines
            if one == element
            for word in names.split()
        }
        is_counted = f"tag {key} of {element}, not read" in told
        assert key in words or is_counted, element


def test_trees_of_a_row_have_its_height(tmp_path):
    path = tmp_path / "a.osm"
    for height in (None, "17.5"):
        write_dressed(path, {"height": height} if height else {})
        trees = [
            one
            for one in read_city(path, dressed=True).small_objects
            if one.element == "natural=tree_row"
        ]
        expected = None if height is None else float(height)
        assert {one.height for one in trees} == {expected}


def test_barriers_are_as_thick_and_high_as_their_tags_say(tmp_path):
    osm = OsmWriter()
    osm.box(-50, -50, 9, 9, building="yes")
    wall = osm.way([(0, 0), (20, 0)], barrier="wall", width="2", height="5",
                   min_height="2")  # fmt: skip
    filled = osm.box(0, 20, 10, 6, barrier="hedge", area="yes", height="2")
    ring = osm.box(0, 40, 10, 6, barrier="hedge", height="2")
    _, found = import_osm(osm.write(tmp_path / "a.osm"))
    corners = found[f"wall_w{wall}"].triangles.reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [20, 2, 3], atol=0.02)

    def covered(one):
        a, b, c = np.moveaxis(one.triangles[..., :2], 1, 0)
        z = one.triangles[..., 2].min(axis=1)
        area = np.abs(np.linalg.det(np.stack([b - a, c - a], axis=1))) / 2
        return area[z == one.triangles[..., 2].max()].sum()

    assert covered(found[f"hedge_w{filled}"]) == pytest.approx(60, rel=0.01)
    assert covered(found[f"hedge_w{ring}"]) == pytest.approx(25.6, rel=0.1)


def test_a_canopy_within_a_building_is_open_below(tmp_path):
    osm = OsmWriter()
    whole = osm.box(0, 0, 20, 20, building="yes", height="10")
    osm.box(0, 0, 20, 5, building__part="roof", height="4")
    _, found = import_osm(osm.write(tmp_path / "a.osm"))
    one = found[f"building_w{whole}"]
    expected = 20.0 * 15.0 * 10.0 + 20.0 * 5.0 * 0.5
    assert volume(one.triangles) == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(
    ("date", "buildings"),
    [("1960", 2), ("1900-05", 1), ("1960?", 1), (None, 1)],
)
def test_parts_of_another_year_are_buildings(tmp_path, date, buildings):
    osm = OsmWriter()
    osm.box(0, 0, 20, 20, building="church", start_date="1900", height="10")
    own = {"start_date": date} if date else {}
    osm.box(0, 0, 5, 20, building__part="yes", height="40", **own)
    city, found = import_osm(osm.write(tmp_path / "a.osm"))
    years = sorted(one.year for one in found.values())
    assert years == [1900, 1960][:buildings]
    kinds = {fault.kind for fault in city.faults.rows()}
    is_unclear = date == "1960?"
    assert ("date in start_date that is not understood" in kinds) == is_unclear


def test_a_demolished_house_of_cityjson_has_an_end(tmp_path):
    path = tmp_path / "a.json"
    dates = {"yearOfConstruction": 1900, "yearOfDemolition": "1950-05-01"}
    path.write_text(json.dumps(house(dates)))
    (one,) = read_city(path).objects
    assert (one.year, one.until) == (1900, 1950)


@pytest.mark.parametrize(
    ("semantics", "count"),
    [
        ({"surfaces": [{"type": "RoofSurface"}], "values": [[0, 1, -1, None,
          True, "0"]]}, ("semantics of a face that are not there", 4)),
        ({"surfaces": [{"type": "RoofSurface"}], "values": [None]}, None),
        ({"surfaces": [{"type": "RoofSurface"}], "values": None}, None),
        ({"surfaces": [{"type": "RoofSurface"}], "values": [[0, 0]]},
         ("semantics that do not fit their faces, ignored", 1)),
        ({"surfaces": [{"type": "RoofSurface"}], "values": [0] * 6},
         ("semantics that do not fit their faces, ignored", 1)),
        ({"values": [[0] * 6]},
         ("semantics that do not fit their faces, ignored", 1)),
        ({"surfaces": ["RoofSurface"], "values": [[0] * 6]},
         ("semantics that do not fit their faces, ignored", 1)),
        (None, None),
    ],
)  # fmt: skip
def test_semantics_of_cityjson_that_do_not_fit_are_counted(
    tmp_path, semantics, count
):
    document = house({})
    geometry = document["CityObjects"]["a"]["geometry"][0]
    geometry["semantics"] = semantics
    path = tmp_path / "a.json"
    path.write_text(json.dumps(document))
    city = read_city(path)
    (one,) = city.objects
    assert len(one.triangles) == 12
    told = {
        fault.kind: fault.number
        for fault in city.faults.rows()
        if "semantics" in fault.kind
    }
    assert told == ({} if count is None else dict([count]))


ELEMENTS = {
    "building": [
        {"building": "yes"}, {"building": "house"}, {"building:part": "yes"},
        {"building": "roof"}, {"man_made": "tower"},
        {"building": "yes", "min_height": "4", "height": "9",
         "roof:shape": "hipped"},
    ],
    "street": [
        {"highway": "residential"}, {"highway": "primary"},
        {"highway": "service"},
        {"highway": "tertiary", "width": "7.33", "oneway": "yes",
         "sidewalk": "left", "parking:both": "lane", "bridge": "yes"},
    ],
    "path": [
        {"highway": "footway"}, {"highway": "steps"},
        {"highway": "cycleway", "width": "3", "covered": "yes"},
    ],
    "ground": [
        {"landuse": "grass"}, {"natural": "water"}, {"amenity": "parking"},
        {"leisure": "pitch"},
        {"amenity": "parking", "parking": "surface", "surface": "asphalt"},
    ],
    "barrier": [
        {"barrier": "hedge"},
        {"barrier": "wall", "height": "3", "min_height": "1", "width": "1"},
    ],
    "tree": [{"natural": "tree", "height": "9"}],
    "tree row": [{"natural": "tree_row"}],
    "small object": [{"highway": "street_lamp"}, {"amenity": "bench"}],
}  # fmt: skip
VALUES = ("yes", "2", "underground")
TABLE, CITYJSON, OPENDRIVE = (
    parse_yaml(
        (Path(imports.__file__).with_name(name) / "parts.yaml").read_bytes()
    )
    for name in ("openstreetmap", "cityjson", "opendrive")
)


def shapes(city):
    """Returns the id of an element -> kinds, sizes and heights of its parts."""
    found = {}
    for one in city.objects:
        p = one.triangles.reshape(-1, 3)
        sizes = [*np.ptp(p[:, :2], axis=0), p[:, 2].min(), p[:, 2].max()]
        (number,) = re.findall(r"_[nw](\d+)", one.structure.name)
        found.setdefault(int(number), []).append(
            (
                one.object_type,
                one.structure.semantic_class,
                one.base,
                len(p),
                [round(float(size), 1) for size in sizes],
            )
        )
    for one in city.small_objects:
        own = found.setdefault(int(one.source[1:]), [])
        own.append((one.kind, one.yaw, one.height))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("dressed", [False, True])
@pytest.mark.parametrize("element", ELEMENTS)
def test_tags_that_change_no_shape_change_none(tmp_path, element, dressed):
    """Each with three values, on things with and without what goes with it."""
    lists = TABLE["elements"][element]["shapeless"] + TABLE["shapeless"]
    keys = sorted({key.replace("*", "x") for key in " ".join(lists).split()})
    for number, own in enumerate(ELEMENTS[element]):
        osm = OsmWriter()
        ids = {}
        changes = [{}, *({key: v} for key in keys for v in VALUES)]
        for k, change in enumerate(changes):
            x, y = 40 * (k % 40), 40 * (k // 40)
            tags = {
                key.replace(":", "__"): v for key, v in (change | own).items()
            }
            if element in ("building", "ground"):
                ids[osm.box(x, y, 12, 8, **tags)] = change
            elif element in ("tree", "small object"):
                ids[osm.node(x, y, **tags)] = change
            else:
                ids[osm.way([(x, y), (x + 25, y)], **tags)] = change
        osm.box(-60, -60, 9, 9, building="yes", height="9")
        city = read_city(osm.write(tmp_path / f"{number}.osm"), dressed=dressed)
        found = shapes(city)
        first, *others = ids
        assert found.get(first) or (element == "tree row" and not dressed)
        changed = [ids[k] for k in others if found.get(k) != found.get(first)]
        assert changed == []


@pytest.mark.parametrize("value", VALUES)
def test_attributes_of_cityjson_that_change_no_shape_change_none(
    tmp_path, value
):
    names = CITYJSON["elements"]["attributes"]["shapeless"]
    city = CityWriter()
    for k, name in enumerate(["", *" ".join(names).replace("*", "x").split()]):
        tags = {name: value} if name else {}
        city.box(f"house_{k}", 20 * k, 0, (9, 8, 7), attributes=tags)
    read = read_city(city.write(tmp_path / "a.city.json"))
    assert len({str(np.ptp(one.triangles, 1)) for one in read.objects}) == 1
    assert len({(one.base, one.year, one.lod) for one in read.objects}) == 1


@pytest.mark.parametrize("value", ["1", "-2.5", "yes"])
def test_attributes_of_opendrive_that_change_no_shape_change_none(
    tmp_path, value
):
    elements = OPENDRIVE["elements"]
    things = (
        '<objects><object id="1" type="pole" s="30" t="9" height="3"'
        ' radius="1"/><bridge id="2" s="60" length="20"/><tunnel id="3"'
        ' s="90" length="9"/></objects><signals><signal id="4" s="20" t="9"'
        ' type="274"/></signals>'
    )
    path = write_roads(
        tmp_path / "a.xodr", straight("r", 0, 0, 110, 0, more=things)
    )
    found = []
    for _ in range(2):
        city = tmp_path / str(len(found))
        import_city(path, city, ImportOptions(dressed=False))
        names = sorted((city / "meshes").iterdir())
        found.append([(one.name, one.read_bytes()) for one in names])
        tree = ElementTree.parse(path)
        for one in tree.iter():
            own = elements.get(one.tag, {}).get("shapeless", ())
            for name in set(" ".join(own).split()) - {"id"}:
                one.set(name, value)
        tree.write(path)
    assert found[0] == found[1]
