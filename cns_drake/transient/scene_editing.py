"""Edits a loaded world, and records the cause of each change."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    Convex,
    Cylinder,
    GeometryInstance,
    IllustrationProperties,
    InMemoryMesh,
    Mesh,
    PerceptionProperties,
    Rgba,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from shapely.geometry.base import BaseGeometry

from cns_drake.base.elementary import product
from cns_drake.base.errors import InputError
from cns_drake.city.geometry.mesh import FOLDER
from cns_drake.city.geometry.structures import (
    BoxShape,
    CylinderShape,
    MeshShape,
    Model,
    Part,
    SphereShape,
)
from cns_drake.scene.structure_table import (
    MAX_INSTANCE,
    StructureEntry,
    StructureTable,
)
from cns_drake.scene.surfaces import TriangleSurface
from cns_drake.scene.world import World
from cns_drake.transient.world_structures import (
    GroundSurface,
    Obstacles,
    Structure,
    StructurePart,
    draws,
)

# Snow farther from the drive would be hardly visible to a LiDAR [m].
_NEAR = 120.0


class _Named(Protocol):
    @property
    def name(self) -> str: ...


Named = TypeVar("Named", bound=_Named)


class Look(NamedTuple):
    """The look of new surfaces.

    Attributes:
        rgb: diffuse colour.
        reflectivity: near 900 nm, 0 to 1; None if it follows from class and
            colour.
    """

    rgb: tuple[float, float, float]
    reflectivity: float | None = None


class SceneEditing:
    """Removes things from a world and adds others."""

    def __init__(self, world: World):
        """Begins with an unchanged world.

        Args:
            world: not yet a part of a diagram; its SceneGraph is changed.
        """
        self._world = world
        self._source = world.plant.get_source_id()
        # Name -> class and reflectivity.
        self._added: dict[str, tuple[str, float | None]] = {}
        self._causes: defaultdict[str, list[str]] = defaultdict(list)
        self._notes: list[str] = []

    def note(self, text: str) -> None:
        """Keeps a note for the user on the changes."""
        self._notes.append(f"transient: {text}")

    def blame(self, structure: str, cause: str) -> None:
        """Keeps the switch that changed a structure."""
        if cause not in self._causes[structure]:
            self._causes[structure].append(cause)

    def remove(self, thing: Structure, cause: str) -> None:
        """Removes a structure."""
        for part in thing.parts:
            self.remove_part(part)
        self.blame(thing.name, cause)

    def remove_part(self, part: StructurePart) -> None:
        """Removes a part of a structure."""
        self._world.scene_graph.RemoveGeometry(
            self._source, part.geometry.geometry_id
        )

    def move(
        self, thing: Structure, X_new: RigidTransform, name: str, cause: str
    ) -> None:
        """Moves a structure, and gives it a new name.

        Args:
            thing: to move.
            X_new: transformation of its points in the world.
            name: the new name.
            cause: the switch.
        """
        for part in thing.parts:
            self._copy_part(part, X_new @ part.X_WG, f"{name}/{part.name}")
        self.remove(thing, cause)
        old = self._world.structures[thing.name]
        self._added[name] = (old.semantic_class, old.reflectivity)
        self.blame(name, cause)

    def cover_part(
        self, part: StructurePart, p_W: np.ndarray, look: Look
    ) -> None:
        """Moves a part of a structure and paints it.

        Args:
            part: to change.
            p_W: (3,) displacement in the world [m].
            look: its new look.
        """
        inspector = self._world.scene_graph.model_inspector()
        self._register(
            f"{part.geometry.structure}/{part.name}_covered",
            RigidTransform(np.asarray(p_W, float)) @ part.X_WG,
            inspector.GetShape(part.geometry.geometry_id),
            *_properties(look),
        )
        self.remove_part(part)

    def add(
        self,
        name: str,
        semantic_class: str,
        model: Model,
        X_WS: RigidTransform,
        cause: str,
    ) -> None:
        """Adds a new structure.

        Args:
            name: name of the structure; unique.
            semantic_class: a key of `CLASS_IDS`.
            model: made of the city generator's meshes.
            X_WS: its pose in the world.
            cause: the switch.
        """
        for part in model.parts:
            self._register(
                f"{name}/{part.name}",
                X_WS @ RigidTransform(RollPitchYaw(*part.rpy), part.xyz),
                _shape(part, model),
                *_properties(Look(part.rgb or (0.5, 0.5, 0.5))),
            )
        self._added[name] = (semantic_class, None)
        self.blame(name, cause)

    def replace_triangles(self, part: StructurePart, kept: np.ndarray) -> None:
        """Keeps only some of the triangles of a part.

        Args:
            part: with a surface of triangles.
            kept: indices of triangles that stay.
        """
        surface = part.geometry.surface
        assert isinstance(surface, TriangleSurface)
        triangles = surface.triangles[kept]
        if len(triangles):
            # The mesh is unscaled, so that parts of one mesh share one again.
            scale = self._scale(part)
            if np.prod(scale) < 0.0:
                triangles = triangles[:, ::-1]
            self._register(
                f"{part.geometry.structure}/{part.name}",
                part.X_WG,
                memory_mesh(surface.p_GVset / scale, triangles, scale),
                *self._properties(part),
            )
        self.remove_part(part)

    def add_triangles(
        self,
        part: StructurePart,
        name: str,
        vertices: np.ndarray,
        triangles: np.ndarray,
        look: Look,
    ) -> None:
        """Adds a surface to the structure of a part.

        Args:
            part: one of the structure that it joins, in whose frame it is.
            name: name of the new part.
            vertices: (N, 3) in the world [m].
            triangles: (M, 3) vertex indices.
            look: colour and reflectivity.
        """
        R, p = part.X_WG.rotation().matrix(), part.X_WG.translation()
        mesh = memory_mesh(product(vertices - p, R), triangles)
        name = f"{part.geometry.structure}/{name}"
        self._register(name, part.X_WG, mesh, *_properties(look))

    def add_mesh(
        self,
        name: str,
        semantic_class: str,
        vertices: np.ndarray,
        triangles: np.ndarray,
        look: Look,
        cause: str,
    ) -> None:
        """Adds a structure of triangles.

        Args:
            name: name of the structure.
            semantic_class: a key of `CLASS_IDS`.
            vertices: (N, 3) in the world [m].
            triangles: (M, 3) vertex indices.
            look: colour and reflectivity.
            cause: the switch.
        """
        middle = np.round(vertices.mean(axis=0))
        mesh = memory_mesh(vertices - middle, triangles)
        X_WG = RigidTransform(middle)
        self._register(f"{name}/surface", X_WG, mesh, *_properties(look))
        self._added[name] = (semantic_class, None)
        self.blame(name, cause)

    def finish(self) -> World:
        """Returns the world with its table and notes brought up to date.

        Raises:
            InputError: there are more structures than instance ids.
        """
        table = self._world.structures
        first = table.last_instance + 1
        if first + len(self._added) - 1 > MAX_INSTANCE:
            raise InputError(
                f"transient: {len(self._added)} new structures and "
                f"{first - 1} others are more than instance ids can count "
                f"({MAX_INSTANCE})"
            )
        entries = [
            *table,
            *(
                StructureEntry(first + k, name, *self._added[name])
                for k, name in enumerate(sorted(self._added))
            ),
        ]
        return replace(
            self._world,
            structures=StructureTable(map(self._with_causes, entries)),
            notes=(*self._world.notes, *self._notes),
        )

    def _with_causes(self, entry: StructureEntry) -> StructureEntry:
        new = [
            cause
            for cause in self._causes.get(entry.name, ())
            if cause not in entry.causes
        ]
        return replace(entry, causes=(*entry.causes, *new)) if new else entry

    def _properties(
        self, part: StructurePart
    ) -> tuple[PerceptionProperties, IllustrationProperties | None]:
        inspector = self._world.scene_graph.model_inspector()
        geometry_id = part.geometry.geometry_id
        return (
            inspector.GetPerceptionProperties(geometry_id),
            inspector.GetIllustrationProperties(geometry_id),
        )

    def _scale(self, part: StructurePart) -> np.ndarray:
        inspector = self._world.scene_graph.model_inspector()
        shape = inspector.GetShape(part.geometry.geometry_id)
        # Boxes and cones are the only such shapes without triangles.
        if not isinstance(shape, Mesh | Convex):
            return np.ones(3)
        return np.array(shape.scale3())

    def _copy_part(
        self, part: StructurePart, X_WG: RigidTransform, name: str
    ) -> None:
        inspector = self._world.scene_graph.model_inspector()
        shape = inspector.GetShape(part.geometry.geometry_id)
        self._register(name, X_WG, shape, *self._properties(part))

    def _register(
        self,
        name: str,
        X_WG: RigidTransform,
        shape: Shape,
        seen: PerceptionProperties,
        shown: IllustrationProperties | None,
    ) -> None:
        scene_graph = self._world.scene_graph
        geometry = scene_graph.RegisterGeometry(
            self._source,
            scene_graph.world_frame_id(),
            GeometryInstance(X_WG, shape, name),
        )
        scene_graph.AssignRole(self._source, geometry, seen)
        if shown is not None:
            scene_graph.AssignRole(self._source, geometry, shown)


@dataclass
class Surroundings:
    """A drive's surroundings while they are changed.

    Attributes:
        editing: changes the world.
        things: structure name -> structure, all of them.
        drive: the way of the vehicle, seen from above [m].
        kept_free: area that stays free of new things, seen from above [m].
        seed: seed of all draws.
    """

    editing: SceneEditing
    things: Mapping[str, Structure]
    drive: BaseGeometry
    kept_free: BaseGeometry
    seed: int

    @cached_property
    def ground(self) -> GroundSurface:
        """The ground near the drive."""
        return GroundSurface(self.things, self.drive.buffer(_NEAR))

    def of_classes(self, classes: Collection[str]) -> list[Structure]:
        """Returns the structures of some classes."""
        return [t for t in self.things.values() if t.semantic_class in classes]

    def obstacles(
        self,
        *,
        ignored: Collection[str] | None = None,
        classes: Collection[str] = (),
    ) -> Obstacles:
        """Returns the area that stays free, and footprints of structures.

        Args:
            ignored: classes of structures that are no obstacles.
            classes: in place of `ignored`, those that alone are obstacles.
        """
        feet = (
            (thing.name, thing.footprint)
            for thing in self.things.values()
            if (
                thing.semantic_class in classes
                if ignored is None
                else thing.semantic_class not in ignored
            )
        )
        return Obstacles([("", self.kept_free), *feet])

    def chosen(
        self, cause: str, things: Iterable[Named], share: float
    ) -> Iterator[tuple[Named, np.random.Generator]]:
        """Yields a share of some things, each with its random numbers.

        Args:
            cause: the switch.
            things: they have names.
            share: from 0 to 1.
        """
        for thing in things:
            rng = draws(self.seed, cause, thing.name)
            if rng.uniform() < share:
                yield thing, rng


def memory_mesh(
    vertices: np.ndarray,
    triangles: np.ndarray,
    scale: np.ndarray | None = None,
) -> Mesh:
    """Returns a mesh in memory; readers treat equal ones as the same.

    Args:
        vertices: (N, 3) before they are scaled [m].
        triangles: (M, 3) vertex indices.
        scale: (3,) along the axes; none by default.
    """
    used, corners = np.unique(triangles, return_inverse=True)
    # Numbers of Python are formatted several times as fast as those of NumPy.
    lines = [
        f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices[used].tolist()
    ]
    lines += [
        f"f {a} {b} {c}" for a, b, c in (corners.reshape(-1, 3) + 1).tolist()
    ]
    text = "\n".join(lines) + "\n"
    file = MemoryFile(text.encode(), ".obj", "mesh")
    return Mesh(
        InMemoryMesh(mesh_file=file), np.ones(3) if scale is None else scale
    )


def _properties(
    look: Look,
) -> tuple[PerceptionProperties, IllustrationProperties]:
    seen, shown = PerceptionProperties(), IllustrationProperties()
    for properties in (seen, shown):
        properties.AddProperty("phong", "diffuse", Rgba(*look.rgb, 1.0))
    if look.reflectivity is not None:
        seen.AddProperty("lidar", "reflectivity", look.reflectivity)
    return seen, shown


def _shape(part: Part, model: Model) -> Shape:
    """Returns the shape of a part of the city generator's."""
    shape = part.shape
    if isinstance(shape, BoxShape):
        return Box(*shape.size)
    if isinstance(shape, CylinderShape):
        return Cylinder(shape.radius, shape.length)
    if isinstance(shape, SphereShape):
        return Sphere(shape.radius)
    assert isinstance(shape, MeshShape)
    file: Path = FOLDER / f"{shape.mesh}.obj"
    return Mesh(str(file), np.array(shape.scale))
