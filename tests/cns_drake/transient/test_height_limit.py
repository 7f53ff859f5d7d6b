"""Buildings and plants of less height, as before a city grew."""

from dataclasses import replace
import itertools

from helpers.building_checks import typical_model
from helpers.transient_town import (
    LANES,
    ORIGIN,
    X_WT,
    box_shape,
    change_maker,
    mesh_shape,
    visual,
    write_transient_town,
    write_world,
)
import numpy as np
import pytest

from worlds.shapes import Way, lowered, part_mesh

DRIVE = Way([(X_WT @ [x, -1, 0])[:2] for x in (-60, 60)])
# The parapet of a new roof, and the highest equipment on it [m].
PARAPET = 0.9
EQUIPMENT = 4.0


@pytest.fixture(scope="module")
def changed(tmp_path_factory):
    """Returns the town after changes and its structures, cached."""
    sdf = write_transient_town(tmp_path_factory.mktemp("town"))
    return change_maker(sdf, DRIVE, LANES)


def height(thing):
    return thing.top - thing.bottom


def wall_area(thing):
    """Area of all upright triangles of a structure [m^2]."""
    corners = np.concatenate([one.triangle_corners for one in thing.parts])
    a, b, c = np.moveaxis(corners, 1, 0)
    spans = np.cross(b - a, c - a)
    upright = np.abs(spans[:, 2]) < 1e-6 * np.linalg.norm(spans, axis=1)
    return np.linalg.norm(spans[upright], axis=1).sum() / 2


def test_a_box_is_cut_and_gets_a_parapet(tmp_path):
    """Walls of a box 8 m by 6 m: closed forms above and below the cut."""
    boxes = {"high": 12.0, "storey": 7.501, "low": 7.499}
    visuals = [
        visual(f"{name}/body", box_shape(8, 6, z), 40 * k, 0, z / 2, 0, 0, 0.3)
        for k, (name, z) in enumerate(boxes.items())
    ]
    rows = dict.fromkeys(boxes, "building")
    sdf = write_world(tmp_path, visuals, rows)
    world, after = change_maker(sdf, DRIVE, LANES)(height_limit=5.0)
    for name in ("high", "storey"):
        body, roof, *equipment = after[name].parts
        assert [body.name, roof.name] == ["body", "new_roof"]
        z = body.p_WPs[:, 2] - ORIGIN[2]
        assert z.max() == pytest.approx(5.0, abs=1e-3)
        assert z.min() == pytest.approx(0.0, abs=1e-5)
        z = roof.p_WPs[:, 2] - ORIGIN[2]
        assert z.max() == pytest.approx(5.0 + PARAPET, abs=1e-3)
        # The band outside reaches from 0.5 m below the roof to the top of the
        # parapet, 0.04 m before the walls; the parapet is 0.3 m wide.
        walls = 28.0 * 5.0 + 28.32 * 1.4 + (28.0 - 8 * 0.3) * 0.9
        plain = replace(after[name], parts=(body, roof))
        assert wall_area(plain) == pytest.approx(walls, rel=2e-3)
        assert height(after[name]) < 5.0 + EQUIPMENT
        assert all(one.name.startswith("new_0_") for one in equipment)
        assert world.structures[name].causes == ("height_limit",)
    assert height(after["low"]) == pytest.approx(7.499, abs=1e-5)
    assert world.structures["low"].causes == ()


def test_a_plant_is_scaled_about_its_foot(changed):
    _, before = changed()
    _, after = changed(height_limit=6.5)
    limited = 0
    for name, plant in before.items():
        if plant.semantic_class != "vegetation":
            continue
        share = min(1.0, 6.5 / height(plant))
        limited += share < 1.0
        p, q = plant.p_WPs, after[name].p_WPs
        assert height(after[name]) == pytest.approx(share * height(plant))
        # All points move along rays from one point, the middle of the foot.
        np.testing.assert_allclose(
            q - q.mean(axis=0), share * (p - p.mean(axis=0)), atol=1e-4
        )
        assert after[name].bottom == pytest.approx(plant.bottom)
        at_foot = p[p[:, 2] < plant.bottom + 0.05, :2].mean(axis=0)
        moved = q[p[:, 2] < plant.bottom + 0.05, :2].mean(axis=0) - at_foot
        assert np.abs(moved).max() < 0.2
    assert limited > 10


def test_all_else_stays(changed):
    world, before = changed()
    lower, after = changed(height_limit=5.0)
    assert before.keys() == after.keys()
    same = [e.name for e in lower.structures if not e.causes]
    for name in same:
        assert np.array_equal(before[name].p_WPs, after[name].p_WPs)
    rest = {before[n].semantic_class for n in before.keys() - same}
    assert rest == {"building", "vegetation"}
    assert [(e.instance, e.name) for e in lower.structures] == [
        (e.instance, e.name) for e in world.structures
    ]


