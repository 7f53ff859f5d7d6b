"""Changes a loaded world, and records the cause of each change."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
import hashlib
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydrake import geometry
from pydrake.common import MemoryFile
from pydrake.math import RigidTransform, RollPitchYaw
from shapely.geometry.base import BaseGeometry

from cns_drake.base.elementary import product
from cns_drake.base.errors import InputError
from cns_drake.city.geometry import OBJECT_MESHES, Mesh, structures
from cns_drake.scene.labels import MAX_INSTANCE
from cns_drake.scene.structure_table import StructureEntry, StructureTable
from cns_drake.scene.surfaces import TriangleSurface
from cns_drake.scene.world import World
from cns_drake.transient.ground_surface import GroundSurface
from cns_drake.transient.obstacles import Obstacles
from cns_drake.transient.world_structures import LoadedPart, LoadedStructure

# Snow farther from the drive than this would hardly be visible to a LiDAR [m].
_NEAR = 120.0
# Colour of parts of models without one.
_GREY = (0.5, 0.5, 0.5)
# Points up to this far above a structure's lowest one belong to its foot [m].
_FOOT = 0.05


class _Named(Protocol):
    @property
    def name(self) -> str: ...


Named = TypeVar("Named", bound=_Named)


class Look(NamedTuple):
    """Colour, reflectivity and material of new surfaces.

    Attributes:
        rgb: diffuse colour, from 0 to 1.
        reflectivity: reflectivity near 900 nm, from 0 to 1; None if it follows
            from the material and the colour.
        material: name of the material; None for the usual material of the
            class.
    """

    rgb: tuple[float, float, float]
    reflectivity: float | None = None
    material: str | None = None


class SceneEditing:
    """Removes, changes and adds structures in a loaded world.

    In all methods, `cause` is the field of the scenario's section `transient`
    that asks for the change, such as `snow`.
    """

    def __init__(self, world: World):
        """Begins to change a world.

        Args:
            world: the world, not yet part of a diagram; its SceneGraph is
                changed.
        """
        self._world = world
        self._source = world.plant.get_source_id()
        inspector = world.scene_graph.model_inspector()
        # Names of all geometries, of which Drake allows each only once.
        self._names = {
            inspector.GetName(number)
            for number in inspector.GetAllGeometryIds()
        }
        # Name of a structure -> part that was renamed -> its former name.
        self._renamed: defaultdict[str, dict[str, str]] = defaultdict(dict)
        # Name -> class and reflectivity of structures that were added.
        self._added: dict[str, tuple[str, float | None]] = {}
        # Name of a structure -> new part of it -> material.
        self._materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
        self._causes: defaultdict[str, list[str]] = defaultdict(list)
        self._notes: list[str] = []

    def note(self, text: str) -> None:
        """Stores a note for the user about the changes."""
        self._notes.append(f"transient: {text}")

    def blame(self, structure: str, cause: str) -> None:
        """Records why a structure was changed.

        Args:
            structure: name of the structure.
            cause: field of the scenario's section `transient` that asked for
                the change.
        """
        if cause not in self._causes[structure]:
            self._causes[structure].append(cause)

    def remove(self, thing: LoadedStructure, cause: str) -> None:
        """Removes a structure, and records why.

        Args:
            thing: the structure.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        for part in thing.parts:
            self._remove_part(part)
        self.blame(thing.name, cause)

    def move(
        self,
        thing: LoadedStructure,
        X_new: RigidTransform,
        name: str,
        cause: str,
    ) -> None:
        """Moves a structure and renames it.

        Args:
            thing: the structure.
            X_new: rigid transform in W that is applied to the structure's
                points.
            name: new name of the structure, unique in the world.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        for part in thing.parts:
            self._register(
                f"{name}/{part.name}",
                X_new @ part.X_WG,
                self.shape(part),
                *self._properties(part),
            )
        self.remove(thing, cause)
        old = self._world.structures[thing.name]
        self._added[name] = (old.semantic_class, old.reflectivity)
        self._materials[name] |= old.materials
        self.blame(name, cause)

    def cover_part(self, part: LoadedPart, p_W: np.ndarray, look: Look) -> None:
        """Moves a part by p_W (3,) [m] in W and gives it a new look."""
        structure = part.geometry.structure
        name = f"{part.name}_covered"
        self._register(
            f"{structure}/{name}",
            RigidTransform(p_W) @ part.X_WG,
            self.shape(part),
            *_properties(look),
        )
        self._note_material(structure, name, look.material)
        self._remove_part(part)

    def add(
        self,
        name: str,
        semantic_class: str,
        model: structures.Model,
        X_WS: RigidTransform,
        cause: str,
    ) -> None:
        """Adds a structure to the world.

        Args:
            name: name of the structure, unique in the world.
            semantic_class: class of the structure.
            model: a model of the city generator.
            X_WS: pose of the structure S in W.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        for part in model.parts:
            self._register(
                f"{name}/{part.name}",
                X_WS @ RigidTransform(RollPitchYaw(*part.rpy), part.xyz),
                _model_shape(part.shape, model.meshes),
                *_properties(Look(part.rgb or _GREY)),
            )
            self._note_material(name, part.name, part.material)
        self._added[name] = (semantic_class, None)
        self.blame(name, cause)

    def _note_material(
        self, structure: str, part: str, material: str | None
    ) -> None:
        if material is not None:
            self._materials[structure][part] = material

    def shape(self, part: LoadedPart) -> geometry.Shape:
        """Returns the Drake shape of a part."""
        inspector = self._world.scene_graph.model_inspector()
        return inspector.GetShape(part.geometry.geometry_id)

    def shrink(self, thing: LoadedStructure, share: float, cause: str) -> None:
        """Scales a structure down about the middle of its foot.

        Args:
            thing: the structure.
            share: scale factor of all lengths, from 0 to 1.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        p_WPs = thing.p_WPs
        feet = p_WPs[p_WPs[:, 2] <= thing.bottom + _FOOT]
        x, y = (feet[:, :2].min(axis=0) + feet[:, :2].max(axis=0)) / 2
        p_WS = np.array([x, y, thing.bottom])
        for part in thing.parts:
            X_WG = RigidTransform(
                part.X_WG.rotation(),
                p_WS + share * (part.X_WG.translation() - p_WS),
            )
            self._replace_part(
                part, X_WG, _scaled_shape(self.shape(part), share)
            )
        self.blame(thing.name, cause)

    def rebuild(
        self,
        thing: LoadedStructure,
        before: structures.Model,
        after: structures.Model,
        X_WS: RigidTransform,
        cause: str,
    ) -> None:
        """Changes a structure by the difference between two models.

        Parts that both models contain stay unchanged. A changed part keeps its
        colour and its material.

        Args:
            thing: the structure.
            before: model of the structure as it is, with the same parts in the
                same order.
            after: the changed model. A part replaces the part of the same name
                in `before`; a part with a new name is added.
            X_WS: pose of the frame S of both models in W.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        loaded = dict(zip(before.parts, thing.parts, strict=True))
        old = {part.name: one for part, one in loaded.items()}
        kept = loaded.keys() & set(after.parts)
        taken = {one.name for one in thing.parts}
        replaced = {part.name for part in after.parts}
        for part in after.parts:
            if part in kept:
                continue
            X_WG = X_WS @ RigidTransform(RollPitchYaw(*part.rpy), part.xyz)
            shape = _model_shape(part.shape, after.meshes)
            if part.name in old:
                self._replace_part(old[part.name], X_WG, shape)
                continue
            name = part.name
            while name in taken:
                name += "_"
            look = Look(part.rgb or _GREY)
            self._register(
                f"{thing.name}/{name}", X_WG, shape, *_properties(look)
            )
            self._note_material(thing.name, name, part.material)
        for name, one in old.items():
            if name not in replaced:
                self._remove_part(one)
        self.blame(thing.name, cause)

    def keep_triangles(self, part: LoadedPart, kept: np.ndarray) -> None:
        """Removes all triangles of a part except those with indices `kept`."""
        surface = part.geometry.surface
        assert isinstance(surface, TriangleSurface)
        triangles = surface.triangles[kept]
        # The mesh is unscaled, so that parts that shared a mesh share one
        # again.
        shape = self.shape(part)
        scale = np.ones(3)
        # Of the shapes with triangles, only boxes and cones have no scale.
        if isinstance(shape, geometry.Mesh | geometry.Convex):
            scale = np.array(shape.scale3())
        if len(triangles) == 0:
            self._remove_part(part)
            return
        if np.prod(scale) < 0.0:
            triangles = triangles[:, ::-1]
        mesh = _memory_mesh(surface.p_GVset / scale, triangles, scale)
        self._replace_part(part, part.X_WG, mesh)

    def add_triangles(
        self,
        part: LoadedPart,
        name: str,
        p_WVs: np.ndarray,
        triangles: np.ndarray,
        look: Look,
    ) -> None:
        """Adds a part made of triangles to the structure of an existing part.

        Args:
            part: the existing part.
            name: name of the new part.
            p_WVs: (N, 3) vertices in W [m].
            triangles: (M, 3) indices of vertices.
            look: colour and reflectivity of the new part.
        """
        R, p = part.X_WG.rotation().matrix(), part.X_WG.translation()
        mesh = _memory_mesh(product(p_WVs - p, R), triangles)
        structure = part.geometry.structure
        self._note_material(structure, name, look.material)
        name = f"{structure}/{name}"
        self._register(name, part.X_WG, mesh, *_properties(look))

    def add_mesh(
        self,
        name: str,
        semantic_class: str,
        p_WVs: np.ndarray,
        triangles: np.ndarray,
        look: Look,
        cause: str,
    ) -> None:
        """Adds a structure made of triangles to the world.

        Args:
            name: name of the structure, unique in the world.
            semantic_class: class of the structure.
            p_WVs: (N, 3) vertices in W [m].
            triangles: (M, 3) indices of vertices.
            look: colour and reflectivity of the structure.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        # Vertices have seven significant digits, which are too few far from
        # the origin of the mesh.
        middle = np.round(p_WVs.mean(axis=0))
        self._register(
            f"{name}/surface",
            RigidTransform(middle),
            _memory_mesh(p_WVs - middle, triangles),
            *_properties(look),
        )
        self._note_material(name, "surface", look.material)
        self._added[name] = (semantic_class, None)
        self.blame(name, cause)

    def finish(self) -> World:
        """Returns the changed world, with a new structure table and new notes.

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
            structures=StructureTable(map(self._changed, entries)),
            notes=(*self._world.notes, *self._notes),
        )

    def _changed(self, entry: StructureEntry) -> StructureEntry:
        new = [
            cause
            for cause in self._causes.get(entry.name, ())
            if cause not in entry.causes
        ]
        materials = dict(self._materials.get(entry.name, {}))
        known = {**entry.materials, **materials}
        for new_name, name in self._renamed.get(entry.name, {}).items():
            if name in known:
                materials[new_name] = known[name]
        if not (new or materials):
            return entry
        return replace(
            entry,
            causes=(*entry.causes, *new),
            materials={**entry.materials, **materials},
        )

    def _properties(
        self, part: LoadedPart
    ) -> tuple[geometry.GeometryProperties, ...]:
        inspector = self._world.scene_graph.model_inspector()
        number = part.geometry.geometry_id
        shown = inspector.GetIllustrationProperties(number)
        seen = inspector.GetPerceptionProperties(number)
        return (seen,) if shown is None else (seen, shown)

    def _register(
        self,
        name: str,
        X_WG: RigidTransform,
        shape: geometry.Shape,
        *properties: geometry.GeometryProperties,
    ) -> None:
        structure, _, part = name.partition("/")
        # Parts of several links, which have frames of their own, may share a
        # name; here, all are fixed to the world.
        while name in self._names:
            name += "_"
        self._names.add(name)
        if (new_name := name.partition("/")[2]) != part:
            self._renamed[structure][new_name] = part
        scene_graph = self._world.scene_graph
        number = scene_graph.RegisterGeometry(
            self._source,
            scene_graph.world_frame_id(),
            geometry.GeometryInstance(X_WG, shape, name),
        )
        for one in properties:
            scene_graph.AssignRole(self._source, number, one)

    def _replace_part(
        self, part: LoadedPart, X_WG: RigidTransform, shape: geometry.Shape
    ) -> None:
        """Gives a part another pose and shape; its look stays the same."""
        # The old part is removed first, since the new one may have its name.
        properties = [type(one)(one) for one in self._properties(part)]
        self._remove_part(part)
        name = f"{part.geometry.structure}/{part.name}"
        self._register(name, X_WG, shape, *properties)

    def _remove_part(self, part: LoadedPart) -> None:
        self._names.discard(part.geometry.name)
        self._world.scene_graph.RemoveGeometry(
            self._source, part.geometry.geometry_id
        )


