"""Walls of the file get details from tags and at random."""

import csv
from dataclasses import replace
import hashlib
import re

from helpers.small_cityjson import CityWriter
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
from shapely.geometry import LineString, Polygon
from typer.testing import CliRunner
import yaml

from cns_drake.city import Assembly, Finish, Site, UpperSides, part_triangles
from cns_drake.command_line import app
from cns_drake.imports import (
    ImportOptions,
    import_cityjson,
    import_openstreetmap,
)
from cns_drake.imports.dressing.dressed_buildings import dress_buildings
from cns_drake.imports.dressing.facade_pieces import add_facade
from cns_drake.imports.dressing.facade_plan import plan_facade, with_doors
from cns_drake.imports.dressing.styles import (
    building_use,
    make_style,
    tagged_finish,
)
from cns_drake.imports.dressing.wall_panels import find_panels, is_upright
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.ground import ground_of
from cns_drake.imports.grown_city import grow
from cns_drake.imports.solids import extruded
from cns_drake.imports.staged_city import stage_city
from cns_drake.scenarios import write_table

# The digest of an import as it was before dressing existed, but for a count of
# what is left out, and for the ground, which now looks upwards.
PLAIN = "2ec83d30fd418392"
NO_PAVING = UpperSides(np.zeros((0, 3, 3)))
STREET = np.column_stack([np.linspace(-80, 80, 41), np.full(41, -12.0)])


def volume(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def area(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def surfaces(one):
    """Returns part -> its triangles in the world."""
    model = one.structure.model
    found = {}
    for part in model.parts:
        vertices, triangles = part_triangles(part, model.meshes)
        found[part.name] = vertices[triangles]
    return found


def dressed(city, path=STREET, seed=0):
    drives = [WaypointRoute(path, path)]
    ground = ground_of(city.objects)
    result = dress_buildings(city.objects, drives, (), ground, seed)
    names = {one.structure.name: one for one in result.buildings}
    return {k: result.buildings[v] for k, v in names.items()}, result


def read(osm, folder):
    return import_openstreetmap(osm.write(folder / "city.osm"), None)


@pytest.fixture(scope="module")
def row(tmp_path_factory):
    """Houses of a street: with a common wall, an odd outline, a gable."""
    osm = OsmWriter()
    common = {"building": "apartments", "building__levels": "5"}
    osm.box(-60, -4, 20, 14, **common)
    osm.box(-40, -4, 20, 14, **common)
    odd = [(-10, -4), (14, 1), (14, 12), (4, 9), (2, 16), (-10, 16)]
    osm.way(odd, closed=True, building="yes", height="17")
    osm.box(
        20, -4, 24, 10, building="house", height="11",
        roof__shape="gabled", roof__height="5",
    )  # fmt: skip
    osm.box(55, -4, 9, 9, building="house", height="6", building__colour="#f00")
    return read(osm, tmp_path_factory.mktemp("row"))


def fronts(one, parts):
    """Yields (triangle, distance outwards) of fronts of a building's walls."""
    panels = find_panels([one.triangles[is_upright(one.triangles)]])
    names = ("body", "glass", "frames", "doors")
    some = np.concatenate([parts[name] for name in names if name in parts])
    normals = np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0])
    for p in panels:
        ahead = normals[:, :2] @ p.outward > 0.99 * np.linalg.norm(
            normals, axis=1
        )
        out = (some - p.origin)[..., :2] @ p.outward
        x = (some.mean(axis=1)[:, :2] - p.origin[:2]) @ p.along
        inside = (np.abs(out) < 1.0).all(axis=1) & (x > 0.0) & (x < p.length)
        chosen = ahead & inside
        yield from zip(some[chosen], out[chosen].mean(axis=1), strict=True)


def test_recesses_take_their_volume_and_nothing_else(row):
    after, _ = dressed(row)
    for one in row.objects:
        parts = surfaces(after[one.structure.name])
        closed = [
            parts[name]
            for name in ("body", "roof", "glass", "frames", "doors")
            if name in parts
        ]
        taken = 0.0
        deepest = 0.0
        for triangle, out in fronts(one, parts):
            taken -= area(triangle[None]) * out
            deepest = min(deepest, out)
        assert taken > 1.0, one.structure.name
        assert -0.96 < deepest < -0.1
        expected = volume(one.triangles) - taken
        found = volume(np.concatenate(closed))
        assert found == pytest.approx(expected, abs=5e-3)