@pytest.mark.parametrize("kind", ["office", "hotel", "town_hall"])
def test_a_building_of_a_city_is_lowered_as_in_a_stage(tmp_path, kind):
    """A written building that is lowered has the walls of a lowered model."""
    model = typical_model(kind)
    visuals = []
    for part in model.parts:
        mesh = getattr(part.shape, "mesh", "")
        if mesh.startswith("roof_"):
            shape = mesh_shape(mesh, part.shape.scale)
            pose = (*part.xyz, *part.rpy)
        else:
            path = tmp_path / f"{part.name}.obj"
            path.write_text(part_mesh(part, model.meshes).to_obj())
            shape, pose = f"<mesh><uri>{path}</uri></mesh>", (0, 0, 0)
        visuals.append(visual(f"house/{part.name}", shape, *pose))
    sdf = write_world(tmp_path, visuals, {"house": "building"})
    _, before = change_maker(sdf, DRIVE, LANES)()
    _, after = change_maker(sdf, DRIVE, LANES)(height_limit=8.0)
    ground = before["house"].bottom - ORIGIN[2]
    expected = lowered(model, 8.0 + ground, "house", 1)
    assert expected is not model
    here = {
        part.name: part.p_WPs[:, 2].max() - ORIGIN[2]
        for part in after["house"].parts
        if not part.name.startswith("new_")
    }
    there = {
        part.name: part_mesh(part, expected.meshes).vertices[:, 2].max()
        for part in expected.parts
        if not part.name.startswith("new_")
    }
    assert here == pytest.approx(there, abs=2e-3)


def test_lower_levels_are_lower(changed):
    tops = []
    for limit in (20.0, 14.0, 8.0, 5.0):
        _, after = changed(height_limit=limit)
        tops.append({n: t.top for n, t in after.items() if "tree" in n})
    for higher, lower in itertools.pairwise(tops):
        assert all(lower[name] <= higher[name] for name in lower)


def test_parts_of_several_links_may_share_a_name(tmp_path):
    """Each link of a foreign model has a visual of the same name."""
    links = "".join(
        f'<link name="l{k}"><pose>{30 * k} 0 {z / 2} 0 0 0.3</pose>'
        f'<visual name="visual"><geometry>{box_shape(8, 6, z)}</geometry>'
        "</visual></link>"
        for k, z in enumerate((12.0, 16.0))
    )
    sdf = tmp_path / "house.sdf"
    sdf.write_text(
        f'<sdf version="1.9"><model name="house"><static>1</static>{links}'
        "</model></sdf>"
    )
    (tmp_path / "structures.csv").write_text(
        "instance,name,class,material\n1,house,building,glass visual=brick\n"
    )
    _, after = change_maker(sdf, DRIVE, LANES)(height_limit=5.0)
    bodies = [one for one in after["house"].parts if "visual" in one.name]
    assert [one.name for one in bodies] == ["visual", "visual_"]
    for one in bodies:
        assert one.p_WPs[:, 2].max() == pytest.approx(5.0, abs=1e-3)
        assert one.material.look == "brick"
    # A new roof is of the material of the walls.
    (roof,) = (one for one in after["house"].parts if one.name == "new_roof")
    assert roof.material.look == "brick"
    # The second member of the kind: a car of two links moves.
    table = "instance,name,class\n1,house,car\n"
    (tmp_path / "structures.csv").write_text(table)
    for seed in range(8):
        change_maker(sdf, DRIVE, LANES)(parked_cars=1.0, seed=seed)


def test_what_is_not_lowered_is_told(changed, tmp_path):
    _, before = changed()
    most = max(map(height, before.values()))
    world, _ = changed(height_limit=most + 1.0)
    assert world.notes == (
        "transient: height_limit: no building and no plant is higher than"
        f" {most + 1.0:g} m",
    )
    # A canopy, whose posts enclose nothing.
    visuals = [
        visual("canopy/plate", box_shape(8, 6, 1), 0, 0, 11.5),
        visual("canopy/post", box_shape(0.3, 0.3, 11), 0, 0, 5.5),
    ]
    sdf = write_world(tmp_path, visuals, {"canopy": "building"})
    world, after = change_maker(sdf, DRIVE, LANES)(height_limit=5.0)
    assert height(after["canopy"]) == pytest.approx(12.0)
    assert world.notes == (
        "transient: height_limit: higher buildings that stay, because their"
        " walls enclose no area at 5 m: 1",
    )
