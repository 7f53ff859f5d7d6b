"""SDF worlds, also those that people write for Gazebo."""

from collections import Counter
import re

from helpers.mesh_texts import L_VERTICES, obj_text
import numpy as np
from pydrake.geometry import Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
import pytest

from cns_drake.scene import (
    list_geometry,
    load_world,
    read_perception_geometry,
    tessellate,
)
from cns_drake.sensors import SpinningPattern
from cns_drake.simulation import scan_world
from evaluation.base import InputError

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


def link(geometry=BOX, extra="", pose="", name="l"):
    visual = f"<visual name='v'>{pose}{geometry}{extra}</visual>"
    return f"<link name='{name}'>{visual}</link>"


def boxes(world):
    """Structure -> least and greatest coordinates of its surfaces (2, 3)."""
    plant = world.plant
    found = {}
    context = plant.CreateDefaultContext()
    inspector = world.scene_graph.model_inspector()
    for one in read_perception_geometry(inspector):
        body = plant.GetBodyFromFrameId(one.frame_id)
        X_WG = plant.EvalBodyPoseInWorld(context, body) @ one.X_FG
        p_WVset = X_WG.multiply(tessellate(one.surface).p_GVset.T).T
        found[one.structure] = [p_WVset.min(axis=0), p_WVset.max(axis=0)]
    return found


def place(world, name):
    """The middle of a structure, rounded to millimetres."""
    return np.mean(boxes(world)[name], axis=0).round(3).tolist()


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
    cure = r"\(1 of 1 models\).*folder that has crate in the variable GZ_SIM"
    with pytest.raises(InputError, match=cure):
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
        "2 models not found, and left out: model://lost,"
        " https://fuel.gazebosim.org/1.0/a/models/Lost Two (2 of 5 models)"
        in notes
    )
    assert (
        "1 meshes not found, and left out: model://crate/lost.dae (1 of 3"
        " visuals)" in notes
    )
    assert "1 actors ignored" in notes
    assert "1 visuals of type heightmap ignored" in notes


@pytest.mark.parametrize(("there", "lost"), [(3, 3), (3, 4), (1, 1), (0, 1)])
def test_a_world_of_which_most_is_missing_is_refused(
    tmp_path, models, there, lost
):
    path = write(
        tmp_path,
        *(include("model://crate") for _ in range(there)),
        *(include("model://lost") for _ in range(lost)),
    )
    share = rf"\({lost} of {there + lost} models\)"
    if lost > there:
        with pytest.raises(InputError, match=f"{share}; name the folder"):
            load_world(path, model_paths=[models])
    else:
        notes = "\n".join(load_world(path, model_paths=[models]).notes)
        assert re.search(share, notes)


@pytest.mark.slow
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


@pytest.mark.parametrize("suffix", [".world", ".sdf"])
@pytest.mark.parametrize(
    ("normal", "sides"),
    [
        ("0 0 1", (2.0, 3.0, 0.0)),
        ("0 0 -2", (2.0, 3.0, 0.0)),
        ("1 0 0", (0.0, 3.0, 2.0)),
        ("0 -1 0", (2.0, 0.0, 3.0)),
    ],
)
def test_a_plane_ends_at_its_size(tmp_path, normal, sides, suffix):
    plane = f"<plane><normal>{normal}</normal><size>2 3</size></plane>"
    tilted = link(
        f"<geometry>{plane}</geometry>", pose="<pose>1 0 0 0 0 0</pose>"
    )
    path = write(tmp_path, f"<model name='m'><pose>4 5 6 0 0 0</pose>{tilted}")
    text = path.read_text().replace("</world>", "</model></world>")
    path = path.with_suffix(suffix)
    path.write_text(text)
    world = load_world(path)
    low, high = boxes(world)["m"]
    np.testing.assert_allclose(high - low, sides, atol=2e-4)
    np.testing.assert_allclose((low + high) / 2, [5, 5, 6], atol=1e-4)
    # Its surface is where the file has it.
    face = np.where(np.array(normal.split(), float) > 0, high, low)
    across = np.array(normal.split(), float) != 0
    np.testing.assert_allclose(face[across], np.array([5, 5, 6])[across])
    assert any("1 planes end at their size" in note for note in world.notes)


