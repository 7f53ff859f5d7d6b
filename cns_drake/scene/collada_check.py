"""Checks COLLADA files for contents that Open3D reads wrongly or not at all.

A member of the family of checks of mesh formats. Specification:
https://www.khronos.org/files/collada_spec_1_4.pdf
"""

from collections import Counter
import math
from pathlib import Path
from typing import cast

import numpy as np

from cns_drake.base import Element, read_elements, to_number

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
    _check_units(root)
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


def _check_units(root: Element) -> None:
    """Checks that the whole file has the unit and the axis of its beginning.

    Raises:
        ValueError: a unit is no length, or a part of the file has a unit or an
            axis of its own.
    """
    own = root.first("asset")
    kept = [(1.0, "Y_UP") if own is None else _unit_and_axis(own)]
    for asset in root.iter("asset"):
        kept.append(_unit_and_axis(cast(Element, asset), *kept[0]))
    if len(set(kept)) > 1:
        raise ValueError(
            f"has parts of COLLADA with another unit or axis{_CURE}"
        )


def _unit_and_axis(
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
