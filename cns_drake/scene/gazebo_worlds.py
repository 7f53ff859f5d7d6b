"""Reduces Gazebo worlds to their visuals, as SDF that Drake can read.

Drake rejects many elements of such worlds, and crashes on an infinite collision
plane if there are many other collision shapes. Only the visuals are kept, at
their initial places, and nothing in such a world moves.
"""

from collections import Counter
from collections.abc import Iterable
import contextlib
import math
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

from cns_drake.base.errors import InputError
from cns_drake.scene.model_check import SIZES, lacks_size, read_model
from cns_drake.scene.model_finder import ModelFinder, model_file

# Elements that Drake does not read, or reads differently from Gazebo.
_OF_GAZEBO = (
    "include", "light", "plugin", "actor", "scene", "gui", "state", "sensor",
    "road", "population", "submesh", "transparency", "visibility_flags",
    "cone", "heightmap", "image", "polyline", "initial_position",
)  # fmt: skip
_PLANE_COLLISION = ".//collision/geometry/plane"
_SIZED_PLANE = ".//visual/geometry/plane/size"
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
_SHAPES = (
    "box", "sphere", "cylinder", "capsule", "ellipsoid", "plane", "mesh",
    "drake:capsule", "drake:ellipsoid",
)  # fmt: skip
# Gazebo's own models, for which no file is needed.
_SUN = "model://sun"
_GROUND_PLANE = "model://ground_plane"
_GROUND = """<model name="ground_plane"><link name="link"><visual name="visual">
<geometry><plane><normal>0 0 1</normal></plane></geometry></visual></link>
</model>"""
# Greatest depth of models within models.
_DEEPEST = 20
# Thickness of the box for a plane of finite size, below its surface [m].
_PLANE_THICKNESS = 1e-4
# Size of the box for an infinite plane. Larger shapes would show the single
# precision of rays [m].
_ENDLESS = 5000.0
# Visibility flags of a visual that every sensor sees.
_EVERY_FLAG = 0xFFFFFFFF


def is_gazebo_world(path: Path, root: Element) -> bool:
    """Returns whether a world or model has elements that Drake cannot read.

    Args:
        path: the SDF file.
        root: the root element of the file.
    """
    if root.find("world") is None and root.find("model") is None:
        return False
    return (
        path.suffix.lower() == ".world"
        or root.find(_PLANE_COLLISION) is not None
        or root.find(_SIZED_PLANE) is not None
        or root.find("world/joint") is not None
        or any(next(root.iter(tag), None) is not None for tag in _OF_GAZEBO)
        or any(
            lacks_size(shape)
            for geometry in root.iterfind(".//visual/geometry")
            for shape in geometry
        )
    )


def simplify_world(
    path: Path, root: Element, model_paths: Iterable[Path] = ()
) -> tuple[str, tuple[str, ...]]:
    """Reduces a world or model to static models with visuals.

    Args:
        path: the SDF file.
        root: the root element of the file.
        model_paths: folders in which `model://` is searched first.

    Returns:
        The new world as SDF text; notes for the user on what was left out.

    Raises:
        InputError: a model that was found cannot be read, or the pose of a
            model or visual cannot be determined.
    """
    simplifier = _Simplifier(path, model_paths)
    worlds = root.findall("world")
    world = worlds[0] if worlds else Element("world", name="world")
    if not worlds:
        world.extend(root)
    made = Element("sdf", version="1.9")
    target = SubElement(
        made, "world", name=_legal_name(world.get("name", "world"))
    )
    simplifier.skip("further worlds of the file", len(worlds) - 1)
    simplifier.add_world(root, world, target)
    return tostring(made, "unicode"), simplifier.notes()