def test_walls_stay_where_the_file_has_them(row):
    after, _ = dressed(row)
    for one in row.objects:
        parts = surfaces(after[one.structure.name])
        panels = find_panels([one.triangles[is_upright(one.triangles)]])
        before = sum(area(p.triangles) for p in panels)
        found = sum(area(triangle[None]) for triangle, _ in fronts(one, parts))
        assert found == pytest.approx(before, abs=1e-2)
        # Reliefs reach out of a wall by a balcony at most.
        low, high = (f(one.triangles[:, :, :2].reshape(-1, 2), axis=0)
                     for f in (np.min, np.max))  # fmt: skip
        corners = np.concatenate(list(parts.values())).reshape(-1, 3)[:, :2]
        assert (corners > low - 1.2).all()
        assert (corners < high + 1.2).all()


def test_a_wall_against_a_neighbour_has_no_windows(row):
    after, _ = dressed(row)
    left, right = (row.objects[k].structure.name for k in (0, 1))
    for name, side in ((left, 1), (right, -1)):
        parts = surfaces(after[name])
        x = np.concatenate([parts["glass"], parts["doors"]])[:, :, 0]
        wall = row.objects[0].triangles[:, :, 0].max()
        assert (np.abs(x - wall) > 0.4).all()
        # The far side of the same house has windows.
        assert (np.abs(x - (wall - 20.0 * side)).max(axis=1) < 0.5).any()


def test_tags_win(row):
    after, result = dressed(row)
    model = after[row.objects[4].structure.name].structure.model
    colours = {part.name: part.rgb for part in model.parts}
    assert colours["body"] == (1.0, 0.0, 0.0)
    assert result.by_file == {"levels": 2, "use": 4, "wall": 1}
    parts = surfaces(after[row.objects[0].structure.name])
    lowest = np.sort(parts["glass"][:, :, 2].min(axis=1).round(2))
    # Five storeys of three metres, as the file says.
    assert len(np.unique(np.floor(lowest / 3.0))) == 5


@pytest.mark.parametrize(
    ("tags", "use"),
    [({"building": "yes", "shop": "bakery"}, "retail"),
     ({"building": "church"}, "church"),
     ({"building": "garages"}, "shed"),
     ({"function": "Woonfunctie"}, "flats"),
     ({}, "house")],
)  # fmt: skip
def test_uses(tags, use):
    assert building_use(tags, 100.0, 6.0) == (use, bool(tags))


@pytest.mark.parametrize(
    ("value", "rgb"),
    [("#ff8000", (1.0, 128 / 255, 0.0)), ("light_grey", (211 / 255,) * 3),
     ("nonsense", None)],
)  # fmt: skip
def test_colours(value, rgb):
    told = tagged_finish({"roof:colour": value}, "roof")
    assert (told and told.rgb) == (rgb and pytest.approx(rgb))
    assert told is None or told.material is None


@pytest.mark.parametrize(
    ("tags", "part", "material"),
    [({"building:material": "brick"}, "building", "brick"),
     ({"roof:material": "roof_tiles"}, "roof", "brick"),
     ({"building:material": "wood"}, "building", None)],
)  # fmt: skip
def test_a_tag_tells_the_material_whatever_the_colour(tags, part, material):
    assert tagged_finish(tags, part).material == material
    painted = tagged_finish({**tags, f"{part}:colour": "white"}, part)
    assert painted == Finish((1.0, 1.0, 1.0), material)
    assert tagged_finish({f"{part}:material": "jelly"}, part) is None


@pytest.mark.slow
def test_a_house_is_the_same_whatever_else_the_file_holds(row, tmp_path):
    after, _ = dressed(row)
    again, _ = dressed(row)
    other, _ = dressed(row, seed=1)
    name = row.objects[2].structure.name

    def look(found):
        return surfaces(found[name]), [
            part.rgb for part in found[name].structure.model.parts
        ]

    first, second = look(after), look(again)
    assert first[1] == second[1] != look(other)[1]
    for part, triangles in first[0].items():
        np.testing.assert_array_equal(triangles, second[0][part])
    alone = dressed(
        type(row)([row.objects[2]], row.origin, "", ImportFaults())
    )[0]
    assert look(alone)[1] == first[1]


