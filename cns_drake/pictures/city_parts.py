"""The static structures of a stage, and their differences to another stage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from typing import NamedTuple

import numpy as np

from cns_drake.scene import (
    TriangleSurface,
    World,
    merge_surfaces,
    read_perception_geometry,
)
from evaluation.base import MAX_INSTANCE, distances_along
from worlds.shapes import CLASS_RGB, StructureTable, kind_in_name

# Colour of geometry without one in pictures.
DEFAULT_RGB = (0.7, 0.7, 0.7)
# A structure has the same height in two stages if it differs by at most this
# [m].
_HEIGHT_TOLERANCE = 0.5
# Changes farther from a route than this are not shown as its places [m].
_NEAR = 30.0
# A change is shown from this far before the place that is nearest to it, and
# the places of two changes are at least so far apart [m].
_BEFORE = 35.0
_APART = 60.0


@dataclass(frozen=True)
class ColouredPart:
    """A part of a structure that has one colour.

    Attributes:
        semantic_class: class of the structure.
        rgb: sRGB colour, each value from 0 to 1.
        surface: the part's surface, expressed in W.
    """

    semantic_class: str
    rgb: tuple[float, float, float]
    surface: TriangleSurface

    def top(self) -> float:
        """Returns the height of the highest vertex [m]."""
        return float(self.surface.p_GVset[:, 2].max())


@dataclass(frozen=True)
class StageDifference:
    """The differences between two stages, as lists of parts of structures.

    The two stages are "this stage" and "the other stage". If a structure is
    higher in one stage, its "upper parts" are the parts above the structure's
    height in the other stage.

    Attributes:
        common: what exists in both stages, with the shape in this stage.
        additional: what exists only in this stage: whole structures, and upper
            parts of structures that are higher in this stage than in the other
            stage.
        missing: what exists only in the other stage: whole structures, and
            upper parts of structures that are lower in this stage, with the
            shape in the other stage.
    """

    common: list[ColouredPart] = field(default_factory=list)
    additional: list[ColouredPart] = field(default_factory=list)
    missing: list[ColouredPart] = field(default_factory=list)


def read_parts(world: World) -> dict[str, list[ColouredPart]]:
    """Returns the parts of structures that cannot move, by structure."""
    plant = world.plant
    context = plant.CreateDefaultContext()
    geometries = read_perception_geometry(
        world.scene_graph.model_inspector(),
        world.anchored_frames().__contains__,
    )
    structures = world.structures.completed(
        {geometry.structure for geometry in geometries}
    )
    X_WFs = {
        frame_id: plant.EvalBodyPoseInWorld(
            context, plant.GetBodyFromFrameId(frame_id)
        )
        for frame_id in {geometry.frame_id for geometry in geometries}
    }
    parts: dict[str, list[ColouredPart]] = {}
    for geometry in geometries:
        semantic_class = structures[geometry.structure].semantic_class
        parts.setdefault(geometry.structure, []).append(
            ColouredPart(
                semantic_class,
                geometry.rgb or CLASS_RGB[semantic_class],
                merge_surfaces([geometry], X_WFs.__getitem__),
            )
        )
    return parts


def compare_parts(
    own: Mapping[str, Sequence[ColouredPart]],
    other: Mapping[str, Sequence[ColouredPart]],
) -> StageDifference:
    """Returns the differences between the structures of two stages, by part.

    A structure that was moved, or has another shape of the same height, counts
    as common to both stages.

    Args:
        own: name of a structure -> its parts in this stage.
        other: name of a structure -> its parts in the other stage.
    """
    difference = StageDifference()
    for name, parts in own.items():
        if name not in other:
            difference.additional.extend(parts)
            continue
        height, height_there = _top(parts), _top(other[name])
        if height > height_there + _HEIGHT_TOLERANCE:
            below, above = _split_at_height(parts, height_there)
            difference.common.extend(below)
            difference.additional.extend(above)
            continue
        difference.common.extend(parts)
        if height_there > height + _HEIGHT_TOLERANCE:
            difference.missing.extend(_split_at_height(other[name], height)[1])
    for name, parts in other.items():
        if name not in own:
            difference.missing.extend(parts)
    return difference


def changed_above(
    own: Mapping[str, Sequence[ColouredPart]],
    other: Mapping[str, Sequence[ColouredPart]],
    structures: StructureTable,
) -> np.ndarray:
    """Returns above which height a structure is absent in the other stage.

    Args:
        own, other: as for `compare_parts`.
        structures: the structures of this stage.

    Returns:
        A height for each instance id [m]: minus infinity if the other stage
        lacks the whole structure, infinity if it has all of it.
    """
    heights = np.full(MAX_INSTANCE + 1, math.inf)
    table = structures.completed(own)
    for name, parts in own.items():
        height = _top(other[name]) if name in other else -math.inf
        if _top(parts) > height + _HEIGHT_TOLERANCE:
            heights[table[name].instance] = height + _HEIGHT_TOLERANCE
    return heights


class PassedChange(NamedTuple):
    """A structure that only one of two stages has, beside a route.

    Attributes:
        frame: frame of the drive a little before it is passed.
        kind: its kind, such as `office`, or its class.
        height: height of what only one stage has [m].
        is_own: whether the stage of the drive has it.
        place: its middle [m].
    """

    frame: int
    kind: str
    height: float
    is_own: bool
    place: tuple[float, float, float]


def greatest_changes(
    own: Mapping[str, Sequence[ColouredPart]],
    other: Mapping[str, Sequence[ColouredPart]],
    p_WBset: np.ndarray,
    most: int,
) -> list[PassedChange]:
    """Returns the changes that look greatest from a route, in order of time.

    Args:
        own, other: as for `compare_parts`.
        p_WBset: (F, 3) places of the vehicle [m].
        most: greatest number of changes.
    """
    travelled = distances_along(p_WBset)
    found = []
    for is_own, here, there in ((True, own, other), (False, other, own)):
        for name, parts in here.items():
            points = np.concatenate([part.surface.p_GVset for part in parts])
            low, high = points.min(axis=0), points.max(axis=0)
            if name in there:
                low[2] = _top(there[name])
            height = float(high[2] - low[2])
            if height <= _HEIGHT_TOLERANCE:
                continue
            nearest = np.clip(p_WBset[:, :2], low[:2], high[:2])
            away = np.linalg.norm(p_WBset[:, :2] - nearest, axis=1)
            frame = int(away.argmin())
            if away[frame] <= _NEAR:
                kind = kind_in_name(name) or parts[0].semantic_class
                size = height * float(np.linalg.norm((high - low)[:2]))
                x, y, z = ((low + high) / 2.0).tolist()
                change = PassedChange(
                    frame, kind.replace("_", " "), height, is_own, (x, y, z)
                )
                found.append((size, change))
    places: list[float] = []
    changes = []
    for _, change in sorted(found, reverse=True):
        passed = travelled[change.frame]
        if all(abs(passed - one) > _APART for one in places):
            places.append(passed)
            start = int(np.searchsorted(travelled, passed - _BEFORE))
            changes.append(change._replace(frame=start))
    return sorted(changes[:most])


def _top(parts: Sequence[ColouredPart]) -> float:
    return max(part.top() for part in parts)


def _split_at_height(
    parts: Sequence[ColouredPart], height: float
) -> tuple[list[ColouredPart], list[ColouredPart]]:
    """Returns the parts below a height, and the parts above it [m].

    No triangle is cut.
    """
    below: list[ColouredPart] = []
    above: list[ColouredPart] = []
    for part in parts:
        surface = part.surface
        reaches = (surface.p_GVset[surface.triangles, 2] > height).any(axis=1)
        for group, chosen in ((below, ~reaches), (above, reaches)):
            if chosen.any():
                used, renumbered = np.unique(
                    surface.triangles[chosen], return_inverse=True
                )
                piece = TriangleSurface(
                    surface.p_GVset[used],
                    renumbered.reshape(-1, 3).astype(np.int32),
                )
                group.append(replace(part, surface=piece))
    return below, above
