"""Worlds are read as the tables of docs/formats.md say, element by element."""

from pathlib import Path
import re

from helpers.mesh_texts import obj_text
from helpers.world_variants import same_worlds
import numpy as np
import pytest

from cns_drake.scene import load_world, merge_surfaces, read_perception_geometry
from evaluation.base import InputError

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "formats.md"
ALL_WORLDS = ROOT / "worlds"
BOX = "<geometry><box><size>1 1 1</size></box></geometry>"
VISUAL = f"<visual name='v'>{BOX}</visual>"
LINK = f"<link name='l'>{VISUAL}</link>"


def triangles(world):
    """All triangles of a world in W, rounded, as sorted rows."""
    plant = world.plant
    context = plant.CreateDefaultContext()
    merged = merge_surfaces(
        read_perception_geometry(world.scene_graph.model_inspector()),
        lambda frame: plant.EvalBodyPoseInWorld(
            context, plant.GetBodyFromFrameId(frame)
        ),
    )
    found = merged.p_GVset[merged.triangles].reshape(-1, 9).round(6)
    return found[np.lexsort(found.T)]


def sdf_with(tag):
    """An SDF world with an element where it may stand; None for the others."""
    model = f"<model name='m'><static>1</static>{LINK}{{}}</model>"
    world = "<sdf version='1.9'><world name='w'>{}</world></sdf>"
    inside = {
        "world": model.format(""),
        "sensor": model.format("").replace(
            VISUAL, f"{VISUAL}<sensor name='s' type='camera'/>"
        ),
        "script": model.format("").replace(
            BOX, f"{BOX}<material><script><name>a</name></script></material>"
        ),
        "pbr": model.format("").replace(
            BOX, f"{BOX}<material><pbr><metal/></pbr></material>"
        ),
        "submesh": model.format("").replace(
            "<box><size>1 1 1</size></box>",
            "<mesh><uri>a.obj</uri><submesh><name>b</name></submesh></mesh>",
        ),
        "initial_position": model.format(
            "<link name='k'/><joint name='j' type='revolute'><parent>l</parent>"
            "<child>k</child><axis><xyz>0 0 1</xyz><initial_position>1"
            "</initial_position></axis></joint>"
        ),
        "state": model.format("")
        + "<state world_name='w'><model name='m'><pose>1 0 0 0 0 0</pose>"
        "</model></state>",
        "joint": model.format(
            "<link name='k'/><joint name='j' type='fixed'><parent>l</parent>"
            "<child>k</child></joint>"
        ),
        "diffuse": model.format("").replace(
            BOX, f"{BOX}<material><diffuse>1 0 0 1</diffuse></material>"
        ),
        "mesh": model.format("").replace(
            "<box><size>1 1 1</size></box>", "<mesh><uri>a.obj</uri></mesh>"
        ),
        "include": model.format("") + "<include><uri>thing.sdf</uri></include>",
    }
    shapes = ("cone", "polyline", "heightmap", "image")
    in_visual = {
        "transparency": "<transparency>0.5</transparency>",
        "visibility_flags": "<visibility_flags>3</visibility_flags>",
        "laser_retro": "<laser_retro>9</laser_retro>",
        "cast_shadows": "<cast_shadows>0</cast_shadows>",
    }
    in_link = {
        "inertial": "<inertial><mass>2</mass></inertial>",
        "collision": f"<collision name='c'>{BOX}</collision>",
    }
    in_model = {
        "static": "",
        "self_collide": "<self_collide>0</self_collide>",
        "placement_frame": "",
    }
    if tag in inside:
        return world.format(inside[tag])
    if tag in shapes:
        more = f"<visual name='w'><geometry><{tag}/></geometry></visual>"
        return world.format(model.format("").replace(VISUAL, VISUAL + more))
    if tag in in_visual:
        return world.format(model.format("").replace(BOX, BOX + in_visual[tag]))
    if tag in in_link:
        return world.format(
            model.format("").replace(VISUAL, VISUAL + in_link[tag])
        )
    if tag in in_model:
        return world.format(model.format(in_model[tag]))
    if tag in ("model", "link", "visual", "geometry", "box", "uri", "scale",
               "pose", "frame", "plane", "sphere", "cylinder", "capsule",
               "ellipsoid"):  # fmt: skip
        return None
    return world.format(model.format("") + f"<{tag} name='x'/>")


def urdf_with(tag):
    link = f"<link name='l'><visual>{{}}{BOX_URDF}</visual>{{}}</link>{{}}"
    robot = f"<robot name='r'>{link}</robot>"
    joint = (
        "<link name='k'/><joint name='j' type='revolute'><parent link='l'/>"
        "<child link='k'/><limit effort='1' velocity='1'/>{}</joint>"
    )
    if tag == "texture":
        return robot.format(
            "<material name='m'><texture filename='a.png'/></material>", "", ""
        )
    if tag in ("mimic", "limit", "dynamics"):
        more = "" if tag == "limit" else f"<{tag}/>"
        return robot.format("", "", joint.format(more))
    if tag in ("inertial", "collision"):
        more = "" if tag == "inertial" else BOX_URDF
        return robot.format("", f"<{tag}>{more}</{tag}>", "")
    if tag in ("transmission", "gazebo", "sensor", "ros2_control",
               "xacro:macro"):  # fmt: skip
        return robot.format("", "", f"<{tag} name='x'/>")
    return None