def test_a_lower_house_has_the_colours_of_the_whole_one(row):
    city = type(row)(row.objects, row.origin, "", ImportFaults())
    staged, changes = grow(stage_city("f", city, ImportOptions()), 0.9, 4)
    assert changes["part_of_height"]
    drives = [WaypointRoute(STREET, STREET)]
    ground = ground_of(staged.kept)
    found = dress_buildings(staged.kept, drives, (), ground, 0)
    new = {o.structure.name: o for o in found.buildings.values()}
    for name in changes["part_of_height"]:
        whole, low = new[name], new[f"{name}_lower"]
        rgb = [
            {p.name: p.rgb for p in one.structure.model.parts}
            for one in (whole, low)
        ]
        assert rgb[0]["body"] == rgb[1]["body"]
        assert rgb[0]["roof"] == rgb[1]["roof"]


def test_only_what_drives_see_from_near_has_windows(tmp_path):
    osm = OsmWriter()
    near = osm.box(-10, 0, 20, 10, building="yes", height="12")
    far = osm.box(-10, 60, 20, 10, building="yes", height="12")
    city = read(osm, tmp_path)
    path = np.column_stack([np.linspace(-80, 80, 41), np.full(41, -40.0)])
    after, _ = dressed(city, path)
    glass = surfaces(after[f"building_w{near}"])["glass"]
    y = city.objects[0].triangles[:, :, 1]
    # The rear is invisible.
    assert glass[:, :, 1].max() < y.min() + 11.0
    assert (glass[:, :, 1] < y.min() + 0.5).any()
    assert set(surfaces(after[f"building_w{far}"])) >= {"body", "roof"}
    assert "glass" not in surfaces(after[f"building_w{far}"])


@pytest.mark.parametrize("is_lasting", [True, False])
def test_a_house_behind_one_that_always_stands_has_no_windows(
    tmp_path, is_lasting
):
    osm = OsmWriter()
    osm.box(-40, 0, 80, 8, building="yes", height="30")
    behind = osm.box(-8, 20, 16, 10, building="yes", height="9")
    city = read(osm, tmp_path)
    low = city.objects[0].triangles.min(axis=(0, 1))
    path = STREET * [0.2, 1.0] + low[:2] + [40.0, 6.0]
    always = city.objects if is_lasting else city.objects[1:]
    result = dress_buildings(
        city.objects,
        [WaypointRoute(path, path)],
        (),
        ground_of(city.objects),
        0,
        always,
    )
    after = {o.structure.name: o for o in result.buildings.values()}
    has_glass = "glass" in surfaces(after[f"building_w{behind}"])
    assert has_glass is not is_lasting


def test_nothing_hangs_in_the_way_of_a_drive(tmp_path):
    osm = OsmWriter()
    for k in range(12):
        osm.box(20 * k, 0, 20, 10, building="apartments", building__levels="4")
    osm.box(0, 30, 20, 10, building="retail", height="9")
    city = read(osm, tmp_path)
    low = np.min([o.triangles.min(axis=(0, 1)) for o in city.objects], axis=0)
    x = np.linspace(low[0], low[0] + 240, 60)
    path = np.column_stack([x, np.full(60, low[1] - 2.0)])
    after, result = dressed(city, path)
    assert result.at_random["balconies"] > 0
    way = LineString(path).buffer(1.5)
    for one in after.values():
        for triangles in surfaces(one).values():
            some = triangles[triangles[:, :, 2].min(axis=1) < 4.0]
            # A balcony would reach 0.35 m into it.
            assert some[:, :, 1].min(initial=np.inf) > way.bounds[3] + 0.1


