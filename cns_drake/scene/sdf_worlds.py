"""Reads the visuals of SDF worlds, at their initial places.

Drake parses only the frames: models, links and their poses. The visuals do not
pass through Drake's parser, because it is slow on cities, refuses much of what
worlds for Gazebo contain, and reads some of it differently from Gazebo. Nothing
in such a world moves.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
import contextlib
import copy
from dataclasses import dataclass
import math
from pathlib import Path
from typing import NamedTuple, TypeAlias
from urllib.parse import unquote
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    Rgba,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from cns_drake.scene.mesh_files import mesh_shape_key
from cns_drake.scene.model_check import SIZES, lacks_size, read_model
from cns_drake.scene.model_finder import (
    ModelFinder,
    model_file,
    note_of_missing,
)
from cns_drake.scene.obj_files import ObjFiles
from cns_drake.scene.surfaces import LARGEST_SIZE, MOST_COPIED_TRIANGLES
from evaluation.base import InputError, check_expansion, value_errors

# Boxes (N, 2, 3) in the world [m], each its least and greatest coordinates ->
# (N,) bool, whether anything in a box can be seen.
InSight: TypeAlias = Callable[[np.ndarray], np.ndarray]

# Elements that are left out -> how a note calls them.
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
# Element -> child elements that are read, or that neither show nor move
# anything.
_KNOWN = {
    "world": (
        "model", "include", "frame", "joint", "state", "gravity", "physics",
        "magnetic_field", "atmosphere", "scene", "gui", "wind", "audio",
        "spherical_coordinates",
    ),
    "model": (
        "pose", "model", "include", "frame", "joint", "link", "static",
        "self_collide", "allow_auto_disable", "enable_wind", "gripper",
    ),
    "include": ("uri", "name", "pose", "placement_frame", "static"),
    "link": (
        "pose", "visual", "inertial", "collision", "gravity", "enable_wind",
        "self_collide", "kinematic", "must_be_base_link", "velocity_decay",
        "audio_source", "audio_sink", "battery",
    ),
    "visual": (
        "pose", "geometry", "material", "transparency", "visibility_flags",
        "cast_shadows", "laser_retro",
    ),
    "mesh": ("uri", "scale", "submesh"),
    **{shape: tuple(sizes) for shape, sizes in SIZES.items()},
    "plane": ("normal", "size"),
}  # fmt: skip
_ATTRIBUTES = {
    "world": ("name",),
    "model": ("name", "canonical_link", "placement_frame"),
    "include": ("merge",),
    "link": ("name",),
    "visual": ("name",),
    "pose": ("relative_to", "rotation_format", "degrees", "frame"),
    "mesh": ("optimization",),
}
# Prefixes of names that SDF leaves to programs; Drake reads its own.
_CUSTOM = ("drake:", "gz:", "ignition:")
# Shape -> its class, and SDF's default of its sizes.
_SHAPES = {
    "box": (Box, (1.0, 1.0, 1.0)),
    "sphere": (Sphere, (1.0,)),
    "cylinder": (Cylinder, (1.0, 1.0)),
    "capsule": (Capsule, (0.5, 1.0)),
    "ellipsoid": (Ellipsoid, (1.0, 1.0, 1.0)),
    "drake:capsule": (Capsule, ()),
    "drake:ellipsoid": (Ellipsoid, ()),
}
# Gazebo's own models, for which no file is needed.
_GROUND = """<model name="ground_plane"><link name="link"><visual name="visual">
<geometry><plane><normal>0 0 1</normal></plane></geometry></visual></link>
</model>"""
# A model within another one costs as much as so many elements: Drake takes 1.4
# MB and 4 ms.
_NESTED_ELEMENTS = 250
# Greatest number of visuals on a body: Drake compares the name of each with the
# names of all others on it.
_MOST_ON_BODY = 250
# Thickness of the box for a plane of finite size, below its surface [m].
_PLANE_THICKNESS = 1e-4
# Size of the box for an infinite plane. Larger shapes would show the single
# precision of rays [m].
_ENDLESS = 5000.0
# Visibility flags of a visual that every sensor sees.
_EVERY_FLAG = 0xFFFFFFFF


class UnseenMesh(NamedTuple):
    """A mesh of a world that is not read, because it is out of sight.

    Attributes:
        name: scoped name of the visual.
        path: the file.
        notes: notes about content of the file that is not read.
    """

    name: str
    path: str
    notes: tuple[str, ...]


def read_sdf_world(
    plant: MultibodyPlant,
    path: Path,
    finder: ModelFinder,
    objs: ObjFiles,
    in_sight: InSight | None = None,
) -> tuple[tuple[str, ...], list[UnseenMesh]]:
    """Adds the visuals of a world or model to a plant, all of them static.

    Args:
        plant: plant that is registered with a SceneGraph, and not finalized.
        path: the SDF file.
        finder: finds included models and meshes.
        objs: reads OBJ files.
        in_sight: tells what is in sight; None if all is.

    Returns:
        Notes for the user on what is left out, and the meshes out of sight,
        which are not added.

    Raises:
        InputError: the file has no world and no model, a model that was found
            cannot be read, or a pose or shape cannot be determined.
        RuntimeError, ValueError, SystemExit: Drake refuses a frame or a shape.
    """
    root = read_model(path, finder)
    worlds = root.findall("world")
    world = worlds[0] if worlds else Element("world", name="world")
    if not worlds:
        if root.find("model") is None:
            raise InputError(f"{path}: has no world and no model of SDF")
        world.extend(root)
    reader = _Reader(path, finder)
    reader.skip("further worlds of the file", len(worlds) - 1)
    reader.add_world(root, world)
    unseen = [] if in_sight is None else reader.leave_out_unseen(objs, in_sight)
    reader.register(plant)
    return reader.notes(), unseen


@dataclass(frozen=True)
class _Visual:
    """A visual of a link L.

    Attributes:
        name: its name.
        frame: name of a frame F of the model; "" for the frame of the link.
        X_FG: pose of the shape's frame G in F.
        shape: its shape.
        properties: properties for each role.
    """

    name: str
    frame: str
    X_FG: RigidTransform
    shape: Shape
    properties: tuple[IllustrationProperties | PerceptionProperties, ...]

    def is_perceived(self) -> bool:
        """Returns whether sensors see it."""
        return any(
            isinstance(one, PerceptionProperties) for one in self.properties
        )


class _Names:
    """Names that are in use, in time that is linear in their number.

    Attributes:
        taken: the names.
        seen: number of elements whose names were taken.
    """

    def __init__(self) -> None:
        self.taken: set[str] = set()
        self.seen = 0
        # A name -> the last number behind it that was free.
        self._numbers: dict[str, int] = {}

    def free(self, element: Element) -> str:
        """Returns an element's name, changed if it is already in use."""
        name = wanted = _legal_name(element.get("name", element.tag))
        number = self._numbers.get(wanted, 1)
        if number > 1:
            name = f"{wanted}_{number}"
        while name in self.taken:
            number += 1
            name = f"{wanted}_{number}"
        self._numbers[wanted] = number
        return name