PLACES = {
    "frame of the world": (
        "<frame name='yard'><pose>10 0 0 0 0 1.5707963267948966</pose></frame>"
        "<model name='m'><pose relative_to='yard'>2 0 1 0 0 0</pose>{link}"
        "</model>",
        [10.0, 2.0, 1.0],
    ),
    "pose without numbers": (
        "<model name='m'><frame name='f'><pose>3 2 1 0 0 0</pose></frame>"
        "<link name='l'><pose relative_to='f'/>{visual}</link></model>",
        [3.0, 2.0, 1.0],
    ),
    "visual without numbers": (
        "<model name='m'><frame name='f'><pose>3 2 1 0 0 0</pose></frame>"
        "<link name='l'><visual name='v'><pose relative_to='f'/>{box}</visual>"
        "</link></model>",
        [3.0, 2.0, 1.0],
    ),
    "joint": (
        "<model name='m'><link name='base'/><joint name='j' type='fixed'>"
        "<pose relative_to='base'>7 0 0 0 0 0</pose><parent>base</parent>"
        "<child>l</child></joint><link name='arm'>"
        "<pose relative_to='j'>0 0 3 0 0 0</pose>{visual}</link>"
        "<link name='l'/></model>",
        [7.0, 0.0, 3.0],
    ),
    "joint at its child": (
        "<model name='m'><link name='l'><pose>0 4 0 0 0 0</pose></link>"
        "<joint name='j' type='fixed'><pose>1 0 0 0 0 0</pose>"
        "<parent>world</parent><child>l</child></joint><link name='arm'>"
        "<pose relative_to='j'/>{visual}</link></model>",
        [1.0, 4.0, 0.0],
    ),
    "placement frame": (
        "<model name='m' placement_frame='f'><pose>5 0 0 0 0 0</pose>"
        "<frame name='f'><pose>0 0 -1 0 0 0</pose></frame>{link}</model>",
        [5.0, 0.0, 1.0],
    ),
    "placement frame of an include": (
        "<include><uri>model://post</uri><name>m</name>"
        "<placement_frame>tip</placement_frame><pose>9 0 1 0 0 0</pose>"
        "</include>",
        [6.0, 0.0, 1.0],
    ),
    "merged include": (
        "<model name='m'><pose>4 0 1 0 0 0</pose><link name='base'/>"
        "<include merge='true'><uri>model://post</uri>"
        "<pose>2 0 0 0 0 0</pose></include><link name='x'>"
        "<pose relative_to='post_link'>3 0 0 0 0 0</pose>{visual}</link>"
        "</model>",
        [9.0, 0.0, 1.0],
    ),
    "frame of a merged include": (
        "<model name='m'><include merge='true'><uri>model://post</uri>"
        "<pose>0 0 0 0 0 3.141592653589793</pose></include><link name='x'>"
        "<pose relative_to='tip'/>{visual}</link></model>",
        [-3.0, 0.0, 0.0],
    ),
}


@pytest.mark.parametrize("case", PLACES)
def test_places_by_frames(tmp_path, models, case):
    body, expected = PLACES[case]
    (models / "post").mkdir()
    inner = link(name="post_link")
    (models / "post" / "model.sdf").write_text(
        f"<sdf version='1.9'><model name='post'>{inner}<frame name='tip'>"
        "<pose relative_to='__model__'>3 0 0 0 0 0</pose></frame></model></sdf>"
    )
    visual = f"<visual name='v'>{BOX}</visual>"
    text = body.format(box=BOX, visual=visual, link=link())
    path = write(tmp_path, "<scene/>", text)
    path.write_text(path.read_text().replace("1.6", "1.9"))
    world = load_world(path, model_paths=[models])
    found = place(world, "m")
    if case.startswith("frame of a merged"):
        found = np.add(boxes(world)["m"][0], [0.5, 0.5, 1.0])
    np.testing.assert_allclose(found, expected, atol=1e-3)
    assert world.notes == ()


def test_a_merged_include_with_a_placement_frame_is_refused(tmp_path, models):
    path = write(
        tmp_path,
        "<model name='m'><include merge='true'><uri>model://crate</uri>"
        "<placement_frame>link</placement_frame></include></model>",
    )
    with pytest.raises(InputError, match="include of crate: a placement_frame"):
        load_world(path, model_paths=[models])