class _Simplifier:
    """One pass over a world and all models that it includes."""

    def __init__(self, path: Path, model_paths: Iterable[Path]):
        self._path = path
        self._finder = ModelFinder(path, model_paths)
        self._skipped: Counter[str] = Counter()
        self._missing: dict[str, Counter[str]] = {
            "models": Counter(),
            "meshes": Counter(),
        }
        # Names to which poses and frames refer, without their scopes.
        self._referred: set[str] = set()

    def notes(self) -> tuple[str, ...]:
        """Returns one line for each kind of omitted element."""
        notes = [
            f"{self._path}: {count} {what}"
            for what, count in sorted(self._skipped.items())
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

    def skip(self, what: str, count: int = 1, how: str = "ignored") -> None:
        """Counts an element that is not shown as the file describes it."""
        if count > 0:
            self._skipped[f"{what} {how}"] += count

    def add_world(self, root: Element, world: Element, target: Element) -> None:
        """Adds the models of a world; `root` is the root of its file."""
        self._scan_file(root)
        self._count_saved(world)
        self._add_children(world, target, self._path.absolute().parent, 0)

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
        self, source: Element, target: Element, folder: Path, depth: int
    ) -> None:
        """Adds the visible parts and the frames of a world or model."""
        if depth > _DEEPEST:
            raise InputError(f"{self._path}: models include each other")
        self._count_unknown(source)
        for element in source:
            if element.tag == "include":
                self._add_included(element, target, folder, depth)
            elif element.tag == "model":
                self._add_model(element, target, folder, depth)
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
        self, include: Element, target: Element, folder: Path, depth: int
    ) -> None:
        self._count_unknown(include)
        uri = _local_uri((include.findtext("uri") or "").strip())
        place = self._finder.find(uri, folder)
        model = None
        if place is not None:
            file = model_file(place)
            folder = file.parent
            model = self._read_included(file)
        elif uri.rstrip("/") == _SUN:
            self.skip("lights")
        elif uri.rstrip("/") == _GROUND_PLANE:
            model = fromstring(_GROUND)
        else:
            self._missing["models"][uri] += 1
        if model is None:
            return
        _override_model(model, include)
        if include.get("merge", "").strip().lower() in ("true", "1"):
            self._merge(model, target, folder, depth)
        else:
            self._add_model(model, target, folder, depth)

    def _read_included(self, file: Path) -> Element | None:
        """Returns a file's first model, if any; counts all other content."""
        root = read_model(file)
        self._scan_file(root)
        models = root.findall("model")
        lights, actors = root.findall("light"), root.findall("actor")
        self.skip("lights", len(lights))
        self.skip("actors", len(actors))
        self.skip("further models of included files", len(models) - 1)
        if not (models or lights or actors):
            self.skip("included files without a model of SDF")
        return models[0] if models else None

    def _merge(
        self, model: Element, target: Element, folder: Path, depth: int
    ) -> None:
        """Adds the parts of a model to the model that includes it (merge)."""
        if model.get("placement_frame"):
            raise InputError(
                f"{self._path}: include of {model.get('name')}: a"
                " placement_frame together with merge is not read"
            )
        own = f"_merged_{_free_name(model, target)}"
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
        self._add_children(model, target, folder, depth + 1)

    def _add_model(
        self, model: Element, target: Element, folder: Path, depth: int
    ) -> None:
        made = Element("model", name=_free_name(model, target))
        if model.get("placement_frame"):
            made.set("placement_frame", model.get("placement_frame", ""))
        if target.tag == "world":
            SubElement(made, "static").text = "true"
        self._copy_pose(model, made)
        self._add_children(model, made, folder, depth + 1)
        if any(part.tag in ("link", "model", "frame") for part in made):
            target.append(made)

    def _add_link(self, link: Element, target: Element, folder: Path) -> None:
        self._count_unknown(link)
        # A link without visuals stays, because poses can refer to the link.
        made = SubElement(target, "link", name=_free_name(link, target))
        self._copy_pose(link, made)
        for visual in link.iterfind("visual"):
            self._add_visual(visual, made, target, folder)

    def _add_visual(
        self, visual: Element, link: Element, model: Element, folder: Path
    ) -> None:
        geometry = visual.find("geometry")
        shapes = [] if geometry is None else list(geometry)
        if not shapes or shapes[0].tag not in _SHAPES:
            if shapes and shapes[0].tag != "empty":
                self.skip(f"visuals of type {shapes[0].tag}")
            return
        self._count_unknown(visual)
        if self._is_invisible(visual):
            return
        shape = shapes[0]
        made = Element("visual", name=_free_name(visual, link))
        self._copy_pose(visual, made)
        self._count_unknown(shape)
        if shape.tag == "mesh":
            mesh = self._located_mesh(shape, folder)
            if mesh is None:
                return
            shape = mesh
        elif shape.tag == "plane" and shape.find("size") is not None:
            sides = map(float, (shape.findtext("size") or "").split())
            if min(sides) > _ENDLESS:
                what = f"planes of more than {_ENDLESS / 1000:g} km"
                self.skip(what, how="taken as endless")
            else:
                shape = _thin_box(shape, made, link, model)
                how = "end at their size, as Gazebo shows them"
                self.skip("planes", how=how)
        elif lacks_size(shape):
            what = f"shapes without a size ({shape.tag})"
            self.skip(what, how="made as large as SDF's default")
        kept = SubElement(SubElement(made, "geometry"), shape.tag)
        kept.extend(part for part in shape if part.tag in _KNOWN[shape.tag])
        made.extend(part for part in visual if part.tag.startswith("drake:"))
        link.append(made)
        material = visual.find("material")
        if material is not None:
            self._add_material(material, made)

    def _located_mesh(self, shape: Element, folder: Path) -> Element | None:
        """Returns a mesh with the path of its file, or None if it is missing.

        `folder` is the folder of the file that contains the mesh's URI.
        """
        uri = (shape.findtext("uri") or "").strip()
        place = self._finder.find(uri, folder)
        if place is None or not place.is_file():
            self._missing["meshes"][uri] += 1
            return None
        mesh = Element("mesh")
        # Drake does not decode percent signs in such a URI.
        SubElement(mesh, "uri").text = f"file://{place}"
        scale = shape.find("scale")
        if scale is not None:
            mesh.append(scale)
        if shape.find("submesh") is not None:
            self.skip("choices of a part of a mesh")
        return mesh

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

    def _add_material(self, material: Element, target: Element) -> None:
        for tag in ("script", "pbr"):
            if material.find(tag) is not None:
                self.skip("materials by script or texture")
        numbers = (material.findtext("diffuse") or "").split()
        try:
            values = [float(number) for number in numbers]
        except ValueError:
            return
        if len(values) in (3, 4) and all(map(math.isfinite, values)):
            if len(values) == 4 and values[3] < 1.0:
                self.skip("transparent colours", how="taken as solid")
            made = SubElement(target, "material")
            text = " ".join([*numbers, "1"][:4])
            SubElement(made, "diffuse").text = text

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