class _Expanded(NamedTuple):
    """A world, or a model in it.

    Attributes:
        element: its element.
        folder: folder of its file.
        is_nested: whether it is a model within a model.
    """

    element: Element
    folder: Path
    is_nested: bool = False

    def size(self) -> int:
        """Returns the number of its own elements."""
        inner = sum(_num_elements(m) for m in self.element.iterfind("model"))
        own = _num_elements(self.element) - inner
        return own + self.is_nested * _NESTED_ELEMENTS


def _num_elements(element: Element) -> int:
    return sum(1 for _ in element.iter())


def _is_merged(include: Element) -> bool:
    return include.get("merge", "").strip().lower() in ("true", "1")


class _Reader:
    """One pass over a world and all models that it includes."""

    def __init__(self, path: Path, finder: ModelFinder):
        self._path = path
        self._finder = finder
        self._skipped: Counter[str] = Counter()
        self._missing: dict[str, Counter[str]] = {
            "models": Counter(),
            "meshes": Counter(),
        }
        # Numbers of models, and of visuals, that are read.
        self._num_read = Counter({"models": 0, "meshes": 0})
        # Names to which poses and frames refer, without their scopes.
        self._referred: set[str] = set()
        # The frames of the world, as SDF, and the visuals of its links.
        self._frames = Element("world", name="frames")
        self._visuals: dict[Element, list[_Visual]] = {}
        self._meshes: dict[tuple[str, Path], Path | None] = {}
        # Element that is made -> the names of its children.
        self._names: dict[Element, _Names] = {}
        # Root elements of the included files; URI and folder -> included file.
        self._included: dict[Path, Element] = {}
        self._files: dict[tuple[str, Path], Path | None] = {}

    def notes(self) -> tuple[str, ...]:
        """Returns one line for each kind of omitted element."""
        notes = [
            f"{self._path}: {count} {what}"
            for what, count in sorted(self._skipped.items())
        ]
        for what, uris in self._missing.items():
            whole = self._num_read[what] + sum(uris.values())
            notes += note_of_missing(self._path, what, uris, whole)
        return tuple(notes)

    def skip(self, what: str, count: int = 1, how: str = "ignored") -> None:
        """Counts an element that is not shown as the file describes it."""
        if count > 0:
            self._skipped[f"{what} {how}"] += count

    def add_world(self, root: Element, world: Element) -> None:
        """Adds the models of a world; `root` is the root of its file."""
        self._scan_file(root)
        self._count_saved(world)
        folder = self._path.absolute().parent
        with value_errors(f"{self._path}: models that include each other"):
            check_expansion(
                _Expanded(world, folder), self._parts, _Expanded.size
            )
        self._add_children(world, self._frames, folder)

    def _parts(self, whole: _Expanded) -> Iterator[_Expanded]:
        """Yields the models in a world or model, also those it includes."""
        is_world = whole.element.tag == "world"
        for one in whole.element:
            if one.tag == "model":
                yield whole._replace(element=one, is_nested=not is_world)
            elif one.tag == "include":
                file = self._included_file(one, whole.folder)
                if file is None:
                    continue
                model = self._included_root(file).find("model")
                if model is not None:
                    is_nested = not (is_world or _is_merged(one))
                    yield _Expanded(model, file.parent, is_nested)

    def _included_file(self, include: Element, folder: Path) -> Path | None:
        uri = (include.findtext("uri") or "").strip()
        if (uri, folder) not in self._files:
            place = self._finder.find(uri, folder)
            self._files[uri, folder] = (
                None if place is None else (model_file(place))
            )
        return self._files[uri, folder]

    def _included_root(self, file: Path) -> Element:
        if file not in self._included:
            self._included[file] = read_model(file, self._finder)
        return self._included[file]

    def leave_out_unseen(
        self, objs: ObjFiles, in_sight: InSight
    ) -> list[UnseenMesh]:
        """Leaves out meshes that are out of sight, and returns them.

        The origin of rays is in the middle of the places of all geometry (see
        `ray_casting`), so what is beyond the others' places stays. So do meshes
        whose copies share one surface, and what other poses move.
        """
        # Visual -> path and key of its mesh: Drake takes long to tell them.
        meshes = {
            id(visual): (
                str(visual.shape.source().path()),
                mesh_shape_key(visual.shape),
            )
            for visuals in self._visuals.values()
            for visual in visuals
            if isinstance(visual.shape, Mesh)
        }
        copies = Counter(key for _, key in meshes.values())
        unseen = []
        for scope, visuals in self._unmoved():
            far: dict[int, UnseenMesh] = {}
            boxes = []
            for visual in visuals:
                if id(visual) not in meshes or visual.frame:
                    continue
                path, mesh = meshes[id(visual)]
                found = _box_of_mesh(objs, path, visual, copies[mesh])
                if found is not None:
                    name = f"{scope}::{visual.name}"
                    far[id(visual)] = UnseenMesh(name, path, found[1])
                    boxes.append(found[0])
            if not far:
                continue
            for key, is_near in zip(
                [*far], in_sight(np.array(boxes)).tolist(), strict=True
            ):
                if is_near:
                    del far[key]
            low, high = _places_of(v for v in visuals if id(v) not in far)
            for visual in visuals:
                p = visual.X_FG.translation()
                if not ((low <= p) & (p <= high)).all():
                    far.pop(id(visual), None)
            unseen += [far[id(v)] for v in visuals if id(v) in far]
            visuals[:] = [v for v in visuals if id(v) not in far]
        return unseen

    def _unmoved(self) -> Iterator[tuple[str, list[_Visual]]]:
        """Yields the visuals of links with the axes and origin of the world.

        Each comes with the name of its model.
        """
        for model in self._frames.iterfind("model"):
            if model.find("pose") is None and not model.get("placement_frame"):
                for link in model.iterfind("link"):
                    if link.find("pose") is None:
                        yield model.get("name", ""), self._visuals[link]

    def register(self, plant: MultibodyPlant) -> None:
        """Adds the frames and visuals that were read to a plant."""
        made = Element("sdf", version="1.9")
        made.append(self._frames)
        Parser(plant).AddModelsFromString(tostring(made, "unicode"), "sdf")
        for model in self._frames.iterfind("model"):
            self._register_model(plant, model, "")

    def _register_model(
        self, plant: MultibodyPlant, model: Element, scope: str
    ) -> None:
        name = scope + model.get("name", "")
        for link in model.iterfind("link"):
            visuals = self._visuals[link]
            if not visuals:
                continue
            instance = plant.GetModelInstanceByName(name)
            body = plant.GetBodyByName(link.get("name", ""), instance)
            link_frame = body.body_frame()
            for number, visual in enumerate(visuals):
                if number and number % _MOST_ON_BODY == 0:
                    # No link has this name: SDF reserves the colons.
                    further = f"{body.name()}::{number}"
                    body = plant.AddRigidBody(further, instance)
                    plant.WeldFrames(link_frame, body.body_frame())
                X_LG = visual.X_FG
                if visual.frame:
                    frame = plant.GetFrameByName(visual.frame, instance)
                    X_LG = frame.GetFixedPoseInBodyFrame() @ X_LG
                one = GeometryInstance(X_LG, visual.shape, visual.name)
                for properties in visual.properties:
                    if isinstance(properties, PerceptionProperties):
                        one.set_perception_properties(properties)
                    else:
                        one.set_illustration_properties(properties)
                plant.RegisterVisualGeometry(body, one)
        for inner in model.iterfind("model"):
            self._register_model(plant, inner, f"{name}::")

    def _count_saved(self, world: Element) -> None:
        """Counts what a saved state of the world would change."""
        models = world.findall("state//model")
        placed = [
            model
            for model in models
            if model.find("pose") is not None
            or model.find("link/pose") is not None
        ]
        self.skip("saved places of models (state)", len(placed))
        scales = [(m.findtext("scale") or "1 1 1").split() for m in models]
        scaled = [scale for scale in scales if {*map(float, scale)} != {1.0}]
        self.skip("saved scales of models (state)", len(scaled))
        angles = world.findall("state//joint/angle")
        self.skip("saved positions of joints (state)", len(angles))
        for tag in ("insertions", "deletions"):
            for _ in world.iterfind(f"state/{tag}/*"):
                self.skip(f"saved {tag} (state)")

    def _names_in(self, target: Element) -> _Names:
        """Returns the names of the children of an element that is made."""
        names = self._names.setdefault(target, _Names())
        names.taken |= {part.get("name", "") for part in target[names.seen :]}
        names.seen = len(target)
        return names

    def _scan_file(self, root: Element) -> None:
        """Takes in what concerns a whole file, before its models are added."""
        self._count_moved_joints(root)
        self._record_references(root)

    def _count_moved_joints(self, root: Element) -> None:
        """Counts the initial positions of joints that are not 0."""
        positions = [*root.iterfind(".//joint/axis/initial_position")]
        positions += root.iterfind(".//joint/axis2/initial_position")
        moved = [p for p in positions if float((p.text or "").strip() or 0)]
        self.skip("initial positions of joints", len(moved))

    def _record_references(self, root: Element) -> None:
        """Records the names to which poses and frames of a file refer."""
        for element in root.iter():
            for key in ("relative_to", "attached_to", "placement_frame"):
                self._referred.add(element.get(key, "").split("::")[-1])
            if element.tag == "placement_frame":
                self._referred.add((element.text or "").split("::")[-1].strip())

    def _add_children(
        self, source: Element, target: Element, folder: Path
    ) -> None:
        """Adds the visible parts and the frames of a world or model."""
        self._count_unknown(source)
        for element in source:
            if element.tag == "include":
                self._add_included(element, target, folder)
            elif element.tag == "model":
                self._add_model(element, target, folder)
            elif element.tag == "link":
                self._add_link(element, target, folder)
            elif element.tag == "frame":
                made = SubElement(target, "frame", element.attrib)
                self._copy_pose(element, made)
        taken = {sibling.get("name") for sibling in target}
        for joint in source.iterfind("joint"):
            name = joint.get("name", "")
            child = joint.findtext("child") or ""
            if name in self._referred - taken:
                attached = {"name": name, "attached_to": child.strip()}
                made = SubElement(target, "frame", attached)
                self._copy_pose(joint, made)

    def _count_unknown(self, element: Element) -> None:
        """Counts elements and attributes that are not read."""
        within = element.tag
        for child in element:
            if child.tag in _SKIPPED:
                self.skip(_SKIPPED[child.tag])
            elif child.tag not in _KNOWN[within] and (
                not child.tag.startswith(_CUSTOM)
            ):
                self.skip(f"elements <{child.tag}> in <{within}>")
        self._count_attributes(element)

    def _count_attributes(self, element: Element) -> None:
        for key in element.attrib:
            if key not in _ATTRIBUTES.get(element.tag, ()) and (
                not key.startswith("xmlns")
            ):
                self.skip(f"attributes {key} of <{element.tag}>")

    def _add_included(
        self, include: Element, target: Element, folder: Path
    ) -> None:
        self._count_unknown(include)
        uri = (include.findtext("uri") or "").strip()
        file = self._included_file(include, folder)
        model = None
        if file is not None:
            folder = file.parent
            model = self._read_included(file)
        elif _own_model(uri) == "sun":
            self.skip("lights")
        elif _own_model(uri) == "ground_plane":
            model = fromstring(_GROUND)
        else:
            self._missing["models"][uri] += 1
        if model is None:
            return
        _override_model(model, include)
        if _is_merged(include):
            self._merge(model, target, folder)
        else:
            self._add_model(model, target, folder)

    def _read_included(self, file: Path) -> Element | None:
        """Returns a file's first model, if any; counts all other content."""
        # The model is changed as its include says.
        root = copy.deepcopy(self._included_root(file))
        self._scan_file(root)
        models = root.findall("model")
        lights, actors = root.findall("light"), root.findall("actor")
        self.skip("lights", len(lights))
        self.skip("actors", len(actors))
        self.skip("further models of included files", len(models) - 1)
        if not (models or lights or actors):
            self.skip("included files without a model of SDF")
        return models[0] if models else None

    def _merge(self, model: Element, target: Element, folder: Path) -> None:
        """Adds the parts of a model to the model that includes it (merge)."""
        if model.get("placement_frame"):
            raise InputError(
                f"{self._path}: include of {model.get('name')}: a"
                " placement_frame together with merge is not read"
            )
        own = f"_merged_{self._names_in(target).free(model)}"
        self._copy_pose(model, SubElement(target, "frame", name=own))
        for part in model:
            if part.tag not in ("link", "model", "include", "frame", "joint"):
                continue
            inside = part.iter("pose") if part.tag == "link" else part
            for pose in [child for child in inside if child.tag == "pose"]:
                if pose.get("relative_to") == "__model__":
                    pose.set("relative_to", own)
            attached = part.get("attached_to") or "__model__"
            if part.tag == "frame" and attached == "__model__":
                part.set("attached_to", own)
            elif part.tag in ("link", "model", "include"):
                place = part.find("pose")
                if place is None:
                    place = SubElement(part, "pose")
                if not place.get("relative_to"):
                    place.set("relative_to", own)
        self._add_children(model, target, folder)

    def _add_model(self, model: Element, target: Element, folder: Path) -> None:
        self._num_read["models"] += 1
        made = Element("model", name=self._names_in(target).free(model))
        if model.get("placement_frame"):
            made.set("placement_frame", model.get("placement_frame", ""))
        # Drake does not weld an inner model because the outer one is static.
        SubElement(made, "static").text = "true"
        self._copy_pose(model, made)
        self._add_children(model, made, folder)
        if any(part.tag in ("link", "model", "frame") for part in made):
            target.append(made)

    def _add_link(self, link: Element, target: Element, folder: Path) -> None:
        self._count_unknown(link)
        # A link without visuals stays, because poses can refer to the link.
        made = SubElement(
            target, "link", name=self._names_in(target).free(link)
        )
        self._copy_pose(link, made)
        visuals = self._visuals[made] = []
        names = _Names()
        for element in link.iterfind("visual"):
            name = names.free(element)
            visual = self._read_visual(element, name, made, target, folder)
            if visual is not None:
                self._num_read["meshes"] += 1
                names.taken.add(name)
                visuals.append(visual)

    def _read_visual(
        self,
        visual: Element,
        name: str,
        link: Element,
        model: Element,
        folder: Path,
    ) -> _Visual | None:
        """Returns a visual of a link, or None if it is not shown."""
        geometry = visual.find("geometry")
        element = None if geometry is None else next(iter(geometry), None)
        if element is None:
            return None
        if element.tag not in (*_SHAPES, "plane", "mesh"):
            if element.tag != "empty":
                self.skip(f"visuals of type {element.tag}")
            return None
        self._count_unknown(visual)
        if self._is_invisible(visual):
            return None
        self._count_unknown(element)
        X_VG = None
        shape: Shape | None
        if element.tag == "mesh":
            shape = self._mesh(element, folder)
        elif element.tag == "plane":
            shape, X_VG = self._plane(element)
        else:
            if lacks_size(element):
                what = f"shapes without a size ({element.tag})"
                self.skip(what, how="made as large as SDF's default")
            make, default = _SHAPES[element.tag]
            shape = make(*_sizes(element, default))
        if shape is None:
            return None
        properties = self._properties(visual)
        if not properties:
            self.skip("invisible visuals")
            return None
        frame, X_FG = self._place(visual, link, model)
        if X_VG is not None:
            X_FG = X_FG @ X_VG
        return _Visual(name, frame, X_FG, shape, properties)

    def _place(
        self, visual: Element, link: Element, model: Element
    ) -> tuple[str, RigidTransform]:
        """Returns the name of a frame F, and the pose of a visual V in F.

        F is the link, named "", or a frame that is added to the model, for
        poses that take more than their numbers.
        """
        pose = visual.find("pose")
        if pose is None:
            return "", RigidTransform()
        own = Element("frame", name=f"_visual_of_{link.get('name')}")
        self._copy_pose(visual, own)
        kept = own.find("pose")
        if kept is None:
            return "", RigidTransform()
        if not kept.attrib:
            return "", _pose(kept.text or "")
        own.set("name", self._names_in(model).free(own))
        own.set("attached_to", link.get("name", ""))
        model.append(own)
        return own.get("name", ""), RigidTransform()

    def _mesh(self, element: Element, folder: Path) -> Shape | None:
        """Returns a mesh, or None if its file is missing.

        `folder` is the folder of the file that contains the mesh's URI.
        """
        uri = (element.findtext("uri") or "").strip()
        if (uri, folder) not in self._meshes:
            found = self._finder.find(uri, folder)
            is_file = found is not None and found.is_file()
            self._meshes[uri, folder] = found if is_file else None
        place = self._meshes[uri, folder]
        if place is None:
            self._missing["meshes"][uri] += 1
            return None
        if element.find("submesh") is not None:
            self.skip("choices of a part of a mesh")
        is_convex = element.find("drake:declare_convex") is not None
        make = Convex if is_convex else Mesh
        scale = _numbers(element.findtext("scale")) or [1.0, 1.0, 1.0]
        return make(place, scale3=np.array(scale))

    def _plane(self, element: Element) -> tuple[Shape, RigidTransform]:
        """Returns the shape G of a plane, and its pose in the visual V.

        A plane that ends is a thin box below the plane. As in Gazebo, the
        shortest rotation from z to the normal also rotates the sides.
        """
        normal = _numbers(element.findtext("normal")) or [0.0, 0.0, 1.0]
        sides = _numbers(element.findtext("size"))
        if sides and min(sides) > _ENDLESS:
            what = f"planes of more than {_ENDLESS / 1000:g} km"
            self.skip(what, how="taken as endless")
            sides = []
        if not sides:
            X_VG = HalfSpace.MakePose(np.array(normal), np.zeros(3))
            return HalfSpace(), X_VG
        self.skip("planes", how="end at their size, as Gazebo shows them")
        x, y, z = (value / math.hypot(*normal) for value in normal)
        turn = [1.0 + z, -y, x, 0.0] if z > -1.0 else [0.0, 1.0, 0.0, 0.0]
        turn = [value / math.hypot(*turn) for value in turn]
        down = [-value * _PLANE_THICKNESS / 2.0 for value in (x, y, z)]
        X_VG = RigidTransform(Quaternion(np.array(turn)), down)
        return Box(*sides, _PLANE_THICKNESS), X_VG

    def _is_invisible(self, visual: Element) -> bool:
        """Returns whether Gazebo hides a visual; counts doubtful cases."""
        transparency = _number_in(visual.findtext("transparency"), 0.0)
        flags = _number_in(visual.findtext("visibility_flags"), _EVERY_FLAG)
        if transparency >= 1.0 or flags == 0:
            self.skip("invisible visuals")
            return True
        if transparency > 0.0:
            self.skip("transparent visuals", how="taken as solid")
        if flags != _EVERY_FLAG:
            self.skip("visibility flags")
        return False

    def _properties(
        self, visual: Element
    ) -> tuple[IllustrationProperties | PerceptionProperties, ...]:
        """Returns the properties of a visual for each role that it has."""
        rgba = self._colour(visual.find("material"))
        found: list[IllustrationProperties | PerceptionProperties] = []
        for tag, properties in (
            ("drake:illustration_properties", IllustrationProperties()),
            ("drake:perception_properties", PerceptionProperties()),
        ):
            element = visual.find(tag)
            enabled = "true" if element is None else element.get("enabled", "")
            if enabled.strip().lower() in ("false", "0"):
                continue
            if rgba is not None:
                properties.AddProperty("phong", "diffuse", rgba)
            found.append(properties)
        return tuple(found)

    def _colour(self, material: Element | None) -> Rgba | None:
        if material is None:
            return None
        for tag in ("script", "pbr", "drake:diffuse_map"):
            if material.find(tag) is not None:
                self.skip("materials by script or texture")
        numbers = _numbers(material.findtext("diffuse"))
        if len(numbers) not in (3, 4):
            return None
        if not all(0.0 <= number <= 1.0 for number in numbers):
            text = " ".join((material.findtext("diffuse") or "").split())
            raise InputError(
                f"{self._path}: diffuse: {text}: not within 0 to 1"
            )
        if len(numbers) == 4 and numbers[3] < 1.0:
            self.skip("transparent colours", how="taken as solid")
        # SDF's colours have single precision.
        return Rgba(*np.array(numbers, np.float32).tolist())

    def _copy_pose(self, source: Element, target: Element) -> None:
        pose = source.find("pose")
        if pose is None:
            return
        self._count_attributes(pose)
        # Before SDF 1.7, Gazebo ignored `frame`.
        if pose.get("frame"):
            self.skip("frames of poses in SDF before 1.7")
        kept = {k: v for k, v in pose.attrib.items() if k != "frame"}
        if (pose.text or "").strip():
            SubElement(target, "pose", kept).text = pose.text
        elif pose.get("relative_to"):
            # A pose without numbers is the frame itself.
            SubElement(target, "pose", relative_to=kept["relative_to"])