@dataclass
class Surroundings:
    """The surroundings of a drive, to which changes are made.

    Attributes:
        editing: makes the changes in the world.
        things: name -> structure, as they are before the changes.
        drive: path of the vehicle, seen from above [m].
        kept_free: area that must stay free of new objects, seen from above [m].
        seed: seed of all random choices.
    """

    editing: SceneEditing
    things: Mapping[str, LoadedStructure]
    drive: BaseGeometry
    kept_free: BaseGeometry
    seed: int

    @cached_property
    def ground(self) -> GroundSurface:
        """The ground near the drive."""
        return GroundSurface(self.things, self.drive.buffer(_NEAR))

    def of_classes(self, classes: Collection[str]) -> list[LoadedStructure]:
        """Returns the structures of some classes."""
        return [t for t in self.things.values() if t.semantic_class in classes]

    def obstacles_of(self, classes: Collection[str]) -> Obstacles:
        """Returns the areas where new objects must not stand.

        The result contains the area `kept_free` and the footprints of all
        structures of some classes.
        """
        return self._obstacles(self.of_classes(classes))

    def obstacles_except(self, ignored: Collection[str]) -> Obstacles:
        """Returns the areas where new objects must not stand.

        The result contains the area `kept_free` and the footprints of all
        structures except those of the classes `ignored`.
        """
        return self._obstacles(
            thing
            for thing in self.things.values()
            if thing.semantic_class not in ignored
        )

    def _obstacles(self, standing: Iterable[LoadedStructure]) -> Obstacles:
        feet = [(thing.name, thing.footprint) for thing in standing]
        return Obstacles([("", self.kept_free), *feet])

    def chosen(
        self, cause: str, things: Iterable[Named], share: float
    ) -> Iterator[tuple[Named, np.random.Generator]]:
        """Yields a random share of objects, each with its own random generator.

        The choice depends on the seed, the cause and the names of the objects.

        Args:
            cause: field of the scenario's section `transient` that asks for the
                change.
            things: objects with a `name`.
            share: share of the objects, from 0 to 1.
        """
        for thing in things:
            rng = change_rng(self.seed, cause, thing.name)
            if rng.uniform() < share:
                yield thing, rng


