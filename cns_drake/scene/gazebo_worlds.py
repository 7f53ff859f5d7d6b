"""Reduces Gazebo's worlds to their visuals, in SDF that Drake reads.

Drake refuses many elements of such worlds, and crashes on an endless collision
plane among many others. Only the visuals are kept, at their places at the
start: nothing in such a world moves here. Models and files that the worlds
refer to are looked for in the folders that Gazebo searches.
"""

from collections import Counter
from collections.abc import Iterable
import math
import os
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

from cns_drake.base.errors import InputError
from cns_drake.base.xml_elements import read_elements
from cns_drake.scene.model_check import check_model

# Environment variables with folders of models, of old and new Gazebo and
# libsdformat.
_VARIABLES = (
    "GZ_SIM_RESOURCE_PATH",
    "SDF_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GAZEBO_MODEL_PATH",
)
_SCHEMES = ("model://", "package://", "file://")


class ModelFinder:
    """Finds files by the URIs of a world."""

    def __init__(self, world: Path, model_paths: Iterable[Path] = ()):
        """Takes the folders to search; the first one wins.

        They are the given ones, those of the environment, and last the world's
        folder, the one above, and `models` in both.
        """
        folder = world.absolute().parent
        named = [
            Path(place)
            for variable in _VARIABLES
            for place in os.environ.get(variable, "").split(os.pathsep)
            if place
        ]
        near = [folder, folder / "models"]
        near += [folder.parent, folder.parent / "models"]
        self._places = [*map(Path, model_paths), *named, *near]

    def find(self, uri: str, folder: Path) -> Path | None:
        """Returns the file or folder of a URI, None if it is not there.

        It is absolute, `model://<name>/...`, or relative to the folder.
        """
        rest = uri
        for scheme in _SCHEMES:
            rest = rest.removeprefix(scheme)
        if "://" in rest:
            return None
        places = self._places
        if rest == uri:
            places = [folder, *places]
        for place in places:
            path = place / rest
            if path.exists():
                return path.resolve()
            # A model may be in its own folder, or be that folder.
            name, _, within = rest.partition("/")
            if place.name == name and (place / within).exists():
                return (place / within).resolve()
        return None


def model_file(path: Path) -> Path:
    """Returns a model's SDF file: the path, or the file named by its folder.

    Raises:
        InputError: the folder has none.
    """
    if not path.is_dir():
        return path
    for name in ("model.config", "manifest.xml"):
        if (path / name).is_file():
            root = read_xml(path / name)
            versions = sorted(
                root.iter("sdf"), key=lambda sdf: sdf.get("version", "")
            )
            for sdf in reversed(versions):
                file = path / (sdf.text or "").strip()
                if file.is_file():
                    return file
    found = sorted(path.glob("*.sdf"))
    if not found:
        raise InputError(f"{path}: holds no SDF model")
    preferred = path / "model.sdf"
    return preferred if preferred in found else found[0]


def read_xml(path: Path) -> Element:
    """Reads a file.

    Raises:
        InputError: it cannot be read, or is not the XML of a model.
    """
    check_model(path)
    return read_elements(path, encoding="utf-8")


# Elements that mark a world for Gazebo.
_SIGNS = (
    "include", "light", "plugin", "actor", "scene", "gui", "state", "sensor",
    "road", "population", "submesh",
)  # fmt: skip
_ENDLESS_COLLISION = ".//collision/geometry/plane"
# Elements that are left out -> words for them in a note.
_SKIPPED = {
    "light": "lights",
    "plugin": "plugins",
    "actor": "actors",
    "sensor": "sensors",
    "road": "roads",
    "population": "populations",
    "particle_emitter": "particle emitters",
    "projector": "projectors",
}
_SHAPES = (
    "box", "sphere", "cylinder", "capsule", "ellipsoid", "plane", "mesh",
    "drake:capsule", "drake:ellipsoid",
)  # fmt: skip
# Gazebo's own models, which are at hand wherever it is.
_SUN, _GROUND_PLANE = "model://sun", "model://ground_plane"
_GROUND = """<model name="ground_plane"><link name="link"><visual name="visual">
<geometry><plane><normal>0 0 1</normal></plane></geometry></visual></link>
</model>"""
_DEEPEST = 20


def is_gazebo_world(root: Element) -> bool:
    """Returns whether a world has elements of Gazebo's."""
    world = root.find("world")
    return world is not None and (
        world.find(_ENDLESS_COLLISION) is not None
        or any(next(world.iter(sign), None) is not None for sign in _SIGNS)
    )


def simplify_world(
    path: Path, root: Element, model_paths: Iterable[Path] = ()
) -> tuple[str, tuple[str, ...]]:
    """Returns a world of static models with visuals only, and notes.

    Raises:
        InputError: a model that was found cannot be read.
    """
    simplifier = _Simplifier(path, model_paths)
    world = root.find("world")
    assert world is not None
    made = Element("sdf", version="1.9")
    target = SubElement(made, "world", name=_legal(world.get("name", "world")))
    simplifier.add_models(world, target, path.absolute().parent, 0)
    return tostring(made, "unicode"), simplifier.notes()


