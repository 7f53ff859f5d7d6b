"""Reads the visible geometry of MJCF models, at their initial places.

A member of the family of world readers. Drake's parser reads what this module
leaves of a file: elements that neither show nor move anything are removed, and
elements that Drake does not read are refused.
"""

from collections import Counter
from collections.abc import Mapping
import os
from pathlib import Path
from typing import NoReturn
from xml.etree.ElementTree import Element, tostring

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from cns_drake.base import InputError
from cns_drake.scene.drake_errors import collected_warnings
from cns_drake.scene.model_check import read_model
from cns_drake.scene.model_finder import ModelFinder, note_of_missing

_PLACE = "pos quat axisangle euler xyaxes zaxis"
# Element -> child elements that are read.
_READ = {
    "mujoco": "compiler default asset worldbody",
    "compiler": "",
    "default": "default geom mesh material",
    "asset": "mesh material",
    "material": "",
    "mesh": "",
    "worldbody": "body geom",
    "body": "body geom joint freejoint",
    "geom": "",
    "joint": "",
    "freejoint": "",
}
# Element -> child elements that neither show nor move anything.
_HARMLESS = {
    "mujoco": "option size visual statistic custom contact equality tendon"
    " actuator sensor extension",
    "default": "joint site camera light pair equality tendon general motor"
    " position velocity intvelocity damper cylinder muscle adhesion",
    "asset": "texture",
    "material": "layer",
    "worldbody": "site camera light",
    "body": "inertial site camera light",
}
# Element -> attributes that are read.
_ATTRIBUTES = {
    "mujoco": "model",
    "compiler": "angle eulerseq meshdir assetdir",
    "default": "class",
    "material": "name class rgba",
    "mesh": "name class file scale",
    "body": f"name childclass {_PLACE}",
    "geom": f"name class type size mesh fromto rgba material group {_PLACE}",
    "joint": "name class type pos axis",
    "freejoint": "name",
}
# Element -> attributes that neither show nor move anything. All attributes of
# joints are of this kind, because all joints stay where the file has them.
_HARMLESS_ATTRIBUTES = {
    "compiler": "texturedir autolimits inertiafromgeom inertiagrouprange"
    " balanceinertia boundmass boundinertia settotalmass convexhull usethread"
    " fusestatic exactmeshinertia alignfree saveinertial fitaabb",
    "material": "texture texrepeat texuniform emission specular shininess"
    " reflectance metallic roughness",
    "mesh": "inertia smoothnormal maxhullvert content_type",
    "body": "mocap gravcomp user sleep",
    "geom": "contype conaffinity condim priority friction mass density solmix"
    " solref solimp margin gap shellinertia fluidshape fluidcoef user",
}
# Attribute -> its only value that is read.
_ONLY = {
    ("compiler", "coordinate"): "local",
    ("compiler", "discardvisual"): "false",
    ("compiler", "strippath"): "false",
}
# MuJoCo and Drake show no geoms of this group or a greater one.
_HIDDEN_GROUP = 3


def read_mjcf_world(
    plant: MultibodyPlant, path: Path, finder: ModelFinder
) -> tuple[str, ...]:
    """Adds the visible geoms of a model to a plant; returns notes.

    Args:
        plant: plant that is registered with a SceneGraph, and not finalized.
        path: the MJCF file.
        finder: finds the meshes.

    Raises:
        InputError: the file cannot be read, or has an element or an attribute
            that is not read and could change a shape.
        RuntimeError, ValueError, SystemExit: Drake refuses the model.
    """
    model = read_model(path)
    if model.tag != "mujoco":
        raise InputError(f"{path}: <{model.tag}> is no MJCF (<mujoco>)")
    reader = _Reader(path, finder)
    reader.reduce(model)
    # Drake needs the name, which MJCF does not.
    model.set("model", model.get("model") or "model")
    with collected_warnings() as warnings:
        Parser(plant).AddModelsFromString(tostring(model, "unicode"), "xml")
    for warning in warnings:
        text = " ".join(warning.split()).rpartition("warning: ")[2]
        raise InputError(f"{path}: Drake warns: {text}{_CURE}")
    return reader.notes()


