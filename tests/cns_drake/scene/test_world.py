"""Loading SDF worlds, and their possible faults."""

from pathlib import Path

from helpers.small_map import box_visual, world_text
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.motion import vehicle_file
from cns_drake.scene import load_world, read_perception_geometry
from cns_drake.sensors import make_beam_pattern
from cns_drake.simulation import scan_world
from evaluation.base import InputError
from worlds.shapes import StructureEntry

MESH = "<mesh><uri>{}</uri></mesh>"


def write_world(tmp_path, geometry):
    visual = f'<visual name="thing"><geometry>{geometry}</geometry></visual>'
    path = tmp_path / "world.sdf"
    path.write_text(world_text([visual]))
    return path


def test_static_models_are_anchored_and_the_vehicle_is_not(small_map):
    world = load_world(small_map / "stage_04.sdf", vehicle=vehicle_file())
    plant = world.plant
    city = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("city").index())
    base = plant.GetBodyByName("base_link", world.vehicle)
    assert city in world.anchored_frames()
    base_frame = plant.GetBodyFrameIdOrThrow(base.index())
    assert base_frame not in world.anchored_frames()
    assert world.structures["tower_003"].label == 50


def test_files_may_be_named_by_text(small_map):
    path = small_map / "stage_04.sdf"
    world = load_world(
        str(path),
        vehicle=str(vehicle_file()),
        model_paths=[str(small_map)],
    )
    assert world.vehicle is not None
    same = load_world(path)
    assert world.structures["tower_003"] == same.structures["tower_003"]
    with pytest.raises(InputError, match=r"^nowhere\.sdf: no such file$"):
        load_world("nowhere.sdf")


@pytest.mark.parametrize(
    ("geometry", "fault"),
    [
        (MESH.format("missing.obj"), r"missing\.obj"),
        ("<sphere><radius>1e8</radius></sphere>", "larger than 1e"),
        ("<box><size>1 1 2e7</size></box>", "larger than 1e"),
    ],
)
def test_geometry_that_no_ray_can_hit(tmp_path, geometry, fault):
    path = write_world(tmp_path, geometry)
    with pytest.raises(InputError, match=rf"world\.sdf: .*{fault}") as caught:
        load_world(path)
    assert "\n" not in str(caught.value)


def test_world_with_nothing_to_see(tmp_path):
    path = tmp_path / "empty.sdf"
    path.write_text(world_text([]))
    with pytest.raises(
        InputError, match=r"empty\.sdf: the world has no visuals"
    ):
        load_world(path)


@pytest.mark.parametrize("text", ["", "<sdf><world>", "hello", "<sdf/>"])
def test_files_that_are_no_world(tmp_path, text):
    path = tmp_path / "broken.sdf"
    path.write_text(text)
    with pytest.raises(InputError, match=r"broken\.sdf: ") as caught:
        load_world(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("<pose>1", '<pose relative_to="nowhere">1', "cannot be parsed: [^<]"),
        (
            "<link",
            '<pose relative_to="nowhere">1 0 0 0 0 0</pose><link',
            "does not match a model or frame name there",
        ),
        ("<pose>1", "<pose>", "must have 6 values"),
        ("body", "b\udca5dy", "not UTF-8"),
    ],
)
def test_faults_that_drake_reports_in_several_ways(
    tmp_path, capfd, old, new, fault
):
    text = world_text([box_visual("body", (1, 2, 3, 0, 0, 0), (4, 5, 6))])
    path = tmp_path / "broken.sdf"
    path.write_text(text.replace(old, new), errors="surrogateescape")
    with pytest.raises(InputError, match=rf"broken\.sdf: .*{fault}"):
        load_world(path)
    assert capfd.readouterr() == ("", "")


def test_a_fault_names_the_file_once(tmp_path, monkeypatch):
    text = world_text([box_visual("body", (1, 2, 3, 0, 0, 0), (4, 5, 6))])
    (tmp_path / "a.sdf").write_text(text.replace("<pose>1", "<pose>"))
    monkeypatch.chdir(tmp_path)
    for path in (tmp_path / "a.sdf", Path("a.sdf"), Path("./x/../a.sdf")):
        (tmp_path / "x").mkdir(exist_ok=True)
        with pytest.raises(InputError) as refusal:
            load_world(path)
        message = str(refusal.value)
        assert message == f"{path}: line 8: pose: must have 6 values"
        assert message.count("a.sdf") == 1


def test_a_mesh_that_changes_is_read_anew(tmp_path):
    (tmp_path / "slab.obj").touch()
    world = load_world(write_world(tmp_path, MESH.format("slab.obj")))
    for x in (1, 2):
        (tmp_path / "slab.obj").write_text(
            f"v 0 0 0\nv {x} 0 0\nv 0 1 0\nf 1 2 3\n"
        )
        for _ in range(2):  # The second time it is known.
            (geometry,) = read_perception_geometry(
                world.scene_graph.model_inspector()
            )
            p_GVset = geometry.surface.p_GVset
            assert p_GVset.tolist() == [[0, 0, 0], [x, 0, 0], [0, 1, 0]]