class _Simplifier:
    """One pass over a world and all included models."""

    def __init__(self, path: Path, model_paths: Iterable[Path]):
        self._path = path
        self._finder = ModelFinder(path, model_paths)
        self._skipped: Counter[str] = Counter()
        self._missing: dict[str, Counter[str]] = {
            "models": Counter(),
            "meshes": Counter(),
        }

    def notes(self) -> tuple[str, ...]:
        """Returns one line for each kind of omitted element."""
        notes = [
            f"{self._path}: {count} {what} ignored"
            for what, count in sorted(self._skipped.items())
            if count
        ]
        for what, uris in self._missing.items():
            if uris:
                some = ", ".join(list(uris)[:3])
                some += ", ..." if len(uris) > 3 else ""
                notes.append(
                    f"{self._path}: {len(uris)} {what} not found, and left "
                    f"out: {some}; name their folder with --model-path"
                )
        return tuple(notes)

    def add_models(
        self, source: Element, target: Element, folder: Path, depth: int
    ) -> None:
        """Adds the models in a world or a model, and included ones."""
        if depth > _DEEPEST:
            raise InputError(f"{self._path}: models include each other")
        for element in source:
            self._skip(element)
            if element.tag == "include":
                self._include(element, target, folder, depth)
            elif element.tag == "model":
                self._add_model(element, target, folder, depth)

    def _skip(self, element: Element) -> None:
        if element.tag in _SKIPPED:
            self._skipped[_SKIPPED[element.tag]] += 1

    def _include(
        self, include: Element, target: Element, folder: Path, depth: int
    ) -> None:
        uri = _local_uri((include.findtext("uri") or "").strip())
        place = self._finder.find(uri, folder)
        if place is not None:
            file = model_file(place)
            root = read_xml(file)
            models, folder = root.findall("model"), file.parent
            self._skipped["lights"] += len(root.findall("light"))
            self._skipped["actors"] += len(root.findall("actor"))
        elif uri.rstrip("/") == _SUN:
            self._skipped["lights"] += 1
            return
        elif uri.rstrip("/") == _GROUND_PLANE:
            models = [fromstring(_GROUND)]
        else:
            self._missing["models"][uri] += 1
            return
        for model in models[:1]:
            name, pose = include.findtext("name"), include.find("pose")
            if name:
                model.set("name", name.strip())
            if pose is not None:
                for old in model.findall("pose"):
                    model.remove(old)
                model.append(pose)
            self._add_model(model, target, folder, depth)

    def _add_model(
        self, model: Element, target: Element, folder: Path, depth: int
    ) -> None:
        made = Element("model", name=_name(model, target))
        if target.tag == "world":
            SubElement(made, "static").text = "true"
        _copy_pose(model, made)
        self.add_models(model, made, folder, depth + 1)
        for frame in model.findall("frame"):
            made.append(frame)
        for link in model.findall("link"):
            self._add_link(link, made, folder)
        if made.find("link") is not None or made.find("model") is not None:
            target.append(made)

    def _add_link(self, link: Element, target: Element, folder: Path) -> None:
        made = Element("link", name=_name(link, target))
        _copy_pose(link, made)
        for element in link:
            self._skip(element)
            if element.tag == "visual":
                self._add_visual(element, made, folder)
        # An invisible element stays if others are placed relative to it.
        target.append(made)

    def _add_visual(
        self, visual: Element, target: Element, folder: Path
    ) -> None:
        geometry = visual.find("geometry")
        shapes = [] if geometry is None else list(geometry)
        if not shapes or shapes[0].tag not in _SHAPES:
            if shapes and shapes[0].tag != "empty":
                self._skipped[f"visuals of type {shapes[0].tag}"] += 1
            return
        shape = shapes[0]
        if shape.tag == "mesh":
            uri = (shape.findtext("uri") or "").strip()
            place = self._finder.find(uri, folder)
            if place is None or not place.is_file():
                self._missing["meshes"][uri] += 1
                return
            mesh = Element("mesh")
            # Drake does not decode percent signs in such a URI.
            SubElement(mesh, "uri").text = f"file://{place}"
            scale = shape.find("scale")
            if scale is not None:
                mesh.append(scale)
            if shape.find("submesh") is not None:
                self._skipped["choices of a part of a mesh"] += 1
            shape = mesh
        made = SubElement(target, "visual", name=_name(visual, target))
        _copy_pose(visual, made)
        SubElement(made, "geometry").append(shape)
        material = visual.find("material")
        if material is not None:
            self._add_material(material, made)

    def _add_material(self, material: Element, target: Element) -> None:
        for tag in ("script", "pbr"):
            if material.find(tag) is not None:
                self._skipped["materials by script or texture"] += 1
        numbers = (material.findtext("diffuse") or "").split()
        try:
            values = [float(number) for number in numbers]
        except ValueError:
            return
        if len(values) in (3, 4) and all(map(math.isfinite, values)):
            made = SubElement(target, "material")
            text = " ".join([*numbers, "1"][:4])
            SubElement(made, "diffuse").text = text


def _local_uri(uri: str) -> str:
    """Returns the local name of a model on a server."""
    if not uri.startswith(("http://", "https://")):
        return uri
    _, _, name = uri.rpartition("/models/")
    return "model://" + name.split("/")[0].strip().lower().replace(" ", "_")


def _copy_pose(source: Element, target: Element) -> None:
    pose = source.find("pose")
    if pose is not None and (pose.text or "").strip():
        # Before version 1.7, `frame` meant nothing.
        pose.attrib.pop("frame", None)
        target.append(pose)


def _name(element: Element, target: Element) -> str:
    """Returns an element's name, or a similar one that is still free."""
    wanted = _legal(element.get("name", element.tag))
    taken = {sibling.get("name") for sibling in target}
    name, count = wanted, 1
    while name in taken:
        count += 1
        name = f"{wanted}_{count}"
    return name


def _legal(name: str) -> str:
    """Returns a name without parts that SDF reserves."""
    legal = name.replace("::", "_").strip() or "unnamed"
    if legal.startswith("__") or legal == "world":
        legal = f"model_{legal.strip('_')}"
    return legal