_CURE = "; MuJoCo's mj_saveLastXML writes the model without it"


class _Reader:
    """One pass over a model, which removes what is not visible."""

    def __init__(self, path: Path, finder: ModelFinder):
        self._path = path
        self._finder = finder
        self._counts: Counter[str] = Counter()
        self._missing: list[str] = []
        self._folder = path.absolute().parent
        self._mesh_folder = ""

    def notes(self) -> tuple[str, ...]:
        """Returns one line for each kind of what is not as in the file."""
        notes = [
            f"{self._path}: {count} {what}"
            for what, count in sorted(self._counts.items())
        ]
        missing = note_of_missing(self._path, "meshes", self._missing)
        return (*notes, *missing)

    def reduce(self, model: Element) -> None:
        """Reduces a model to what is read.

        Raises:
            InputError: something is not read.
        """
        for compiler in model.iterfind("compiler"):
            for key in ("assetdir", "meshdir"):
                if key in compiler.attrib:
                    self._mesh_folder = compiler.attrib.pop(key)
        self._reduce(model)
        self._find_meshes(model)

    def _reduce(self, element: Element) -> None:
        tag = element.tag
        for key, value in list(element.attrib.items()):
            if tag == "joint" and key not in _words(_ATTRIBUTES, tag):
                del element.attrib[key]
            elif (tag, key) in _ONLY or key in _words(
                _HARMLESS_ATTRIBUTES, tag
            ):
                if _ONLY.get((tag, key), value) != value:
                    self._refuse(f"{key}={value} of <{tag}>")
                del element.attrib[key]
            elif key not in _words(_ATTRIBUTES, tag):
                self._refuse(f"{key} of <{tag}>")
        for child in list(element):
            if child.tag in _words(_READ, tag):
                self._reduce(child)
            elif child.tag in _words(_HARMLESS, tag):
                element.remove(child)
            elif (tag, child.tag) == ("mujoco", "keyframe"):
                self._counts["saved states (keyframe) ignored"] += 1
                element.remove(child)
            else:
                self._refuse(f"<{child.tag}> in <{tag}>")
        if tag == "geom":
            self._count(element)

    def _count(self, geom: Element) -> None:
        group = geom.get("group", "0")
        if group.isdigit() and int(group) >= _HIDDEN_GROUP:
            what = f"geoms of group {_HIDDEN_GROUP} or higher left out"
            self._counts[what] += 1
            return
        if geom.get("type") == "plane":
            self._counts["planes taken as endless"] += 1
        colour = geom.get("rgba", "").split()
        if len(colour) == 4 and colour[3].rstrip("0.") != "1":
            self._counts["transparent geoms taken as solid"] += 1

    def _find_meshes(self, model: Element) -> None:
        """Writes the places of the meshes; removes what refers to none."""
        gone = set()
        for asset in model.iterfind("asset"):
            for mesh in asset.findall("mesh"):
                uri = mesh.get("file")
                if uri is None:
                    self._refuse("<mesh> without a file")
                place = uri
                if "://" not in uri:  # An absolute path stays as it is.
                    place = os.path.join(self._mesh_folder, uri)
                found = self._finder.find(place, self._folder)
                if found is None or not found.is_file():
                    self._missing.append(uri)
                    gone.add(mesh.get("name", Path(uri).stem))
                    asset.remove(mesh)
                else:
                    mesh.set("name", mesh.get("name", Path(uri).stem))
                    mesh.set("file", str(found))
        for parent in list(model.iter()):
            for geom in parent.findall("geom"):
                if geom.get("mesh") in gone:
                    parent.remove(geom)

    def _refuse(self, what: str) -> NoReturn:
        raise InputError(f"{self._path}: {what} of MJCF is not read{_CURE}")


def _words(table: Mapping[str, str], tag: str) -> list[str]:
    return table.get(tag, "").split()