def test_models_with_windows_of_their_own_keep_them(tmp_path):
    city = CityWriter()
    city.box("plain", 0, 0, (12, 12, 9))
    city.box("own", 30, 0, (12, 12, 9))
    city.objects["own"]["geometry"][0]["lod"] = "3"
    found = import_cityjson(city.write(tmp_path / "c.json"), None, None)
    low = np.min([o.triangles.min(axis=(0, 1)) for o in found.objects], 0)
    path = STREET + low[:2] + [0.0, 4.0]
    after, _ = dressed(found, path)
    assert "glass" in surfaces(after["plain"])
    assert set(surfaces(after["own"])) == {"body", "roof"}
    np.testing.assert_allclose(
        volume(np.concatenate(list(surfaces(after["own"]).values()))),
        12 * 12 * 9,
        atol=1e-6,
    )


@pytest.mark.parametrize(
    ("aside", "number"),
    # A wall of 60 m with a corner in its middle, and one at 3/4.
    [((0.0, 0.0), 1), ((0.049, 0.0), 1), ((0.2, 0.1), 2), ((0.2, 0.104), 2),
     ((0.2, 0.18), 3)],
)  # fmt: skip
def test_walls_that_bend_are_divided(aside, number):
    # Turned, and seen from outside in the direction of y.
    x = np.array([-30.0, 0.0, 15.0, 30.0, 30.0, -30.0])
    y = np.array([0.0, -aside[0], -aside[1], 0.0, 20.0, 20.0])
    c, s = np.cos(0.6), np.sin(0.6)
    outline = Polygon(np.column_stack([c * x - s * y, s * x + c * y]))
    walls, _ = extruded(outline, 0.0, 9.0, "a", ImportFaults())
    walls = walls[is_upright(walls)]
    panels = find_panels([walls])
    assert all(panel.is_plane for panel in panels)
    assert len(panels) == number + 3
    found = np.concatenate([panel.triangles for panel in panels])
    assert {t.tobytes() for t in found} == {t.tobytes() for t in walls}
    front = [p for p in panels if p.outward @ [s, -c] > 0.9]
    assert len(front) == number
    limit = 0.05 if number == 1 else 0.01
    for panel in front:
        off = (panel.triangles - panel.origin)[..., :2] @ panel.outward
        assert np.abs(off).max() <= limit
    length = np.hypot(np.diff(x[:4]), np.diff(y[:4])).sum()
    assert sum(p.length for p in front) == pytest.approx(length, abs=0.01)


def test_a_gable_keeps_its_slopes():
    walls, _ = extruded(
        LineString([(0, 0), (12, 0)]).buffer(4, cap_style="flat"),
        0.0, 9.0, "a", ImportFaults(), "gabled", 3.0,
    )  # fmt: skip
    gable = min(find_panels([walls[is_upright(walls)]]), key=lambda p: p.length)
    assert gable.outline is not None
    style = make_style({}, None, 60.0, 8.0, False, np.random.default_rng(1))
    style = replace(
        style, storey=3.2, window_sill=1.0, window_height=1.2,
        window_width=1.2, window_pitch=2.0,
        balconies=False, shops=False, cornice=0.0, plinth=0.0,
    )  # fmt: skip
    plan = plan_facade(gable, style, 0.0, 0.0, 22.0)
    assert {o.row for o in plan.openings} == {0, 1, 2}
    out = Assembly(Site(Polygon(), "a"), np.random.default_rng(1))
    names = ("body", "doors", "frames", "glass", "sign", "trim")
    out.declare_materials(**dict.fromkeys(names, Finish((0.5, 0.5, 0.5))))
    counts = add_facade(out, plan, out.rng)
    # The upper row leaves the gable.
    assert counts == {"windows": 6}
    model = out.to_model(Polygon())
    found = np.concatenate(
        [
            v[t]
            for v, t in (part_triangles(p, model.meshes) for p in model.parts)
        ]
    )
    normals = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    ahead = normals[:, :2] @ gable.outward > 1e-9
    assert area(found[ahead]) == pytest.approx(8 * 6 + 8 * 3 / 2)
    deep = (found - gable.origin)[..., :2] @ gable.outward < -0.1
    panes = found[ahead & deep.all(axis=1)]
    assert area(panes) == pytest.approx(6 * 1.2 * 1.2, rel=1e-3)


