"""Changes the structures of a loaded world, and records why."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake import geometry
from pydrake.common import MemoryFile
from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.scene import GREY, ScenePart, SceneStructure, World
from evaluation.base import MAX_INSTANCE, InputError, product
from worlds.shapes import (
    OBJECT_MESHES,
    BoxShape,
    CylinderShape,
    Mesh,
    Model,
    Part,
    Shape,
    SphereShape,
    StructureEntry,
    StructureTable,
)

# Points up to this far above a structure's lowest one belong to its foot [m].
_FOOT = 0.05


class SurfaceLook(NamedTuple):
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
            inspector.GetName(geometry_id)
            for geometry_id in inspector.GetAllGeometryIds()
        }
        self._table = TableChanges(world.structures)
        self._notes: list[str] = []

    def note(self, text: str) -> None:
        """Stores a note for the user about the changes."""
        self._notes.append(f"transient: {text}")

    def record_cause(self, name: str, cause: str) -> None:
        """Records why a structure was changed.

        Args:
            name: name of the structure.
            cause: field of the scenario's section `transient` that asked for
                the change.
        """
        self._table.add_cause(name, cause)

    def remove(self, structure: SceneStructure, cause: str) -> None:
        """Removes a structure, and records why.

        Args:
            structure: the structure.
            cause: field of the scenario's section `transient` that asks for the
                change.
        """
        for part in structure.parts:
            self._remove_part(part)
        self.record_cause(structure.name, cause)

    def move(
        self,
        structure: SceneStructure,
        X_new: RigidTransform,
        name: str,
        cause: str,
    ) -> None:
        """Moves a structure and renames it.

        Args:
            structure, cause: see `remove`.
            X_new: rigid transform in W that is applied to the structure's
                points.
            name: new name of the structure, unique in the world.
        """
        for part in structure.parts:
            self._register(
                name,
                part.name,
                X_new @ _pose_of(part),
                self._shape(part),
                self._part_properties(part),
            )
        self.remove(structure, cause)
        self._table.add_structure(
            replace(structure.entry, name=name, causes=())
        )
        self.record_cause(name, cause)

    def cover_part(
        self, part: ScenePart, p_W: np.ndarray, look: SurfaceLook
    ) -> None:
        """Moves a part by p_W (3,) [m] in W and gives it another look."""
        self._add_part(
            part.geometry.structure,
            f"{part.name}_covered",
            RigidTransform(p_W) @ _pose_of(part),
            self._shape(part),
            look,
        )
        self._remove_part(part)

    def add(
        self,
        name: str,
        semantic_class: str,
        model: Model,
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
            shape = _model_shape(part.shape, model.meshes)
            X_WG = X_WS @ _pose_in_model(part)
            self._add_part(name, part.name, X_WG, shape, _look_of(part))
        self._table.add_structure(StructureEntry(0, name, semantic_class))
        self.record_cause(name, cause)

    def _shape(self, part: ScenePart) -> geometry.Shape:
        """Returns the Drake shape of a part."""
        inspector = self._world.scene_graph.model_inspector()
        return inspector.GetShape(part.geometry.geometry_id)

    def shrink(
        self, structure: SceneStructure, share: float, cause: str
    ) -> None:
        """Scales a structure down about the middle of its foot.

        Args:
            structure, cause: see `remove`.
            share: scale factor of all lengths, from 0 to 1.
        """
        p_WPs = structure.p_WPs
        feet = p_WPs[p_WPs[:, 2] <= structure.bottom + _FOOT]
        x, y = (feet[:, :2].min(axis=0) + feet[:, :2].max(axis=0)) / 2
        p_WS = np.array([x, y, structure.bottom])
        for part in structure.parts:
            X_WG = _pose_of(part)
            X_WG.set_translation(p_WS + share * (X_WG.translation() - p_WS))
            self._replace_part(
                part, X_WG, _scaled_shape(self._shape(part), share)
            )
        self.record_cause(structure.name, cause)

    def rebuild(
        self,
        structure: SceneStructure,
        before: Model,
        after: Model,
        X_WS: RigidTransform,
        cause: str,
    ) -> None:
        """Changes a structure by the difference between two models.

        Parts that both models contain stay unchanged. A changed part keeps its
        colour and its material.

        Args:
            structure, cause: see `remove`.
            before: model of the unchanged structure, with the parts in the
                order of the structure's parts.
            after: the changed model. A part replaces the part of the same name
                in `before`; a part with a new name is added.
            X_WS: pose of the frame S of both models in W.
        """
        loaded = dict(zip(before.parts, structure.parts, strict=True))
        old = {part.name: one for part, one in loaded.items()}
        kept = loaded.keys() & set(after.parts)
        taken = {one.name for one in structure.parts}
        for part in after.parts:
            if part in kept:
                continue
            X_WG = X_WS @ _pose_in_model(part)
            shape = _model_shape(part.shape, after.meshes)
            if part.name in old:
                self._replace_part(old[part.name], X_WG, shape)
                continue
            name = part.name
            while name in taken:
                name += "_"
            self._add_part(structure.name, name, X_WG, shape, _look_of(part))
        left = {part.name for part in after.parts}
        for name, one in old.items():
            if name not in left:
                self._remove_part(one)
        self.record_cause(structure.name, cause)

    def keep_triangles(self, part: ScenePart, kept: np.ndarray) -> None:
        """Removes all triangles of a part except those with indices `kept`."""
        triangles = part.triangles[kept]
        if len(triangles) == 0:
            self._remove_part(part)
            return
        # The mesh is unscaled, so that parts that shared a mesh share one
        # again.
        shape = self._shape(part)
        scale = np.ones(3)
        # Of the shapes with triangles, only boxes and cones have no scale.
        if isinstance(shape, geometry.Mesh | geometry.Convex):
            scale = np.array(shape.scale3())
        if np.prod(scale) < 0.0:
            triangles = triangles[:, ::-1]
        mesh = _memory_mesh(part.p_GPs / scale, triangles, scale)
        self._replace_part(part, _pose_of(part), mesh)

    def add_triangles(
        self,
        part: ScenePart,
        name: str,
        p_WVs: np.ndarray,
        triangles: np.ndarray,
        look: SurfaceLook,
    ) -> None:
        """Adds a part made of triangles to the structure of an existing part.

        Args:
            part: the existing part.
            name: name of the new part.
            p_WVs: (N, 3) vertices in W [m].
            triangles: (M, 3) indices of vertices.
            look: colour, reflectivity and material of the new part.
        """
        X_WG = _pose_of(part)
        R, p = X_WG.rotation().matrix(), X_WG.translation()
        mesh = _memory_mesh(product(p_WVs - p, R), triangles)
        self._add_part(part.geometry.structure, name, X_WG, mesh, look)

    def add_mesh(
        self,
        name: str,
        semantic_class: str,
        p_WVs: np.ndarray,
        triangles: np.ndarray,
        look: SurfaceLook,
        cause: str,
    ) -> None:
        """Adds a structure made of triangles to the world.

        Args:
            name, semantic_class, cause: see `add`.
            p_WVs: (N, 3) vertices in W [m].
            triangles: (M, 3) indices of vertices.
            look: colour, reflectivity and material of the structure.
        """
        # Vertices have seven significant digits, which are too few far from
        # the origin of the mesh.
        middle = np.round(p_WVs.mean(axis=0))
        mesh = _memory_mesh(p_WVs - middle, triangles)
        self._add_part(name, "surface", RigidTransform(middle), mesh, look)
        self._table.add_structure(StructureEntry(0, name, semantic_class))
        self.record_cause(name, cause)

    def finish(self) -> World:
        """Returns the changed world, with a new structure table and new notes.

        Raises:
            InputError: there are more structures than instance ids.
        """
        return replace(
            self._world,
            structures=self._table.changed_table(),
            notes=(*self._world.notes, *self._notes),
        )

    def _add_part(
        self,
        structure: str,
        part: str,
        X_WG: RigidTransform,
        shape: geometry.Shape,
        look: SurfaceLook,
    ) -> None:
        self._register(structure, part, X_WG, shape, _look_properties(look))
        if look.material is not None:
            self._table.set_material(structure, part, look.material)

    def _replace_part(
        self, part: ScenePart, X_WG: RigidTransform, shape: geometry.Shape
    ) -> None:
        """Gives a part another pose and shape; its look stays the same."""
        # The old part is removed first, since the new one may have its name.
        properties = [type(one)(one) for one in self._part_properties(part)]
        self._remove_part(part)
        structure = part.geometry.structure
        self._register(structure, part.name, X_WG, shape, properties)

    def _remove_part(self, part: ScenePart) -> None:
        self._names.discard(part.geometry.name)
        self._world.scene_graph.RemoveGeometry(
            self._source, part.geometry.geometry_id
        )

    def _part_properties(
        self, part: ScenePart
    ) -> list[geometry.GeometryProperties]:
        inspector = self._world.scene_graph.model_inspector()
        geometry_id = part.geometry.geometry_id
        seen = inspector.GetPerceptionProperties(geometry_id)
        shown = inspector.GetIllustrationProperties(geometry_id)
        return [seen] if shown is None else [seen, shown]

    def _register(
        self,
        structure: str,
        part: str,
        X_WG: RigidTransform,
        shape: geometry.Shape,
        properties: Iterable[geometry.GeometryProperties],
    ) -> None:
        """Adds a geometry to the SceneGraph, fixed to the world."""
        # Parts of several links, which have frames of their own, may share a
        # name; here, all are fixed to the world.
        free = part
        while f"{structure}/{free}" in self._names:
            free += "_"
        if free != part:
            self._table.rename_part(structure, part, free)
        name = f"{structure}/{free}"
        self._names.add(name)
        scene_graph = self._world.scene_graph
        geometry_id = scene_graph.RegisterGeometry(
            self._source,
            scene_graph.world_frame_id(),
            geometry.GeometryInstance(X_WG, shape, name),
        )
        for one in properties:
            scene_graph.AssignRole(self._source, geometry_id, one)


def _pose_of(part: ScenePart) -> RigidTransform:
    """Returns the pose X_WG of a part as Drake's."""
    return RigidTransform(part.X_WG)


