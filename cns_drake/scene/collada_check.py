"""Checks COLLADA files for contents that Open3D reads wrongly or not at all.

A member of the family of checks of mesh formats. Specification:
https://www.khronos.org/files/collada_spec_1_4.pdf
"""

from collections import Counter
from collections.abc import Iterator
import math
from pathlib import Path
from typing import cast
from xml.etree import ElementTree

import numpy as np

from evaluation.base import (
    Element,
    check_expansion,
    read_bytes,
    read_elements,
    to_number,
)

# Elements that show what their `url` names.
_INSTANCES = (
    "instance_geometry", "instance_node", "instance_controller",
    "instance_visual_scene",
)  # fmt: skip
# Elements that are read.
_READ = (
    "asset", "unit", "up_axis", "library_geometries", "geometry", "mesh",
    "source", "float_array", "technique_common", "accessor", "param",
    "vertices", "input", "triangles", "polylist", "polygons", "tristrips",
    "trifans", "vcount", "p", "library_nodes", "library_visual_scenes",
    "visual_scene", "node", "matrix", "translate", "rotate", "scale", "scene",
    *_INSTANCES,
)  # fmt: skip
# Elements that a note counts -> what the note calls them.
_NOTED = {
    "instance_controller": "skins or morphs",
    "animation": "animations",
    "lines": "lines",
    "linestrips": "lines",
    "spline": "lines",
}
# Elements with surfaces or places that are not read. Cameras and lights have
# places, too, which do not matter.
_REFUSED = ("brep", "convex_mesh", "ph")
_REFUSED_PLACES = ("skew", "lookat")
# Elements that change no shape, with all that they contain. Skins and morphs
# are counted where a node shows them.
_SHAPELESS = (
    "contributor", "created", "modified", "keywords", "revision", "subject",
    "title", "author", "coverage", "extra", "technique", "bind_material",
    "library_controllers", "library_animation_clips", "library_cameras",
    "library_effects", "library_formulas", "library_force_fields",
    "library_images", "library_lights", "library_materials",
    "library_physics_materials", "library_physics_models",
    "library_physics_scenes", "library_joints",
    "library_articulated_systems", "library_kinematics_models",
    "library_kinematics_scenes", "instance_camera", "instance_light",
    "instance_physics_scene", "instance_kinematics_scene", "evaluate_scene",
    "skeleton", "Name_array", "IDREF_array", "SIDREF_array", "bool_array",
    "int_array",
)  # fmt: skip
_CURE = "; export it with triangles and matrices, or as glTF"


def check_collada(path: Path) -> tuple[str, ...]:
    """Returns notes on ignored elements of a COLLADA file, one for each kind.

    Raises:
        ValueError: the file has surfaces or places that would not be read.
        InputError: the file cannot be read, or is no XML.
    """
    root = read_elements(path)
    _unit_and_axis(root)
    for matrix in root.iter("bind_shape_matrix"):
        numbers = [to_number(word) for word in (matrix.text or "").split()]
        if not np.array_equal(numbers, np.eye(4).ravel()):
            raise ValueError(
                "has a skin of COLLADA that moves its mesh"
                f" (bind_shape_matrix), which is not read{_CURE}"
            )
    counts: Counter[str] = Counter()
    _count(root, counts)
    scenes = sum(1 for _ in root.all("library_visual_scenes", "visual_scene"))
    counts["further scenes"] = scenes - 1
    return tuple(
        f"{number} {what} of COLLADA ignored"
        for what, number in (+counts).items()
    )


