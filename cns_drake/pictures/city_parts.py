"""The static structures of a stage, and their differences to another stage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cns_drake.scene import (
    CLASS_RGB,
    TriangleSurface,
    World,
    merge_surfaces,
    read_perception_geometry,
)

# Colour of geometry without one in pictures.
DEFAULT_RGB = (0.7, 0.7, 0.7)
# A structure has the same height in two stages if it differs by at most this
# [m].
_HEIGHT_TOLERANCE = 0.5


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