def _pose_in_model(part: Part) -> RigidTransform:
    """Returns the pose of a part of a model in the model's frame."""
    return RigidTransform(RollPitchYaw(*part.rpy), part.xyz)


def _look_of(part: Part) -> SurfaceLook:
    return SurfaceLook(part.rgb or GREY, material=part.material)


def _look_properties(look: SurfaceLook) -> list[geometry.GeometryProperties]:
    seen = geometry.PerceptionProperties()
    shown = geometry.IllustrationProperties()
    for properties in (seen, shown):
        rgba = geometry.Rgba(*look.rgb, 1.0)
        properties.AddProperty("phong", "diffuse", rgba)
    if look.reflectivity is not None:
        seen.AddProperty("lidar", "reflectivity", look.reflectivity)
    return [seen, shown]


def _memory_mesh(
    vertices: np.ndarray,
    triangles: np.ndarray,
    scale: ArrayLike = (1.0, 1.0, 1.0),
) -> geometry.Mesh:
    """Returns a mesh in memory; equal meshes give the same text.

    Readers thus recognise equal meshes as the same mesh. The mesh has vertices
    (N, 3), given before scaling [m], and triangles (M, 3).
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


def _model_shape(shape: Shape, meshes: Mapping[str, Mesh]) -> geometry.Shape:
    """Returns a Drake shape that equals a shape of the city generator.

    `meshes` maps names to the meshes of the model to which the shape belongs.
    """
    if isinstance(shape, BoxShape):
        return geometry.Box(*shape.size)
    if isinstance(shape, CylinderShape):
        return geometry.Cylinder(shape.radius, shape.length)
    if isinstance(shape, SphereShape):
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


class TableChanges:
    """New structures, changed parts and causes, for a structure table."""

    def __init__(self, table: StructureTable):
        """Begins without changes."""
        self._table = table
        # Name -> entry of a new structure, still without an instance id.
        self._added: dict[str, StructureEntry] = {}
        # Name of a structure -> new part of it -> material.
        self._materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
        # Name of a structure -> part that was renamed -> its former name.
        self._renamed: defaultdict[str, dict[str, str]] = defaultdict(dict)
        self._causes: defaultdict[str, list[str]] = defaultdict(list)

    def add_structure(self, entry: StructureEntry) -> None:
        """Records a new structure, which gets a free instance id.

        The name in its entry must be unique in the world.
        """
        self._added[entry.name] = entry

    def set_material(self, structure: str, part: str, material: str) -> None:
        """Records the material of a new part."""
        self._materials[structure][part] = material

    def rename_part(self, structure: str, old: str, new: str) -> None:
        """Records that a part, which keeps its material, has another name."""
        self._renamed[structure][new] = old

    def add_cause(self, structure: str, cause: str) -> None:
        """Records why a structure was changed; each cause counts once."""
        if cause not in self._causes[structure]:
            self._causes[structure].append(cause)

    def changed_table(self) -> StructureTable:
        """Returns the table with the changes; new structures come last.

        Raises:
            InputError: there are more structures than instance ids.
        """
        first = self._table.last_instance + 1
        if first + len(self._added) - 1 > MAX_INSTANCE:
            raise InputError(
                f"transient: {len(self._added)} new structures and "
                f"{first - 1} others are more than instance ids can count "
                f"({MAX_INSTANCE})"
            )
        entries = [
            *self._table,
            *(
                replace(self._added[name], instance=first + k)
                for k, name in enumerate(sorted(self._added))
            ),
        ]
        return StructureTable(map(self._changed_entry, entries))

    def _changed_entry(self, entry: StructureEntry) -> StructureEntry:
        causes = [
            cause
            for cause in self._causes.get(entry.name, ())
            if cause not in entry.causes
        ]
        materials = dict(self._materials.get(entry.name, {}))
        known = {**entry.materials, **materials}
        for new, old in self._renamed.get(entry.name, {}).items():
            if old in known:
                materials[new] = known[old]
        if not (causes or materials):
            return entry
        return replace(
            entry,
            causes=(*entry.causes, *causes),
            materials={**entry.materials, **materials},
        )