BOX_URDF = "<geometry><box size='1 1 1'/></geometry>"


FORMATS = {
    "SDF": ("w.sdf", sdf_with),
    "URDF": ("w.urdf", urdf_with),
}


def rows():
    """Format, how it is treated, and tag of each element in the tables."""
    text = PAGE.read_text("utf-8")
    for name in FORMATS:
        table = text.partition(f"| | elements of {name} |\n")[2]
        table = table.partition("\n\n")[0]
        for row in table.splitlines()[1:]:
            _, treated, what, _ = row.split("|")
            for tag in re.findall(r"`([\w:]+)`", what.partition(";")[0]):
                if tag not in ("xacro", "drake:"):
                    yield name, treated.strip(), tag


@pytest.mark.parametrize(("name", "treated", "tag"), list(rows()))
def test_elements_are_treated_as_the_tables_say(tmp_path, name, treated, tag):
    file, make = FORMATS[name]
    text = make(tag)
    if text is None:
        # Other tests hold what the elements that are read look like.
        assert treated == "read"
        return
    (tmp_path / "a.obj").write_text(obj_text())
    (tmp_path / "thing.sdf").write_text(
        f"<sdf version='1.9'><model name='t'>{LINK}</model></sdf>"
    )
    path = tmp_path / file
    path.write_text(text)
    if treated == "refused":
        with pytest.raises(InputError, match=re.escape(f"<{tag}>")) as error:
            load_world(path)
        assert "\n" not in str(error.value)
        return
    notes = load_world(path).notes
    assert bool(notes) == (treated == "noted"), notes


WORLDS = {
    "old frames": "<model name='a'><link name='b'><pose>1 0 0 0 0 0</pose>"
    f"</link><link name='l'><pose frame='b'>0 0 0 0 0 0</pose>{VISUAL}"
    "</link></model>",
    "a mesh by package://": "<model name='a'><link name='l'><visual name='v'>"
    "<geometry><mesh><uri>package://pkg/a.obj</uri></mesh></geometry></visual>"
    "</link></model>",
    "a missing mesh": f"<model name='a'><link name='l'>{VISUAL}"
    "<visual name='w'><geometry><mesh><uri>gone.dae</uri></mesh></geometry>"
    "</visual></link></model>",
    "inertia and joints": f"<model name='a'><link name='l'><inertial><mass>-1"
    f"</mass></inertial>{VISUAL}</link><link name='k'>{VISUAL}</link>"
    "<joint name='j' type='revolute'><parent>l</parent><child>k</child><axis>"
    "<xyz>0 0 1</xyz><initial_position>1</initial_position></axis></joint>"
    "</model>",
    "reserved names": f"<model name='world'>{LINK}</model>"
    f"<model name='__x__'>{LINK}</model>",
}


def worlds():
    """Name, file name and text of each world of this module."""
    for name, body in WORLDS.items():
        text = f"<sdf version='1.6'><world name='w'>{body}</world></sdf>"
        yield name, "w.world", text
    for name, treated, tag in rows():
        file, make = FORMATS[name]
        text = make(tag)
        if text is not None and treated != "refused":
            yield f"{name} {tag}", file, text


def assert_read_alike(path):
    """Reads a world, and the same world written otherwise."""

    def read(file):
        loaded = load_world(file, model_paths=[path.parent.parent])
        # What a variant adds is counted.
        return triangles(loaded), {
            note.replace(str(file), "")
            for note in loaded.notes
            if not re.search(r"\d (lights|plugins) ignored$", note)
        }

    expected = read(path)
    other = path.with_name(f"other{path.suffix}")
    for change, text in same_worlds(path).items():
        other.write_text(text, "utf-8")
        found = read(other)
        np.testing.assert_array_equal(found[0], expected[0], change)
        assert found[1] == expected[1], change


@pytest.mark.parametrize(
    ("file", "text"),
    [pytest.param(*row, id=name) for name, *row in worlds()],
)
def test_a_world_is_read_alike_however_it_is_written(tmp_path, file, text):
    folder = tmp_path / "pkg"
    folder.mkdir()
    (folder / "a.obj").write_text(obj_text())
    (folder / "thing.sdf").write_text(
        f"<sdf version='1.9'><model name='t'>{LINK}</model></sdf>"
    )
    path = folder / file
    path.write_text(text)
    assert_read_alike(path)


@pytest.mark.night
@pytest.mark.parametrize(
    "stage", sorted(ALL_WORLDS.glob("*/stage_*.sdf")), ids=str
)
def test_a_shipped_world_is_read_alike_however_it_is_written(tmp_path, stage):
    # The meshes stay where they are.
    for one in stage.parent.iterdir():
        (tmp_path / one.name).symlink_to(one)
    assert_read_alike(tmp_path / stage.name)