def plain_collada(path: Path) -> tuple[bytes, np.ndarray]:
    """Returns a COLLADA file as Open3D can read it, in full precision.

    Open3D reads numbers, and multiplies the places of nodes, in single
    precision. Each shown mesh therefore gets a node of its own, and vertices
    begin near the origin.

    Args:
        path: the file, which `check_collada` has checked.

    Returns:
        The file, and (3,) what was taken from the place of all meshes, along
        the axes that Open3D gives them [m]. Files that show nothing stay as
        they are.

    Raises:
        ValueError: an element has not the numbers that it needs.
        InputError: the file cannot be read, or is no XML.
    """
    root = read_elements(path)
    shown = list(_placed_meshes(root))
    if not shown:
        return read_bytes(path), np.zeros(3)
    starts = {
        one.get("id"): _begin_at_origin(cast(Element, one))
        for one in root.iter("geometry")
    }
    X_meshes = np.array([X for _, X in shown])
    for X, (one, _) in zip(X_meshes, shown, strict=True):
        X[:3, 3] += X[:3, :3] @ starts.get(one.get("url", "")[1:], np.zeros(3))
    p_offset = X_meshes[0, :3, 3].copy()
    X_meshes[:, :3, 3] -= p_offset
    scene = _shown_scene(root)
    assert scene is not None  # It shows a mesh.
    scene[:] = []
    for one in [*root.all("library_controllers")]:
        root.remove(one)  # They may be incomplete.
    for X, (one, _) in zip(X_meshes, shown, strict=True):
        matrix = Element("matrix")
        matrix.text = " ".join(map(repr, X.ravel().tolist()))
        node = ElementTree.SubElement(scene, "node")
        node.extend([matrix, one])
    unit, axis = _unit_and_axis(root)
    x, y, z = p_offset * unit
    turned = {"Z_UP": (x, z, -y), "X_UP": (-y, x, z)}.get(axis, (x, y, z))
    return ElementTree.tostring(root), np.array(turned)


def _shown_scene(root: Element) -> Element | None:
    """Returns the scene that a file shows, or None."""
    for one in root.all("scene", "instance_visual_scene"):
        for scene in root.all("library_visual_scenes", "visual_scene"):
            if scene.get("id") == one.get("url", "")[1:]:
                return scene
    return None


def _placed_meshes(root: Element) -> Iterator[tuple[Element, np.ndarray]]:
    """Yields each `instance_geometry` that a file shows, and its place (4, 4).

    Skins and morphs are shown as their meshes were modelled.

    Raises:
        ValueError: a node shows itself, or has other numbers than it needs.
    """
    scene = _shown_scene(root)
    if scene is None:
        return
    named = {one.get("id"): cast(Element, one) for one in root.iter("node")}

    def inside(parent: Element) -> list[Element]:
        urls = [one.get("url", "")[1:] for one in parent.all("instance_node")]
        shown = [named[url] for url in urls if url in named]
        return [*parent.all("node"), *shown]

    try:
        check_expansion(scene, inside)
    except ValueError as error:
        raise ValueError(f"has nodes of COLLADA: {error}") from error
    waiting = [(scene, np.eye(4))]
    sources = {
        f"#{one.get('id')}": inner.get("source", "")
        for one in root.iter("controller")
        for inner in one
        if inner.tag in ("skin", "morph")
    }
    while waiting:
        parent, X = waiting.pop()
        X = X @ _own_place(parent)
        yield from ((one, X) for one in parent.all("instance_geometry"))
        for one in parent.all("instance_controller"):
            url = one.get("url", "")
            for _ in sources:  # A skin may name a morph.
                url = sources.get(url, url)
            yield Element("instance_geometry", url=url), X
        waiting += [(one, X) for one in reversed(inside(parent))]