NOTED = {
    "<transparency>1</transparency>": "1 invisible visuals ignored",
    "<transparency>0.3</transparency>": "1 transparent visuals taken as solid",
    "<visibility_flags>0x0</visibility_flags>": "1 invisible visuals ignored",
    "<visibility_flags>3</visibility_flags>": "1 visibility flags ignored",
    "<meta><layer>1</layer></meta>": "1 elements <meta> in <visual> ignored",
    "<material><diffuse>1 1 1 0</diffuse></material>": (
        "1 transparent colours taken as solid"
    ),
    "<scale>2 2 2</scale>": "1 elements <scale> in <visual> ignored",
    "<drake:perception_properties enabled='false'/>"
    "<drake:illustration_properties enabled='false'/>": (
        "1 invisible visuals ignored"
    ),
}


@pytest.mark.parametrize("element", NOTED)
def test_what_would_hide_or_change_a_visual_is_named(tmp_path, element):
    other = f"<model name='other'>{link()}</model>"
    path = write(
        tmp_path, f"<model name='m'>{link(extra=element)}</model>", other
    )
    world = load_world(path)
    assert [note.split(": ")[1] for note in world.notes] == [NOTED[element]]
    assert ("m" in boxes(world)) == ("invisible" not in NOTED[element])


def test_saved_places_and_old_frames_are_named(tmp_path):
    path = write(
        tmp_path,
        f"<model name='m'><pose frame='x'>5 0 1 0 0 0</pose>{link()}</model>"
        "<state world_name='default'><model name='m'>"
        "<pose>8 3 1 0 0 0</pose></model><deletions><name>m</name></deletions>"
        "</state>",
    )
    world = load_world(path)
    assert place(world, "m") == [5.0, 0.0, 1.0]
    assert [note.split(": ")[1] for note in world.notes] == [
        "1 frames of poses in SDF before 1.7 ignored",
        "1 saved deletions (state) ignored",
        "1 saved places of models (state) ignored",
    ]


@pytest.mark.parametrize(
    ("body", "notes"),
    [
        ("<!-- run: gz sim --headless -->\n{model}", []),
        ("{model}", []),
        (
            "{model}<model name='s'><link name='l'><visual name='v'><geometry>"
            "<sphere/></geometry></visual></link></model>",
            ["1 shapes without a size (sphere) made as large as SDF's default"],
        ),
        (
            "{model}<model name='p'><link name='l'><visual name='v'><geometry>"
            "<polyline/><polyline/></geometry></visual></link></model>",
            ["1 visuals of type polyline ignored"],
        ),
        (
            "{model}<joint name='j' type='revolute'><parent>world</parent>"
            "<child>m</child></joint>",
            [],
        ),
    ],
)
@pytest.mark.parametrize("suffix", [".world", ".sdf"])
def test_valid_worlds_are_read(tmp_path, body, notes, suffix):
    model = f"<model name='m'><pose>5 0 1 0 0 0</pose>{link()}</model>"
    path = write(tmp_path, body.format(model=model))
    path = path.rename(path.with_suffix(suffix))
    world = load_world(path)
    assert place(world, "m") == [5.0, 0.0, 1.0]
    assert [note.split(": ")[1] for note in world.notes] == notes


def door(position, axis="axis", more=""):
    """A model with a joint that begins elsewhere than at zero."""
    begins = f"<initial_position>{position}</initial_position>"
    return (
        f"<model name='door'><link name='frame'/>{link()}<joint name='hinge'"
        " type='universal'><parent>frame</parent><child>l</child>"
        f"<axis><xyz>0 0 1</xyz>{begins if axis == 'axis' else ''}</axis>"
        f"<axis2><xyz>1 0 0</xyz>{begins if axis == 'axis2' else ''}</axis2>"
        f"</joint>{more}</model>"
    )


@pytest.mark.parametrize("suffix", [".world", ".sdf"])
@pytest.mark.parametrize(
    ("model", "number"),
    [
        (door("1.2"), 1),
        (door("-1e-3", "axis2"), 1),
        (door("0.0"), 0),
        (door("+0", "axis2"), 0),
        (door(" "), 0),
        (door(""), 0),
        # Controllers are plugins, which are noted as such.
        (
            door(
                "0",
                more="<plugin name='p' filename='f'><initial_position>1"
                "</initial_position></plugin>",
            ),
            0,
        ),
    ],
)
def test_joints_that_do_not_begin_at_zero_are_noted(
    tmp_path, model, number, suffix
):
    path = write(tmp_path, model)
    path = path.rename(path.with_suffix(suffix))
    notes = [one for one in load_world(path).notes if "of joints" in one]
    assert notes == [
        f"{path}: {number} initial positions of joints ignored"
    ] * bool(number)