def _box_of_mesh(
    objs: ObjFiles, path: str, visual: _Visual, copies: int
) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """Returns the box (2, 3) of a mesh G in F, and notes about its file.

    The result is None if the mesh is to be read anyway.
    """
    if not (visual.is_perceived() and path.lower().endswith(".obj")):
        return None
    try:
        faces = objs.faces(path)
    except (InputError, ValueError):
        return None  # Whoever reads it tells the fault.
    if faces.box is None or faces.num_triangles == 0:
        return None
    if copies > 1 and copies * faces.num_triangles > MOST_COPIED_TRIANGLES:
        return None
    assert isinstance(visual.shape, Mesh)
    scaled = faces.box * visual.shape.scale3()
    if not np.abs(scaled).max() <= LARGEST_SIZE:
        return None
    X_FG = visual.X_FG.GetAsMatrix34()
    # The rotated box is largest where each coordinate is.
    sides = X_FG[:, :3, None] * scaled.T
    low, high = sides.min(axis=2).sum(axis=1), sides.max(axis=2).sum(axis=1)
    return np.array([low, high]) + X_FG[:, 3], faces.notes


def _places_of(visuals: Iterable[_Visual]) -> np.ndarray:
    """Returns the box (2, 3) of the places of what rays can meet."""
    places = [
        visual.X_FG.translation()
        for visual in visuals
        if visual.is_perceived() and not isinstance(visual.shape, HalfSpace)
    ]
    if not places:
        return np.array([np.full(3, np.inf), np.full(3, -np.inf)])
    return np.array([np.min(places, axis=0), np.max(places, axis=0)])