def test_a_mesh_that_is_no_mesh(tmp_path, capfd):
    (tmp_path / "wedge.obj").touch()
    world = load_world(write_world(tmp_path, MESH.format("wedge.obj")))
    inspector = world.scene_graph.model_inspector()
    for text, fault in [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "a vertex that is not there"),
        ("v 0 0 0\nv 1e9 0 0\nv 0 1 0\nf 1 2 3\n", "larger than"),
    ]:
        (tmp_path / "wedge.obj").write_text(text)
        with pytest.raises(InputError, match=rf"wedge\.obj: .*({fault})"):
            read_perception_geometry(inspector)
    assert capfd.readouterr().err == ""


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"no\.sdf: no such file"):
        load_world(tmp_path / "no.sdf")


def test_table_beside_the_world_is_optional(tmp_path):
    path = tmp_path / "world.sdf"
    path.write_text(
        world_text([box_visual("hut/wall", (0, 0, 1, 0, 0, 0), (1, 1, 2))])
    )
    assert list(load_world(path).structures) == [
        StructureEntry(1, "hut", "unlabeled")
    ]


def test_omitted_structures_are_neither_seen_nor_in_the_way(small_map):
    """The last stage without its new structures is the first stage."""
    added = [f"tower_{k:03d}" for k in range(19, 40)]
    later = load_world(small_map / "stage_04.sdf", without=added)
    earlier = load_world(small_map / "stage_01.sdf")
    names = [
        {
            inspector.GetName(geometry_id)
            for geometry_id in inspector.GetAllGeometryIds()
        }
        for inspector in (
            world.scene_graph.model_inspector() for world in (later, earlier)
        )
    ]
    assert names[0] == names[1]
    X_WS = RigidTransform(RollPitchYaw(0.02, -0.01, 0.7), [3.0, -40.0, 1.6])
    pattern = make_beam_pattern("vlp-16", 0.05)
    scans = [scan_world(world, X_WS, pattern) for world in (later, earlier)]
    assert len(scans[0]) > 5000
    np.testing.assert_array_equal(scans[0], scans[1])


def test_omitting_missing_structures_is_an_error(small_map):
    with pytest.raises(
        InputError, match=r"without: no structure 'spire' in .*stage_01\.sdf"
    ):
        load_world(small_map / "stage_01.sdf", without=["tower_001", "spire"])


def test_structures_that_the_table_lacks_follow_behind(tmp_path):
    visuals = [
        box_visual(f"{name}/wall", (0, 0, 1, 0, 0, 0), (1, 1, 2))
        for name in ("shed", "barn", "hut")
    ]
    (tmp_path / "world.sdf").write_text(world_text(visuals))
    (tmp_path / "structures.csv").write_text(
        "instance,name,class\n7,hut,building\n"
    )
    world = load_world(tmp_path / "world.sdf", vehicle=vehicle_file())
    assert list(world.structures) == [
        StructureEntry(7, "hut", "building"),
        StructureEntry(8, "barn", "unlabeled"),
        StructureEntry(9, "shed", "unlabeled"),
    ]


ROBOT = """<robot name="r"><link name="l">
<inertial><mass value="-1"/></inertial>
<visual><geometry><box size="1 1 2"/></geometry></visual>
<visual><origin xyz="0 0 5"/><geometry><mesh filename="{uri}"/></geometry>
</visual><collision><geometry><mesh filename="gone.stl"/></geometry></collision>
</link><gazebo><sensor/></gazebo></robot>"""


@pytest.mark.parametrize("uri", ["model://p/a.obj", "package://p/a.obj"])
def test_meshes_of_urdf_are_searched_as_those_of_sdf(tmp_path, uri):
    (tmp_path / "models" / "p").mkdir(parents=True)
    mesh = tmp_path / "models" / "p" / "a.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    path = tmp_path / "worlds" / "r.urdf"
    path.parent.mkdir()
    path.write_text(ROBOT.format(uri=uri))
    world = load_world(path, model_paths=[tmp_path / "models"])
    inspector = world.scene_graph.model_inspector()
    assert len(read_perception_geometry(inspector)) == 2
    assert world.notes == ()
    mesh.unlink()
    world = load_world(path)
    inspector = world.scene_graph.model_inspector()
    (box,) = read_perception_geometry(inspector)
    assert np.ptp(box.surface.p_GVset, axis=0).tolist() == [1.0, 1.0, 2.0]
    (note,) = world.notes
    assert f"1 meshes not found, and left out: {uri}" in note


def test_mjcf_is_drakes_alone(tmp_path):
    path = tmp_path / "w.xml"
    path.write_text("<mujoco model='m'><worldbody/></mujoco>")
    box = tmp_path / "w.urdf"
    box.write_text(ROBOT.format(uri="gone.obj"))
    fault = r"w\.xml: MJCF is not read; Drake's Parser reads it in a Diagram"
    with pytest.raises(InputError, match=fault):
        load_world(path)
    with pytest.raises(InputError, match=fault):
        load_world(box, vehicle=path)