@pytest.mark.parametrize(
    ("saved", "note"),
    [
        (
            "<link name='l'><pose>1 0 0 0 0 0</pose></link>",
            "1 saved places of models (state) ignored",
        ),
        (
            "<pose>1 0 0 0 0 0</pose><link name='l'><pose/></link>",
            "1 saved places of models (state) ignored",
        ),
        ("<scale>1 2 1</scale>", "1 saved scales of models (state) ignored"),
        ("<scale>1 1.0 1</scale>", None),
    ],
)
def test_what_else_is_saved_of_a_model_is_named(tmp_path, saved, note):
    path = write(
        tmp_path,
        f"<model name='m'><pose>5 0 1 0 0 0</pose>{link()}</model>"
        f"<state world_name='w'><model name='m'>{saved}</model></state>",
    )
    notes = [one.split(": ")[1] for one in load_world(path).notes]
    assert notes == ([note] if note else [])


def test_joints_of_included_models_are_noted(tmp_path, models):
    text = door("0.5").replace("'door'", "'gate'")
    (models / "crate" / "model.sdf").write_text(
        f"<sdf version='1.6'>{text}</sdf>"
    )
    saved = (
        "<state world_name='default'><model name='gate'><joint name='hinge'>"
        "<angle axis='0'>0.5</angle></joint></model></state>"
    )
    path = write(tmp_path, include("model://crate"), saved)
    notes = load_world(path, model_paths=[models]).notes
    assert [one.split(": ")[1] for one in notes if "of joints" in one] == [
        "1 initial positions of joints ignored",
        "1 saved positions of joints (state) ignored",
    ]


def test_a_world_with_blanks_before_its_declaration(tmp_path):
    model = f"<model name='m'><pose>5 0 1 0 0 0</pose>{link()}</model>"
    path = write(tmp_path, model)
    path.write_text("\n <?xml version='1.0'?>" + path.read_text())
    assert place(load_world(path), "m") == [5.0, 0.0, 1.0]


def test_a_fault_has_its_line_below_a_comment(tmp_path):
    path = write(tmp_path, "<!-- a\n--\nb -->\n<model name='m'><pose>x</pose>")
    path.write_text(path.read_text().replace("</world>", "</model></world>"))
    with pytest.raises(InputError, match="line 4: pose: x is no number"):
        load_world(path)


@pytest.mark.parametrize(("size", "is_endless"), [(4999.0, 0), (5001.0, 1)])
def test_the_largest_planes_are_endless(tmp_path, size, is_endless):
    plane = f"<plane><normal>0 0 1</normal><size>{size} {size}</size></plane>"
    model = f"<model name='m'>{link(f'<geometry>{plane}</geometry>')}</model>"
    world = load_world(write(tmp_path, model))
    far = RigidTransform([0.0, 3000.0, 1.0])
    assert len(scan_world(world, far, AROUND)) == (4 if is_endless else 0)


def test_a_world_of_which_nothing_is_seen_says_why(tmp_path):
    extra = "<transparency>1</transparency>"
    path = write(tmp_path, f"<model name='m'>{link(extra=extra)}</model>")
    with pytest.raises(InputError, match=r"no visuals.* \(1 invisible"):
        load_world(path)


def shown(geometry):
    return f"<model name='m'>{link(f'<geometry>{geometry}</geometry>')}</model>"


