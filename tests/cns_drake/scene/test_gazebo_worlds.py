"""Worlds that people write for Gazebo."""

from helpers.mesh_texts import obj_text
import numpy as np
from pydrake.math import RigidTransform
import pytest

from cns_drake.base.errors import InputError
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.world import load_world
from cns_drake.sensors.lidar.patterns import SpinningPattern
from cns_drake.simulation.scanning import scan_world

AROUND = SpinningPattern((0.0, -0.5), 4, 0.05, 90.0, 0.1)
BOX = "<geometry><box><size>1 1 2</size></box></geometry>"
CRATE = f"""<sdf version="1.6"><model name="crate">
<pose>50 50 0 0 0 0</pose><static>1</static>
<link name="link"><inertial><mass>3</mass></inertial>
<collision name="c">{BOX}</collision><visual name="visual">{BOX}
<material><script><name>Gazebo/Wood</name></script></material></visual>
<sensor name="s" type="contact"/></link>
<plugin name="p" filename="libp.so"/></model></sdf>"""
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.5"/><up_axis>{up}</up_axis></asset><library_geometries>
<geometry id="g"><mesh><source id="p">
<float_array id="a" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array>
<technique_common><accessor source="#a" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
<translate>2 0 0</translate><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


def include(uri, extra=""):
    return f"<include><uri>{uri}</uri>{extra}</include>"


@pytest.fixture
def models(tmp_path):
    """A folder of models away from the world."""
    folder = tmp_path / "elsewhere" / "models"
    (folder / "crate").mkdir(parents=True)
    (folder / "crate" / "model.sdf").write_text(CRATE)
    (folder / "crate" / "model.config").write_text(
        "<model><sdf version='1.4'>old.sdf</sdf>"
        "<sdf version='1.6'>model.sdf</sdf></model>"
    )
    return folder


def write(tmp_path, *elements):
    path = tmp_path / "worlds" / "yard.world"
    path.parent.mkdir(exist_ok=True)
    body = "".join(elements)
    path.write_text(
        f'<sdf version="1.6"><world name="default">{body}</world></sdf>'
    )
    return path


def ranges(world):
    """Ranges of the level beams to the rear, left, ahead and right."""
    scan = scan_world(world, RigidTransform([0.0, 0.0, 1.0]), AROUND)
    level = scan[scan["ring"] == 0]
    names = ("rear", "left", "ahead", "right")
    columns = np.round(level["t"] / 25e6).astype(int)
    distances = np.hypot(level["x"], level["y"]).tolist()
    return {names[k]: d for k, d in zip(columns, distances, strict=True)}


def test_included_models_have_their_place_and_name(tmp_path, models):
    path = write(
        tmp_path,
        include("model://sun"),
        include("model://ground_plane"),
        include("model://crate", "<name>one</name><pose>5 0 1 0 0 0</pose>"),
        include("model://crate", "<pose>0 8 1 0 0 0.3</pose>"),
        include("model://crate", "<pose>0 -8 1 0 0 0</pose>"),
        '<physics type="ode"/><gui/><state world_name="default"/>',
    )
    world = load_world(path, model_paths=[models])
    seen = ranges(world)
    assert set(seen) == {"left", "ahead", "right"}
    assert seen["ahead"] == pytest.approx(4.5)
    assert seen["right"] == pytest.approx(7.5)
    assert seen["left"] == pytest.approx(8 - 0.5 / np.cos(0.3))
    names = {entry.name for entry in world.structures}
    assert names == {"ground_plane", "one", "crate", "crate_2"}
    assert [note.split(": ")[1] for note in world.notes] == [
        "1 lights ignored",
        "3 materials by script or texture ignored",
        "3 plugins ignored",
        "3 sensors ignored",
    ]


def test_the_ground_plane_is_endless(tmp_path):
    world = load_world(write(tmp_path, include("model://ground_plane")))
    scan = scan_world(world, RigidTransform([500.0, 3e3, 1.0]), AROUND)
    assert len(scan) == 4
    np.testing.assert_allclose(scan["z"], -1.0, atol=1e-5)