def change_rng(seed: int, cause: str, name: str) -> np.random.Generator:
    """Returns the random generator for one kind of change of one structure.

    The random numbers do not depend on other structures or other kinds of
    change.

    Args:
        seed: seed of the changes.
        cause: field of the section `transient` that asks for the change.
        name: name of the structure.
    """
    digest = hashlib.sha256(f"{seed}/{cause}/{name}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "little"))


def _memory_mesh(
    vertices: np.ndarray,
    triangles: np.ndarray,
    scale: ArrayLike = (1.0, 1.0, 1.0),
) -> geometry.Mesh:
    """Returns a mesh in memory; equal meshes give the same text.

    Readers thus recognise them as the same mesh. It has vertices (N, 3), before
    they are scaled [m], and triangles (M, 3).
    """
    used, corners = np.unique(triangles, return_inverse=True)
    # Python's numbers are formatted several times faster than NumPy's.
    lines = [
        f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices[used].tolist()
    ]
    lines += [
        f"f {a} {b} {c}" for a, b, c in (corners.reshape(-1, 3) + 1).tolist()
    ]
    text = "\n".join(lines) + "\n"
    file = MemoryFile(text.encode(), ".obj", "mesh")
    return geometry.Mesh(geometry.InMemoryMesh(mesh_file=file), scale)


def _properties(look: Look) -> tuple[geometry.GeometryProperties, ...]:
    seen = geometry.PerceptionProperties()
    shown = geometry.IllustrationProperties()
    for properties in (seen, shown):
        rgba = geometry.Rgba(*look.rgb, 1.0)
        properties.AddProperty("phong", "diffuse", rgba)
    if look.reflectivity is not None:
        seen.AddProperty("lidar", "reflectivity", look.reflectivity)
    return seen, shown


def _model_shape(
    shape: structures.Shape, meshes: Mapping[str, Mesh]
) -> geometry.Shape:
    """Returns a Drake shape that equals a shape of the city generator.

    `meshes` maps names to the meshes of its model.
    """
    if isinstance(shape, structures.BoxShape):
        return geometry.Box(*shape.size)
    if isinstance(shape, structures.CylinderShape):
        return geometry.Cylinder(shape.radius, shape.length)
    if isinstance(shape, structures.SphereShape):
        return geometry.Sphere(shape.radius)
    shared = OBJECT_MESHES / f"{shape.mesh}.obj"
    if shared.is_file():
        return geometry.Mesh(str(shared), shape.scale)
    mesh = meshes[shape.mesh]
    return _memory_mesh(mesh.vertices, mesh.triangles(), shape.scale)


def _scaled_shape(shape: geometry.Shape, share: float) -> geometry.Shape:
    """Returns a shape scaled about its origin by the factor `share`.

    A half space is returned as it is.
    """
    if isinstance(shape, geometry.Mesh | geometry.Convex):
        scale = share * np.array(shape.scale3())
        return type(shape)(shape.source(), scale)
    if isinstance(shape, geometry.Box):
        return geometry.Box(*(share * np.array(shape.size())))
    if isinstance(shape, geometry.Sphere):
        return geometry.Sphere(share * shape.radius())
    if isinstance(shape, geometry.Ellipsoid):
        axes = (shape.a(), shape.b(), shape.c())
        return geometry.Ellipsoid(*(share * length for length in axes))
    if isinstance(shape, geometry.Cylinder | geometry.Capsule):
        return type(shape)(share * shape.radius(), share * shape.length())
    if isinstance(shape, geometry.MeshcatCone):
        sizes = (shape.height(), shape.a(), shape.b())
        return geometry.MeshcatCone(*(share * length for length in sizes))
    return shape
