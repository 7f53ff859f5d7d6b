"""Loads an SDF world, and a vehicle in it, into a SceneGraph."""

from collections.abc import Collection, Iterable, Iterator
import contextlib
from dataclasses import dataclass
from pathlib import Path
import re

from pydrake.geometry import (
    Convex,
    FrameId,
    GeometryId,
    Mesh,
    Role,
    SceneGraph,
    SourceId,
)
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from cns_drake.scene.drake_errors import PARSER_ERRORS, collected_errors
from cns_drake.scene.mesh_check import check_mesh_file
from cns_drake.scene.model_check import check_model
from cns_drake.scene.model_finder import ModelFinder
from cns_drake.scene.obj_files import ObjFiles
from cns_drake.scene.perception_geometry import anchored_frames, check_shape
from cns_drake.scene.sdf_worlds import InSight, UnseenMesh, read_sdf_world
from cns_drake.scene.structure_names import structure_name
from cns_drake.scene.urdf_worlds import read_urdf_world
from evaluation.base import (
    InputError,
    doing,
    errors_at,
    is_there,
    read_bytes,
    reads,
    value_errors,
)
from worlds.shapes import STRUCTURES_NAME, StructureTable, load_structure_table


@dataclass(frozen=True)
class World:
    """The parsed models of a world and its vehicle, ready for a diagram.

    Attributes:
        scene_graph: the SceneGraph with the geometry of the models; add it to a
            DiagramBuilder.
        plant: the plant with the bodies and frames of the models. The plant is
            finalized, and not meant to be part of a Diagram.
        vehicle: model instance of the vehicle; None without one.
        structures: class and instance id of every structure in the world,
            whether or not the structure table lists it.
        notes: messages for the user.

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


@reads
def load_world(
    sdf: Path | str,
    *,
    vehicle: Path | str | None = None,
    without: Collection[str] = (),
    model_paths: Collection[Path | str] = (),
    in_sight: InSight | None = None,
) -> World:
    """Reads a world and, if given, a vehicle.

    Names, classes and labels come from `structures.csv` in the world's folder,
    if it exists.

    From an SDF world, only the visuals are kept, at their initial places, and
    nothing moves; the notes list what is left out. The visuals of URDF are read
    by Drake, with all joints at zero.

    Args:
        sdf: SDF or URDF (`.urdf`) file of the world or model.
        vehicle: file of the vehicle's model; None for no vehicle.
        without: names of structures to leave out.
        model_paths: folders in which `model://` and `package://` are searched,
            before the folders in GZ_SIM_RESOURCE_PATH and SDF_PATH.
        in_sight: function that tells which of N boxes (N, 2, 3) in the world
            [m] are in sight, each given by its least and greatest coordinates.
            Meshes out of sight are not loaded; `structures` has theirs, and
            rays that end in sight are the same. None to load all. Not together
            with `without`.

    Raises:
        InputError: a file is missing or cannot be parsed, a structure to leave
            out does not exist, or the world has no visuals.

    Example:
        from cns_drake import load_world

        world = load_world("my_world.sdf")
    """
    sdf = Path(sdf)
    scene_graph = SceneGraph()
    # The plant parses models and holds their frames. It stays out of the
    # Diagram for two reasons: a plant has no port for prescribed motion, and a
    # plant with many models makes Build() slow.
    plant = MultibodyPlant(time_step=0.0)
    source = plant.RegisterAsSourceForSceneGraph(scene_graph)
    objs = ObjFiles()
    notes, unseen = _read_world(
        plant, sdf, [Path(one) for one in model_paths], objs, in_sight
    )
    _leave_out(scene_graph, source, sdf, without)
    found = _visible_structures(scene_graph)
    found |= {structure_name(mesh.name) for mesh in unseen}
    if not found:
        left_out = "; ".join(note.removeprefix(f"{sdf}: ") for note in notes)
        raise InputError(
            f"{sdf}: the world has no visuals, and so no geometry that a "
            f"LiDAR can see{left_out and f' ({left_out})'}"
        )
    _check_shapes(scene_graph, sdf)
    with objs:
        notes += _mesh_notes(scene_graph, unseen, objs)
    vehicle_model = None
    if vehicle is not None:
        vehicle_model = _parse_models(plant, Path(vehicle))[0]
    plant.Finalize()

    file = sdf.parent / STRUCTURES_NAME
    table = StructureTable(())
    if is_there(file):
        table = load_structure_table(file)
        notes += _mismatch_notes(file, {entry.name for entry in table}, found)
    with errors_at(sdf):
        table = table.completed(found)
    return World(scene_graph, plant, vehicle_model, table, notes)


def structures_in(world: World) -> set[str]:
    """Returns the names of the structures of a world."""
    inspector = world.scene_graph.model_inspector()
    return {
        structure_name(inspector.GetName(geometry_id))
        for geometry_id in inspector.GetAllGeometryIds()
    }


def _read_world(
    plant: MultibodyPlant,
    path: Path,
    model_paths: Collection[Path],
    objs: ObjFiles,
    in_sight: InSight | None,
) -> tuple[tuple[str, ...], list[UnseenMesh]]:
    """Adds the models of a world to a plant.

    Returns:
        Notes on what is left out, and the meshes that are out of sight.

    Raises:
        InputError: the file is missing, cannot be parsed, or has no models.
    """
    _check_text(path)
    doing(f"parsing {path.name}")
    finder = ModelFinder(path, model_paths)
    with _drake_errors(path):
        if path.suffix.lower() == ".urdf":
            return read_urdf_world(plant, path, finder), []
        return read_sdf_world(plant, path, finder, objs, in_sight)


def _parse_models(
    plant: MultibodyPlant, path: Path
) -> list[ModelInstanceIndex]:
    """Checks a file, lets Drake parse it, and returns its models.

    Raises:
        InputError: the file is missing, cannot be parsed, or has no models.
    """
    _check_text(path)
    check_model(path, ModelFinder(path))
    doing(f"parsing {path.name}")
    with _drake_errors(path):
        models = Parser(plant).AddModels(str(path))
    if not models:
        raise InputError(f"{path}: holds no model")
    return models


@contextlib.contextmanager
def _drake_errors(path: Path) -> Iterator[None]:
    """Raises Drake's errors about a file as an InputError."""
    with collected_errors() as errors:
        try:
            yield
        except PARSER_ERRORS as error:
            raise _parse_error(path, str(error), *errors) from error
        if errors:
            raise _parse_error(path, *errors)