def _override_model(model: Element, include: Element) -> None:
    """Gives a model the name, pose and placement frame of its include."""
    name, pose = include.findtext("name"), include.find("pose")
    if name:
        model.set("name", name.strip())
    if pose is not None:
        for old in model.findall("pose"):
            model.remove(old)
        model.append(pose)
    placement = include.findtext("placement_frame")
    if placement:
        model.set("placement_frame", placement.strip())


def _pose(text: str) -> RigidTransform:
    """Returns the pose of six numbers, computed as libsdformat does."""
    numbers = _numbers(text)
    roll, pitch, yaw = (value / 2.0 for value in numbers[3:])
    sr, sp, sy = math.sin(roll), math.sin(pitch), math.sin(yaw)
    cr, cp, cy = math.cos(roll), math.cos(pitch), math.cos(yaw)
    turn = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
    length = math.sqrt(
        turn[0] * turn[0]
        + turn[1] * turn[1]
        + turn[2] * turn[2]
        + turn[3] * turn[3]
    )
    # Adding 0 makes 0 of -0.
    turn = [value / length + 0.0 for value in turn]
    p_FV = [value + 0.0 for value in numbers[:3]]
    return RigidTransform(Quaternion(np.array(turn)), p_FV)


def _sizes(shape: Element, default: tuple[float, ...]) -> list[float]:
    """Returns the sizes of a shape in the order of its class's arguments."""
    found: list[float] = []
    for name, count in SIZES[shape.tag].items():
        begin = len(found)
        text = shape.findtext(name)
        found += default[begin : begin + count]
        if text is not None:
            found[begin:] = _numbers(text)
    return found


def _numbers(text: str | None) -> list[float]:
    """Returns the numbers in a text, which was checked."""
    return [float(word) for word in (text or "").split()]


def _own_model(uri: str) -> str:
    """Returns the name of the model that a URI names, as Gazebo's own have."""
    name = unquote(uri).rstrip("/").rpartition("://")[2]
    name = name.rpartition("/models/")[2].split("/")[0]
    return name.strip().lower().replace(" ", "_")


def _number_in(text: str | None, default: float) -> float:
    """Returns the number in a text, or the default if it has none."""
    for kind in (float, lambda word: int(word, 16)):
        with contextlib.suppress(ValueError):
            return float(kind((text or "").strip()))
    return default


def _legal_name(name: str) -> str:
    """Returns a name without parts that SDF reserves."""
    legal = name.replace("::", "_").strip() or "unnamed"
    if legal.startswith("__") or legal == "world":
        legal = f"model_{legal.strip('_')}"
    return legal
