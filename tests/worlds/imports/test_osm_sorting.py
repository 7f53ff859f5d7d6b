"""OpenStreetMap files in any order, with changed and deleted objects."""

import re

from helpers.imported_cities import bounds, import_osm, volume
from helpers.small_osm import OsmWriter
import pytest


@pytest.mark.parametrize("number", ["-7", "7"])
def test_new_things_of_editors_have_negative_numbers(tmp_path, number):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    tree = osm.node(20, 20, natural="tree")
    path = osm.write(tmp_path / "city.osm")
    text = path.read_text().replace(
        f'<node id="{tree}"', f'<node id="{number}"'
    )
    path.write_text(text)
    _, found = import_osm(path)
    assert f"tree_n{number}" in found


def shuffled(path, order, change=lambda row: row):
    """Rewrites a file with its rows changed, kinds of things in an order."""
    rows = path.read_text().splitlines()[1:-1]
    rows = [change(row) for row in rows]
    kinds = ("<node", "<way", "<relation")
    rows.sort(key=lambda r: order.index(kinds.index(r.split(maxsplit=1)[0])))
    path.write_text('<osm version="0.6">\n' + "\n".join(rows) + "\n</osm>\n")
    return path


def negated(row):
    """Numbers as editors give them to new things: -1, -2, and so on."""
    row = re.sub(r'(<\w+ id=")', r"\1-", row)
    return re.sub(r'ref="(\d+)"', r'ref="-\1"', row)


def reversed_numbers(row):
    return re.sub(
        r'(id|ref)="(\d+)"', lambda m: f'{m[1]}="{1000 - int(m[2])}"', row
    )


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (2, 0, 1)])
@pytest.mark.parametrize("change", [str, negated, reversed_numbers])
def test_no_order_of_things_matters(tmp_path, order, change):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes", height="7")
    hole = osm.box(34, 4, 2, 2)
    outer = osm.box(30, 0, 10, 10)
    osm.relation(
        {"outer": [outer], "inner": [hole]},
        type="multipolygon", building="yes", height="5",
    )  # fmt: skip
    osm.way([(0, 30), (60, 30)], highway="residential")
    osm.node(5, 40, natural="tree")
    path = shuffled(osm.write(tmp_path / "a.osm"), order, change)
    city, found = import_osm(path)
    sizes = sorted(
        round(volume(one.triangles))
        for name, one in found.items()
        if name.startswith("building")
    )
    assert sizes == [480, 700]
    assert len(city.streets) == 1
    assert [name for name in found if "tree" in name]
    assert city.faults.rows() == []
    for name in found:
        assert re.search(r"-?\d+$", name) is None or "1000000" not in name
        if name.startswith(("building", "tree")):
            assert ("-" in name) == (change is negated)


def test_places_that_only_ways_have(tmp_path):
    """As Overpass writes geometries."""
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes", height="7")
    osm.box(30, 0, 10, 10, building="yes", height="7")
    path = osm.write(tmp_path / "a.osm")
    text = path.read_text()
    for number, place in re.findall(
        r'<node id="(\d+)" version="1"(.*?)>', text
    ):
        text = text.replace(f'ref="{number}"', f'ref="{number}"{place}')
    path.write_text(re.sub(r"<node.*\n", "", text))
    _, found = import_osm(path)
    assert [round(volume(one.triangles)) for one in found.values()] == [700] * 2


@pytest.mark.parametrize(
    ("more", "height", "fault"),
    [
        # Overpass writes things again, without tags.
        ('<way id="{w}" version="1">{refs}</way>', 7.0, "twice"),
        ('<way id="{w}" version="2">{refs}{tags}</way>', 12.0, "twice"),
        ('<way id="{w}" version="0">{refs}{tags}</way>', 7.0, "twice"),
        # A version that deletes the way.
        ('<way id="{w}" version="2" visible="false"/>', None, "deleted"),
    ],
)
def test_things_that_are_there_twice(tmp_path, more, height, fault):
    osm = OsmWriter()
    osm.box(30, 0, 10, 10, building="yes", height="9")
    way = osm.box(0, 0, 10, 10, building="yes", height="7")
    path = osm.write(tmp_path / "a.osm")
    refs = re.search(
        rf'<way id="{way}" version="1">(.*?)<tag', path.read_text()
    )
    tags = '<tag k="building" v="yes"/><tag k="height" v="12"/>'
    more = more.format(w=way, refs=refs[1], tags=tags)
    path.write_text(path.read_text().replace("</osm>", more + "</osm>"))
    city, found = import_osm(path)
    one = found.get(f"building_w{way}")
    assert (one is None) == (height is None)
    if one is not None:
        assert bounds(one)[1][2] == height
    assert len(found) == (1 if height is None else 2)
    assert any(fault in kind for kind, _, _ in city.faults.rows())


@pytest.mark.parametrize(
    "mark", ['visible="false"', 'action="delete"', "action='delete'"]
)
def test_deleted_things_are_not_built(tmp_path, mark):
    osm = OsmWriter()
    osm.box(30, 0, 10, 10, building="yes", height="9")
    way = osm.box(0, 0, 10, 10, building="yes", height="7")
    tree = osm.node(5, 40, natural="tree")
    path = osm.write(tmp_path / "a.osm")
    text = path.read_text()
    for one in (f'<way id="{way}"', f'<node id="{tree}"'):
        text = text.replace(one, f"{one} {mark}")
    path.write_text(text)
    city, found = import_osm(path)
    assert len(found) == 1
    assert city.faults.rows() == [
        ("deleted thing, left out", 2, f"n{tree}"),
    ]


def test_a_remark_of_overpass_is_named(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    path = osm.write(tmp_path / "a.osm")
    remark = "<remark> runtime error: Query timed out </remark></osm>"
    path.write_text(path.read_text().replace("</osm>", remark))
    city, _ = import_osm(path)
    kind = "the file may be cut off: runtime error: Query timed out"
    assert city.faults.rows() == [(kind, 1, "the file")]