# Worlds that Drake's own parser would read in another way, or refuse.
ALIKE = {
    "frame of an old pose": (
        "<model name='m'><link name='b'><pose>1 0 0 0 0 0</pose></link>"
        + link(pose="<pose frame='b'>3 0 0 0 0 0</pose>")
        + "</model>"
    ),
    "mesh by model://": shown("<mesh><uri>model://crate/a.obj</uri></mesh>"),
    "mesh by package://": shown(
        "<mesh><uri>package://crate/a.obj</uri><scale>1 -2 3</scale></mesh>"
    ),
    "missing mesh": shown("<mesh><uri>gone.dae</uri></mesh>"),
    "convex hull": shown(
        "<mesh><uri>model://crate/a.obj</uri><drake:declare_convex/></mesh>"
    ),
    "mass below 0": (
        "<model name='m'><link name='l'><inertial><mass>-1</mass></inertial>"
        f"<visual name='v'>{BOX}</visual></link></model>"
    ),
    "joint without its child": (
        f"<model name='m'>{link()}<joint name='j' type='fixed'>"
        "<parent>l</parent><child>gone</child></joint></model>"
    ),
    "reserved name": f"<model name='__m__'>{link()}</model>",
    "one name twice": f"<model name='m'>{link()}{link()}</model>",
    "sphere without a size": shown("<sphere/>"),
    "cone": shown("<cone><radius>1</radius><length>2</length></cone>"),
    "turned in degrees": (
        "<model name='m'><pose degrees='true'>5 0 1 10 20 30</pose>"
        + link(pose="<pose degrees='true'>1 2 3 40 50 60</pose>")
        + "</model>"
    ),
    "model in a model": (
        "<model name='m'><pose>1 2 3 .1 .2 .3</pose><model name='n'>"
        f"<pose>4 5 6 .4 .5 .6</pose>{link()}</model></model>"
    ),
}
BESIDE = {
    "light": ("<light name='sun' type='point'/>", "1 lights ignored"),
    "plugin": ("<plugin name='p' filename='f'/>", "1 plugins ignored"),
    "include": (include("model://sun"), "1 lights ignored"),
    "GUI": ("<gui/>", None),
}


@pytest.mark.parametrize("case", ALIKE)
@pytest.mark.parametrize("version", ["1.6", "1.9"])
def test_what_else_a_world_contains_changes_nothing(
    tmp_path, models, case, version
):
    (models / "crate" / "a.obj").write_text(obj_text())
    far = f"<model name='far'><pose>0 40 0 0 0 0</pose>{link()}</model>"
    found, notes = {}, {}
    for name, (extra, noted) in {"": ("", None), **BESIDE}.items():
        path = write(tmp_path, ALIKE[case], far, extra)
        path.write_text(path.read_text().replace('"1.6"', f'"{version}"'))
        world = load_world(path, model_paths=[models])
        inspector = world.scene_graph.model_inspector()
        found[name] = [
            (
                one.name,
                one.X_FG.GetAsMatrix4().tolist(),
                tessellate(one.surface).p_GVset.tolist(),
            )
            for one in read_perception_geometry(inspector)
        ]
        said = [note.split(": ", 1)[1] for note in world.notes]
        notes[name] = [note for note in said if note != noted]
        assert len(said) == len(notes[name]) + (noted is not None)
    assert all(other == found[""] for other in found.values())
    assert all(other == notes[""] for other in notes.values())


@pytest.mark.parametrize(
    "numbers",
    [
        "1 2 3 0 0 0",
        "1 2 3 0.1 -0.2 3",
        "1e3 -2 0 3.14 1.5 -2",
        "5 0 -0 0 0 3.24",
        "-0 6 0 0 0 -4.1",
    ],
)
def test_poses_of_visuals_are_those_of_drake(tmp_path, numbers):
    """Drake's own parser is the oracle, to the bit."""
    pose = f"<pose>{numbers}</pose>"
    path = write(tmp_path, f"<model name='m'>{link(pose=pose)}</model>")
    path.write_text(path.read_text().replace("1.6", "1.9"))
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModelsFromString(path.read_text(), "sdf")
    (expected,), (found,) = (
        list_geometry(graph.model_inspector(), Role.kPerception)
        for graph in (scene_graph, load_world(path).scene_graph)
    )
    assert found.name == expected.name
    bits = found.X_FG.GetAsMatrix34().tobytes()
    assert bits == expected.X_FG.GetAsMatrix34().tobytes()


def test_a_colour_that_is_none_is_refused(tmp_path):
    extra = "<material><diffuse>255 0 0 1</diffuse></material>"
    path = write(tmp_path, f"<model name='m'>{link(extra=extra)}</model>")
    with pytest.raises(InputError, match="diffuse: 255 0 0 1: not within"):
        load_world(path)


def test_models_inside_of_models_stand_still(tmp_path):
    inner = f"<model name='inner'><pose>3 0 0 0 0 0</pose>{link()}</model>"
    outer = (
        "<model name='outer'><pose>1 2 0 0 0 0.3</pose>"
        f"{link(name='own')}{inner}</model>"
    )
    world = load_world(write(tmp_path, outer))
    found = world.scene_graph.model_inspector()
    frames = {
        found.GetFrameId(one)
        for one in found.GetAllGeometryIds(Role.kPerception)
    }
    assert len(frames) == 2
    assert frames <= set(world.anchored_frames())