def _check_text(path: Path) -> None:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.suffix.lower() == ".xml":
        raise InputError(
            f"{path}: MJCF is not read; Drake's Parser reads it in a Diagram,"
            " to which add_lidar adds a LiDAR (docs/drake.md)"
        )
    # Drake would fail when it quotes other text.
    content = read_bytes(path)
    if path.suffix.lower() == ".erb" or content.lstrip().startswith(b"<%"):
        raise InputError(
            f"{path}: a template is not read; the program erb writes the SDF"
        )
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: not UTF-8 text") from None


def _parse_error(path: Path, *texts: str) -> InputError:
    """Returns an error that contains the first two of Drake's messages."""
    # Messages of Drake and libsdformat begin with the path, which Drake makes
    # absolute, a severity and a code.
    names = "|".join(re.escape(str(p)) for p in (path.absolute(), path))
    faults = [" ".join(text.split()) for text in texts[:2]]
    faults = [re.sub(r"^SDFormat Error .*?Msg: ", "", f) for f in faults]
    # What is read of a world is a text with other lines and another name than
    # its file.
    faults = [re.sub(r"^<[^<>]*-string>\S* \w+: ", "", f) for f in faults]
    faults = [f.replace("in world with name[frames]", "there") for f in faults]
    faults = [
        re.sub(
            rf"/*(?:{names}):(?:(\d+):)? (?:error|ERROR): (?:ERROR: )?",
            lambda match: f"line {match[1]}: " if match[1] else "",
            fault,
        )
        for fault in faults
    ]
    return InputError(f"{path}: cannot be parsed: {': '.join(faults)}")


def _leave_out(
    scene_graph: SceneGraph,
    source: SourceId,
    sdf: Path,
    structures: Collection[str],
) -> None:
    """Removes the geometry of structures from the SceneGraph of a world.

    Raises:
        InputError: a structure does not exist.
    """
    missing = set(structures)
    for geometry_id, name in _read_names(scene_graph, sdf).items():
        if structure_name(name) in structures:
            missing.discard(structure_name(name))
            scene_graph.RemoveGeometry(source, geometry_id)
    if missing:
        raise InputError(f"without: no structure {min(missing)!r} in {sdf}")


def _read_names(scene_graph: SceneGraph, sdf: Path) -> dict[GeometryId, str]:
    """Returns the name of each geometry."""
    inspector = scene_graph.model_inspector()
    names = {}
    for geometry_id in inspector.GetAllGeometryIds():
        try:
            names[geometry_id] = inspector.GetName(geometry_id)
        except UnicodeDecodeError:
            raise InputError(f"{sdf}: a name is not UTF-8 text") from None
    return names


def _visible_structures(scene_graph: SceneGraph) -> set[str]:
    """Returns the names of structures that a LiDAR can see."""
    inspector = scene_graph.model_inspector()
    return {
        structure_name(inspector.GetName(geometry_id))
        for geometry_id in inspector.GetAllGeometryIds(Role.kPerception)
    }


def _check_shapes(scene_graph: SceneGraph, sdf: Path) -> None:
    """Checks that no shape that a LiDAR can see is too large.

    Raises:
        InputError: a shape is too large.
    """
    inspector = scene_graph.model_inspector()
    for geometry_id in inspector.GetAllGeometryIds(Role.kPerception):
        with errors_at(sdf):
            check_shape(
                inspector.GetName(geometry_id), inspector.GetShape(geometry_id)
            )


def _mesh_notes(
    scene_graph: SceneGraph, unseen: Iterable[UnseenMesh], objs: ObjFiles
) -> tuple[str, ...]:
    """Returns notes about content of the meshes that is not read.

    The meshes are the visible ones, and those out of sight.

    Raises:
        InputError: the shapes of a mesh would be misread.
    """
    inspector = scene_graph.model_inspector()
    ids = inspector.GetAllGeometryIds(Role.kPerception)
    shapes = [inspector.GetShape(geometry_id) for geometry_id in ids]
    sources = [one.source() for one in shapes if isinstance(one, Mesh | Convex)]
    paths = {str(one.path()) for one in sources if one.is_path()}
    known = {mesh.path: mesh.notes for mesh in unseen}
    notes = []
    for path in sorted(paths | known.keys()):
        with value_errors(path):
            found = known.get(path)
            if found is None:
                found = check_mesh_file(Path(path), objs)
            notes += [f"{path}: {one}" for one in found]
    return tuple(notes)


def _mismatch_notes(
    table: Path, listed: set[str], found: set[str]
) -> tuple[str, ...]:
    """Returns a note if names in the table and in the world differ.

    Rows without a structure are normal, because another stage may have the
    structure. So are structures without a row, in a world without a table of
    its own. Only both together suggest that names do not match.

    Returns:
        One note, if rows lack a structure and structures lack a row; otherwise
        none.
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