def _own_place(node: Element) -> np.ndarray:
    """Returns the place (4, 4) of a node in its parent."""
    # Slow to import, and most worlds have no such meshes.
    from scipy.spatial.transform import Rotation

    X = np.eye(4)
    for one in node.all("*"):
        step = np.eye(4)
        if one.tag == "matrix":
            step = _numbers(one, 16).reshape(4, 4)
        elif one.tag == "translate":
            step[:3, 3] = _numbers(one, 3)
        elif one.tag == "scale":
            step[:3, :3] = np.diag(_numbers(one, 3))
        elif one.tag == "rotate":
            *axis, angle_deg = _numbers(one, 4)
            length = np.linalg.norm(axis)
            if length > 0.0:
                vector = np.array(axis) / length * np.deg2rad(angle_deg)
                step[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
        X = X @ step
    return X


def _begin_at_origin(geometry: Element) -> np.ndarray:
    """Moves the vertices of a mesh to the origin.

    Returns:
        (3,) the place where they began; 0 if they are no plain x, y and z.
    """
    for mesh in geometry.all("mesh"):
        names = [
            one.get("source", "")[1:]
            for one in mesh.all("vertices", "input")
            if one.get("semantic") == "POSITION"
        ]
        for source in mesh.all("source"):
            accessor = source.first("technique_common", "accessor")
            array = source.first("float_array")
            if (
                [source.get("id")] != names
                or accessor is None
                or array is None
                or accessor.get("stride") != "3"
                or accessor.get("offset", "0") != "0"
                or len([*accessor.all("param")]) != 3
            ):
                continue
            words = (array.text or "").split()
            values = np.array([to_number(word) for word in words])
            if len(values) < 3 or len(values) % 3:
                continue
            points = values.reshape(-1, 3)
            start = points[0].copy()
            moved = (points - start).ravel().tolist()
            array.text = " ".join(map(repr, moved))
            return start
    return np.zeros(3)


def _numbers(element: Element, count: int) -> np.ndarray:
    """Returns the numbers (N,) of an element.

    Raises:
        ValueError: it has not `count` numbers.
    """
    words = (element.text or "").split()
    if len(words) != count:
        raise ValueError(
            f"has <{element.tag}> of COLLADA with {len(words)} numbers, not"
            f" {count}"
        )
    return np.array([to_number(word) for word in words])


def _unit_and_axis(root: Element) -> tuple[float, str]:
    """Returns the unit [m] and the axis of a whole file.

    Raises:
        ValueError: a unit is no length, or a part of the file has a unit or an
            axis of its own.
    """
    own = root.first("asset")
    kept = (1.0, "Y_UP") if own is None else _stated(own)
    for asset in root.iter("asset"):
        if _stated(cast(Element, asset), *kept) != kept:
            raise ValueError(
                f"has parts of COLLADA with another unit or axis{_CURE}"
            )
    return kept


def _stated(
    asset: Element, unit: float = 1.0, axis: str = "Y_UP"
) -> tuple[float, str]:
    """Returns the unit [m] and the axis that an asset states, or defaults."""
    for found in asset.all("unit"):
        text = found.get("meter", "1")
        unit = to_number(text)
        if not 0.0 < unit < math.inf:
            raise ValueError(f"has a unit of COLLADA of '{text}' m")
    for found in asset.all("up_axis"):
        axis = (found.text or "").strip()
    return unit, axis


def _count(element: Element, counts: Counter[str]) -> None:
    """Counts what is not read within an element.

    Raises:
        ValueError: something within it would have to be read.
    """
    for child in element.all("*"):
        tag = child.tag
        is_place = tag in _REFUSED_PLACES and _shows_something(element)
        if tag in _REFUSED or is_place:
            raise ValueError(
                f"has <{tag}> of COLLADA, which is not read{_CURE}"
            )
        url = child.get("url", "")
        if tag in _INSTANCES and not url.startswith("#"):
            raise ValueError(
                f"shows a part of another file ('{url}'), which is not"
                f" read{_CURE}"
            )
        if tag in _NOTED:
            counts[_NOTED[tag]] += 1
        elif tag in _READ or tag == "library_animations":
            _count(child, counts)
        elif tag not in (*_SHAPELESS, *_REFUSED_PLACES):
            counts[f"elements <{tag}>"] += 1


def _shows_something(node: Element) -> bool:
    return any(one.tag in _INSTANCES for one in node.iter())