def test_visuals_are_spread_over_bodies(tmp_path):
    """No body has many: Drake compares the names of each with all others."""
    boxes = "".join(
        f"<visual name='s{k}/part'><pose>{k} 0 0 0 0 0</pose>{BOX}</visual>"
        for k in range(700)
    )
    link = f"<pose>1 2 3 0 0 0.5</pose><link name='city'>{boxes}</link>"
    world = load_world(write(tmp_path, f"<model name='m'>{link}</model>"))
    found = world.scene_graph.model_inspector()
    ids = found.GetAllGeometryIds(Role.kPerception)
    names = [found.GetName(one) for one in ids]
    assert names == [f"m::s{k}/part" for k in range(700)]
    frames = Counter(found.GetFrameId(one) for one in ids)
    assert max(frames.values()) <= 250
    assert frames.keys() <= world.anchored_frames()
    context = world.plant.CreateDefaultContext()
    for frame in frames:
        body = world.plant.GetBodyFromFrameId(frame)
        X_WB = body.EvalPoseInWorld(context)
        assert X_WB.IsNearlyEqualTo(
            RigidTransform(RollPitchYaw(0, 0, 0.5), [1, 2, 3]), 1e-12
        )


def test_meshes_out_of_sight_are_not_loaded(tmp_path):
    """What is in sight is the same, and so are the table and the notes."""
    folder = write(tmp_path).parent
    visuals = ""
    # The last two have the same mesh, too large to share it at one scale.
    for k in range(6):
        name, faces = f"house_{min(k, 4)}.obj", "f 1 2 3\n" * (k // 4 << 17)
        (folder / name).write_text(f"{obj_text()}{faces}l 1 2\n")
        mesh = f"<mesh><uri>{name}</uri><scale>2 2 {2 + k // 5}</scale></mesh>"
        visuals += (
            f"<visual name='house_{k}/wall'><pose>{100 * k} 0 0 0 0 1</pose>"
            f"<geometry>{mesh}</geometry></visual>"
        )
    # The origin of rays is in the middle of all places.
    for k, x in enumerate((-50, 450)):
        visuals += (
            f"<visual name='post_{k}/a'><pose>{x} 0 0 0 0 0</pose>{BOX}"
            "</visual>"
        )
    path = write(
        tmp_path, f"<model name='m'><link name='a'>{visuals}</link></model>"
    )
    asked = []

    def in_sight(boxes):
        asked.extend(boxes.tolist())
        return boxes[:, 0, 0] < 150.0

    whole, part = load_world(path), load_world(path, in_sight=in_sight)
    assert len(asked) == 6
    low, high = np.array(asked)[3]
    turned = RigidTransform(RollPitchYaw(0, 0, 1), [300, 0, 0])
    corners = turned @ (2.0 * L_VERTICES).T
    assert (low <= corners.min(axis=1) + 1e-9).all()
    assert (high >= corners.max(axis=1) - 1e-9).all()
    near = ["house_0", "house_1", "house_5", "post_0", "post_1"]
    geometries = read_perception_geometry(part.scene_graph.model_inspector())
    assert [one.structure for one in geometries] == near
    assert list(part.structures) == list(whole.structures)
    assert part.notes == whole.notes
    assert len(part.notes) == 5


@pytest.mark.parametrize(
    ("counts", "fault"),
    [
        ((2, 3), None),
        ((401,), "parts stand for 103863, because"),
        ((10,) * 30, "parts stand for 2[0-9]{32}, because"),
    ],
)
def test_files_that_include_each_other_are_counted_first(
    tmp_path, models, counts, fault
):
    """Each is looked at once, so a few lines cannot take memory or time."""
    link = f"<link name='l'><visual name='v'>{BOX}</visual></link>"
    for depth, count in enumerate((*counts, 0)):
        inner = "".join(
            include(f"model://m{depth + 1}", f"<name>n{k}</name>")
            for k in range(count)
        )
        folder = models / f"m{depth}"
        folder.mkdir()
        (folder / "model.sdf").write_text(
            f"<sdf version='1.9'><model name='m'>{inner or link}</model></sdf>"
        )
    path = write(tmp_path, include("model://m0"))
    if fault is None:
        load_world(path, model_paths=[models])
        return
    with pytest.raises(InputError, match=fault):
        load_world(path, model_paths=[models])