def write_quarter(folder):
    osm = OsmWriter()
    for k in range(4):
        for y in (8, -20):
            osm.box(40 * k, y, 30, 12, building="yes", height=str(9 + k))
    ends = [osm.node(-20, 0), osm.node(180, 0)]
    osm.way_of(ends, highway="residential", width="8", sidewalk="both")
    osm.node(30, 5.5, natural="tree")
    return osm.write(folder / "quarter.osm")


def run_import(folder, *options):
    source = write_quarter(folder)
    output = folder / "quarter"
    result = CliRunner().invoke(
        app, ["import", str(source), "--output", str(output), *options]
    )
    assert result.exit_code == 0, result.output
    return output


def digest(folder):
    names = ("stage_*.sdf", "structures.csv", "meshes/*", "import.yaml",
             "*.csv", "sequence_*.yaml")  # fmt: skip
    paths = sorted({path for name in names for path in folder.glob(name)})
    whole = hashlib.sha256()
    for path in paths:
        content = path.read_bytes()
        if path.name == "structures.csv":
            # The columns `material` and `kind`, the last ones, came later.
            lines = content.decode().splitlines()
            later = {"material", "kind"}.intersection(lines[0].split(","))
            kept = (line.rsplit(",", len(later))[0] + "\n" for line in lines)
            content = "".join(kept).encode()
        whole.update(str(path.relative_to(folder)).encode())
        whole.update(content)
    return whole.hexdigest()[:16]


@pytest.mark.slow
def test_plain_is_what_an_import_gave_before_there_was_dressing(tmp_path):
    assert digest(run_import(tmp_path, "--plain")) == PLAIN


@pytest.mark.night
@pytest.mark.slow
def test_the_notes_count_details_of_the_file_and_at_random(tmp_path):
    folder = run_import(tmp_path, "--grow", "0.5")
    facts = yaml.safe_load((folder / "import.yaml").read_text())["dressing"]
    assert facts["seed"] == 0
    assert facts["buildings"] >= 8
    assert facts["at_random"]["windows"] > 50
    with (folder / "structures.csv").open() as stream:
        origins = {r["name"]: r["origin"] for r in csv.DictReader(stream)}
    for name, origin in origins.items():
        if name == "ground":
            assert origin == "guess"
        elif name.startswith("building"):
            assert origin == "dressed"
        elif name.startswith(("road", "tree")):
            assert origin == "file"
        else:
            # Sidewalks have kerbs; lamps and cars are not in the file.
            assert origin == ("dressed" if name.startswith("walk") else "lot")
    # The table equals the worlds, though no world was loaded for it.
    table = folder / "sequences.csv"
    told = table.read_text()
    table.unlink()
    write_table(folder)
    assert table.read_text() == told
    # Each stage parses, and both have the house that changes nothing.
    for stage in ("01", "02"):
        text = (folder / f"stage_{stage}.sdf").read_text()
        assert "/glass" in text
        for mesh in set(re.findall("meshes/[^<]+", text)):
            assert (folder / mesh).is_file()


@pytest.mark.parametrize(
    ("length", "number"),
    # 3.5 m between the margins hold a door, a window and walls beside them.
    [(4.45, 1), (4.55, 2), (6.0, 2)],
)
def test_a_house_with_one_bay_has_a_window_beside_its_door(length, number):
    style = make_style(
        {"building": "house"}, None, 60.0, 5.0, False, np.random.default_rng(1)
    )
    style = replace(style, window_pitch=4.0, window_width=1.3, storey=5.0)
    wall = np.array([[0.0, 0.0], [length, 0.0]])
    low, high = np.zeros(2), np.full(2, 4.0)
    corners = [np.column_stack([wall, z]) for z in (low, high)]
    (a, b), (d, c) = corners
    (panel,) = find_panels([np.array([[a, b, c], [a, c, d]])])
    openings = with_doors(
        plan_facade(panel, style, 0.0, 0.0, 9.0), NO_PAVING
    ).openings
    assert [o.kind for o in openings] == ["door", "window"][:number]
    ends = [x for o in openings for x in (o.x0, o.x1)]
    assert ends == pytest.approx(
        np.repeat(np.linspace(0.5, length - 0.5, number + 1), 2)[1:-1]
    )