@pytest.mark.parametrize("variable", ["GZ_SIM_RESOURCE_PATH", "SDF_PATH"])
def test_models_are_looked_for_where_gazebo_does(
    tmp_path, models, variable, monkeypatch
):
    path = write(tmp_path, include("model://crate", "<pose>5 0 1 0 0 0</pose>"))
    with pytest.raises(InputError, match="no visual"):
        load_world(path)
    monkeypatch.setenv(variable, f"/nowhere:{models}")
    assert ranges(load_world(path)) == {"ahead": pytest.approx(4.5)}


def test_missing_models_are_noted_and_left_out(tmp_path, models):
    mesh = "<geometry><mesh><uri>model://crate/lost.dae</uri></mesh></geometry>"
    path = write(
        tmp_path,
        include("model://crate", "<pose>5 0 1 0 0 0</pose>"),
        include("model://lost"),
        include("https://fuel.gazebosim.org/1.0/a/models/Lost Two"),
        include("https://fuel.gazebosim.org/1.0/a/models/Ground Plane"),
        f"<model name='m'><link name='l'><visual name='v'>{mesh}</visual>"
        "<visual name='h'><geometry><heightmap/></geometry></visual>"
        "</link></model><actor name='walker'/>",
    )
    world = load_world(path, model_paths=[models])
    assert ranges(world) == {"ahead": pytest.approx(4.5)}
    notes = "\n".join(world.notes)
    assert (
        "2 models not found, and left out: model://lost, model://lost_two"
        in notes
    )
    assert "1 meshes not found, and left out: model://crate/lost.dae" in notes
    assert "1 actors ignored" in notes
    assert "1 visuals of type heightmap ignored" in notes


@pytest.mark.parametrize(
    ("up", "corner"),
    [("Z_UP", [1.0, 0.0, 1.5]), ("Y_UP", [1.0, -1.5, 0.0])],
)
def test_a_dae_mesh_stands_upright_in_metres(tmp_path, models, up, corner):
    (models / "crate" / "mesh.dae").write_text(DAE.format(up=up))
    (models / "crate" / "model.sdf").write_text(
        '<sdf version="1.5"><model name="crate"><link name="link">'
        '<visual name="visual"><geometry><mesh>'
        "<uri>model://crate/mesh.dae</uri><scale>2 2 2</scale></mesh>"
        "</geometry></visual></link></model></sdf>"
    )
    path = write(tmp_path, include("model://crate"))
    world = load_world(path, model_paths=[models])
    (geometry,) = read_perception_geometry(world.scene_graph.model_inspector())
    p_GVset = np.unique(geometry.surface.p_GVset.round(6), axis=0)
    assert np.ptp(p_GVset[:, 0]) == pytest.approx(1.0)
    assert (np.abs(p_GVset - 2 * np.array(corner)).max(axis=1) < 1e-5).any()


def test_many_models_with_endless_collisions(tmp_path, models):
    """Drake ends the process at one of these among eleven other models."""
    ground = "<geometry><plane><normal>0 0 1</normal></plane></geometry>"
    (models / "crate" / "mesh.obj").write_text(obj_text())
    path = write(
        tmp_path,
        "<model name='ground'><static>true</static><link name='l'>"
        f"<collision name='c'>{ground}</collision>"
        f"<visual name='v'>{ground}</visual></link></model>",
        *(
            include("model://crate", f"<pose>{5 + k} 0 1 0 0 0</pose>")
            for k in range(40)
        ),
    )
    seen = ranges(load_world(path, model_paths=[models]))
    assert seen == {"ahead": pytest.approx(4.5)}


def test_models_that_include_each_other(tmp_path, models):
    (models / "crate" / "model.sdf").write_text(
        '<sdf version="1.6"><model name="crate">'
        + include("model://crate")
        + "</model></sdf>"
    )
    path = write(tmp_path, include("model://crate"))
    with pytest.raises(InputError, match="include each other"):
        load_world(path, model_paths=[models])


def test_names_that_sdf_does_not_allow(tmp_path):
    link = f"<link name='l'><visual name='v'>{BOX}</visual></link>"
    path = write(
        tmp_path,
        "<scene/><model name='a::b'><pose>5 0 1 0 0 0</pose>" + link + link,
        "</model><model name='__x__'>" + link + "</model>",
    )
    names = {entry.name for entry in load_world(path).structures}
    assert names == {"a_b", "model_x"}