def _thin_box(
    plane: Element, visual: Element, link: Element, model: Element
) -> Element:
    """Returns a thin box for a plane of finite size, and places its visual.

    As in Gazebo, the shortest rotation from z to the normal also rotates the
    sides. The numbers of the plane must be valid.
    """
    words = (plane.findtext("normal") or "").split() or ["0", "0", "1"]
    normal = [float(word) for word in words]
    x, y, z = (value / math.hypot(*normal) for value in normal)
    # The pose of the visual becomes a frame, and the box lies below it.
    own = link.get("name", "")
    frame = Element("frame", name=f"_plane_of_{own}", attached_to=own)
    frame.set("name", _free_name(frame, model))
    model.append(frame)
    frame.extend(visual.findall("pose"))
    for pose in visual.findall("pose"):
        visual.remove(pose)
    box = Element("box")
    SubElement(
        box, "size"
    ).text = f"{(plane.findtext('size') or '').strip()} {_PLANE_THICKNESS}"
    turn = [-y, x, 0.0, 1.0 + z] if z > -1.0 else [1.0, 0.0, 0.0, 0.0]
    turn = [value / math.hypot(*turn) for value in turn]
    down = [-value * _PLANE_THICKNESS / 2.0 for value in (x, y, z)]
    pose = SubElement(visual, "pose", relative_to=frame.get("name", ""))
    pose.set("rotation_format", "quat_xyzw")
    pose.text = " ".join(map(repr, [*down, *turn]))
    return box


def _local_uri(uri: str) -> str:
    """Returns a local URI for the model that a server's URI names."""
    if not uri.startswith(("http://", "https://")):
        return uri
    _, _, name = uri.rpartition("/models/")
    return "model://" + name.split("/")[0].strip().lower().replace(" ", "_")


def _number_in(text: str | None, default: float) -> float:
    """Returns the number in a text, or the default if it has none."""
    for kind in (float, lambda word: int(word, 16)):
        with contextlib.suppress(ValueError):
            return float(kind((text or "").strip()))
    return default


def _free_name(element: Element, target: Element) -> str:
    """Returns an element's name, changed if it is already in use."""
    wanted = _legal_name(element.get("name", element.tag))
    taken = {sibling.get("name") for sibling in target}
    name = wanted
    count = 1
    while name in taken:
        count += 1
        name = f"{wanted}_{count}"
    return name


def _legal_name(name: str) -> str:
    """Returns a name without parts that SDF reserves."""
    legal = name.replace("::", "_").strip() or "unnamed"
    if legal.startswith("__") or legal == "world":
        legal = f"model_{legal.strip('_')}"
    return legal
