"""Loading an SDF world, and the vehicle in it, into a SceneGraph."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from pydrake.geometry import FrameId, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from cns_drake.base.errors import InputError
from cns_drake.base.map_folder import MapFolder
from cns_drake.scene.parsed_world import parse_models, parse_world
from cns_drake.scene.perception_geometry import structure_name
from cns_drake.scene.structure_table import (
    StructureTable,
    load_structure_table,
)


@dataclass(frozen=True)
class World:
    """Parsed models, ready to be wired.

    Attributes:
        scene_graph: holds the geometry; add it to a DiagramBuilder.
        plant: owns bodies and frames; finalized, not meant for a Diagram.
        vehicle: the vehicle's model instance; None without a vehicle.
        structures: class and instance id of every structure in the world,
            listed in a table or not.
        notes: for the user.

    Example:
        from cns_drake import load_world

        world = load_world(sdf)
        print(world.plant.num_bodies(), len(world.anchored_frames()))
    """

    scene_graph: SceneGraph
    plant: MultibodyPlant
    vehicle: ModelInstanceIndex | None
    structures: StructureTable
    notes: tuple[str, ...] = ()

    def anchored_frames(self) -> frozenset[FrameId]:
        """Returns the geometry frames that can never move."""
        return anchored_frames(self.plant)


def anchored_frames(plant: MultibodyPlant) -> frozenset[FrameId]:
    """Returns the geometry frames of a plant that can never move."""
    bodies = plant.GetBodiesWeldedTo(plant.world_body())
    frames = (plant.GetBodyFrameIdIfExists(body.index()) for body in bodies)
    return frozenset(frame for frame in frames if frame is not None)


def load_world(
    sdf: Path,
    *,
    vehicle: Path | None = None,
    structures: Path | None = None,
    without: Collection[str] = (),
    model_paths: Collection[Path] = (),
) -> World:
    """Parses a world and, in it, a vehicle.

    A world for Gazebo keeps its visuals, at their places at the start; the
    notes list the omitted parts.

    Args:
        sdf: the world or model file.
        vehicle: the vehicle's model file.
        structures: table of structures; by default `structures.csv` beside
            the world, if there is one.
        without: names of structures to leave out.
        model_paths: folders in which to look for `model://`, before those of
            GZ_SIM_RESOURCE_PATH and SDF_PATH.

    Raises:
        InputError: a file is missing or cannot be parsed, a structure to leave
            out does not exist, or the world has no visuals.

    Example:
        from pathlib import Path

        from cns_drake import load_world

        world = load_world(Path("my_world.sdf"))
    """
    parsed = parse_world(sdf, without=without, model_paths=model_paths)
    plant, notes = parsed.plant, parsed.notes
    vehicle_model = None
    if vehicle is not None:
        vehicle_model = parse_models(parsed.parser, vehicle)[0]
    plant.Finalize()

    table = structures or MapFolder(sdf.parent).structures
    found = set(map(structure_name, parsed.names))
    if structures is not None or table.is_file():
        entries = load_structure_table(table)
        notes += _mismatches(table, {entry.name for entry in entries}, found)
    else:
        entries = StructureTable(())
    try:
        entries = entries.completed(found)
    except InputError as error:
        raise InputError(f"{sdf}: {error}") from None
    return World(parsed.scene_graph, plant, vehicle_model, entries, notes)


def _mismatches(
    table: Path, listed: set[str], found: set[str]
) -> tuple[str, ...]:
    """Returns a note if a table has rows for only some of the structures.

    Rows without structures are normal: another stage may have these.
    """
    unlabelled, unused = sorted(found - listed), sorted(listed - found)
    if not (unlabelled and unused):
        return ()
    return (
        f"{table}: {len(unused)} of {len(listed)} rows match nothing (such as"
        f" {unused[0]}), and {len(unlabelled)} of {len(found)} structures have"
        f" no row and are unlabeled (such as {unlabelled[0]}); a visual named"
        " <structure>/<part> is of <structure>, one without a slash of its"
        " model",
    )


def structures_in(world: World) -> set[str]:
    """Returns the names of the structures of a world."""
    inspector = world.scene_graph.model_inspector()
    return {
        structure_name(inspector.GetName(geometry_id))
        for geometry_id in inspector.GetAllGeometryIds()
    }
