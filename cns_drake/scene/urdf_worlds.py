"""Reads the visuals of URDF models, with all joints at zero.

A member of the family of world readers. Drake's parser reads what this module
leaves of a file.
"""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, tostring

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from cns_drake.scene.model_check import read_model
from cns_drake.scene.model_finder import ModelFinder, note_of_missing
from evaluation.base import InputError

# Element -> child elements that are read.
_READ = {
    "robot": "link joint material",
    "link": "visual",
    "visual": "origin geometry material",
    "geometry": "box cylinder sphere capsule mesh drake:capsule"
    " drake:ellipsoid",
    "material": "color",
    "joint": "origin parent child axis",
    "mesh": "drake:declare_convex",
}
# Element -> child elements that neither show nor move anything.
_HARMLESS = {
    "robot": "gazebo transmission sensor ros2_control drake:*",
    "link": "inertial collision self_collision_checking drake:*",
    "joint": "limit dynamics calibration safety_controller drake:*",
    "visual": "drake:*",
}
# Element -> attributes that are read, or that neither show nor move anything.
_ATTRIBUTES = {
    "robot": "name version",
    "link": "name type",
    "visual": "name",
    "origin": "xyz rpy",
    "box": "size",
    "cylinder": "radius length",
    "sphere": "radius",
    "capsule": "radius length",
    "drake:capsule": "radius length",
    "drake:ellipsoid": "a b c",
    "mesh": "filename scale",
    "material": "name",
    "color": "rgba",
    "joint": "name type",
    "parent": "link",
    "child": "link",
    "axis": "xyz",
}


def read_urdf_world(
    plant: MultibodyPlant, path: Path, finder: ModelFinder
) -> tuple[str, ...]:
    """Adds the visuals of a URDF file to a plant; returns notes.

    Args:
        plant: plant that is registered with a SceneGraph, and not finalized.
        path: the file.
        finder: finds the meshes.

    Raises:
        InputError: the file cannot be read, or contains macros of xacro.
        RuntimeError, ValueError, SystemExit: Drake refuses the model.
    """
    robot = read_model(path, finder)
    if robot.tag != "robot":
        raise InputError(f"{path}: <{robot.tag}> is no URDF (<robot>)")
    for element in robot.iter():
        if element.tag.startswith("xacro:"):
            raise InputError(
                f"{path}: <{element.tag}> of xacro is not read; the program"
                " xacro writes the URDF"
            )
    counts: Counter[str] = Counter()
    _leave_out_shapes(robot, counts)
    _reduce(robot, counts)
    _drop_colourless(robot)
    num_visuals = len(robot.findall("link/visual"))
    missing = _find_meshes(robot, path, finder)
    text = tostring(robot, "unicode")
    Parser(plant).AddModelsFromString(text, "urdf")
    notes = [
        f"{path}: {count} {what} ignored"
        for what, count in sorted(counts.items())
    ]
    return (*notes, *note_of_missing(path, "meshes", missing, num_visuals))


def _leave_out_shapes(robot: Element, counts: Counter[str]) -> None:
    """Removes and counts the visuals of a shape that is not read."""
    for link in robot.iterfind("link"):
        for visual in link.findall("visual"):
            shape = visual.find("geometry/*")
            if shape is not None and shape.tag not in _words(_READ, "geometry"):
                counts[f"visuals of type {shape.tag}"] += 1
                link.remove(visual)


def _reduce(element: Element, counts: Counter[str]) -> None:
    """Removes what is not read from an element; counts what might show."""
    tag = element.tag
    for key in list(element.attrib):
        if key not in _words(_ATTRIBUTES, tag) and not key.startswith("xmlns"):
            counts[f"attributes {key} of <{tag}>"] += 1
            del element.attrib[key]
    for child in list(element):
        if child.tag in _words(_READ, tag):
            _reduce(child, counts)
            continue
        element.remove(child)
        is_drakes = child.tag.startswith("drake:")
        name = "drake:*" if is_drakes else child.tag
        if name not in _words(_HARMLESS, tag):
            counts[f"elements <{child.tag}> in <{tag}>"] += 1


def _drop_colourless(robot: Element) -> None:
    """Removes materials that have no colour anywhere, which Drake refuses."""
    coloured = {
        material.get("name")
        for material in robot.iter("material")
        if material.find("color") is not None
    }
    for parent in list(robot.iter()):
        for material in parent.findall("material"):
            if material.get("name") not in coloured:
                parent.remove(material)


def _find_meshes(
    robot: Element, path: Path, finder: ModelFinder
) -> Counter[str]:
    """Writes the places of the meshes; removes and counts missing ones."""
    missing: Counter[str] = Counter()
    for link in robot.iterfind("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                continue
            uri = mesh.get("filename", "")
            found = finder.find(uri, path.absolute().parent)
            if found is None or not found.is_file():
                missing[uri] += 1
                link.remove(visual)
            else:
                mesh.set("filename", f"file://{found}")
    return missing


def _words(table: Mapping[str, str], tag: str) -> list[str]:
    return table.get(tag, "").split()
