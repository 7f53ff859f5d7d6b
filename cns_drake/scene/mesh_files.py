"""Reads the surfaces of meshes, from files or from memory."""

from itertools import pairwise
from pathlib import Path
import tempfile

import numpy as np
from pydrake.geometry import Convex, Mesh, MeshSource

from cns_drake.scene.collada_check import plain_collada
from cns_drake.scene.drake_errors import PARSER_ERRORS, collected_errors
from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.gltf_check import plain_gltf
from cns_drake.scene.mesh_check import GLTF, check_mesh_file, stl_corners
from cns_drake.scene.obj_check import unmarked
from cns_drake.scene.obj_files import ObjFiles
from cns_drake.scene.ply_check import has_single_vertices
from cns_drake.scene.surfaces import LARGEST_SIZE, TriangleSurface
from evaluation.base import InputError, note, read_bytes, reading

# Formats whose y axis points up. Drake rotates them so that z does.
_Y_UP = (*GLTF, ".dae")
# Greatest step of coordinates that no note mentions [m].
_COARSE = 0.005


class MeshFiles:
    """Reads mesh files, each only once.

    All geometries with the same mesh at the same scale share one surface.
    """

    def __init__(self, foreign: ForeignMeshes, objs: ObjFiles):
        self._foreign = foreign
        self._objs = objs
        self._unscaled: dict[object, TriangleSurface] = {}
        self._surfaces: dict[tuple, TriangleSurface] = {}

    def read(self, name: str, shape: Mesh | Convex) -> TriangleSurface:
        """Returns the surface of a mesh shape in the geometry's frame G.

        Raises:
            InputError: the mesh is missing, cannot be read, or is too large;
                the message names the geometry or the file.
        """
        key = mesh_shape_key(shape)
        if key in self._surfaces:
            return self._surfaces[key]
        source = shape.source()
        place = source.path() if source.is_path() else f"geometry '{name}'"
        try:
            # The error alone is enough.
            with reading(Path(place)), collected_errors():
                surface = (
                    _read_hull(shape, self._objs)
                    if isinstance(shape, Convex)
                    else self._read_mesh(shape)
                )
            # The comparison is False for NaN.
            if not np.abs(surface.p_GVset).max() <= LARGEST_SIZE:
                raise ValueError(f"larger than {LARGEST_SIZE:g} m")
        except PARSER_ERRORS as error:
            fault = " ".join(str(error).split())
            file = f"{source.path()}: " if source.is_path() else ""
            raise InputError(f"{file}geometry '{name}': {fault}") from error
        self._surfaces[key] = surface
        return surface

    def _read_mesh(self, shape: Mesh) -> TriangleSurface:
        source = shape.source()
        key = _source_key(source)
        surface = self._unscaled.get(key)
        if surface is None:
            surface = self._unscaled[key] = self._read_source(source)
        triangles = surface.triangles
        scale = shape.scale3()
        if np.prod(scale) < 0.0:  # Mirroring turns faces inside out.
            triangles = triangles[:, ::-1]
        with np.errstate(over="ignore", invalid="ignore"):
            return TriangleSurface(surface.p_GVset * scale, triangles)

    def _read_source(self, source: MeshSource) -> TriangleSurface:
        if source.is_path():
            return self._read_file(Path(source.path()))
        # Open3D can only read files.
        with tempfile.TemporaryDirectory() as folder:
            return self._read_file(_write_mesh(source, Path(folder)))

    def _read_file(self, path: Path) -> TriangleSurface:
        if not path.is_file():
            raise ValueError("no such mesh file")
        ending = path.suffix.lower()
        check_mesh_file(path, self._objs)
        step = 0.0
        if ending == ".obj":
            p_GVset, triangles = self._objs.surface(path)
            expected = self._objs.faces(path).num_triangles
            _check_count(len(triangles), expected)
        else:
            with unmarked(path) as file:
                p_GVset, triangles, step = self._read_foreign(file, path.parent)
        if len(triangles) == 0:
            raise ValueError("holds no triangles")
        # Drake only warns; a ray caster would read outside its memory.
        if not 0 <= triangles.min() <= triangles.max() < len(p_GVset):
            raise ValueError("a face has a vertex that is not there")
        if step > _COARSE:
            note(
                f"{path}: coordinates of single precision are coarse here:"
                f" steps of {step:.2g} m; export it again with vertices near"
                " the origin, or as OBJ or PLY with doubles"
            )
        if ending in _Y_UP:
            x, y, z = p_GVset.T
            p_GVset = np.stack([x, -z, y], axis=1)
        return TriangleSurface(p_GVset, triangles)

    def _read_foreign(
        self, path: Path, folder: Path
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Reads a mesh with Open3D.

        Returns:
            Vertices (N, 3), float64 [m], triangles (M, 3), int32, and the step
            between the coordinates that the file can have [m].
        """
        ending = path.suffix.lower()
        p_offset, expected, text = np.zeros(3), 0, None
        if ending in GLTF:
            text, p_offset, expected = plain_gltf(read_bytes(path), folder)
            ending = ".gltf"
        elif ending == ".dae":
            text, p_offset = plain_collada(path)
        elif ending == ".stl":
            p_GVset = stl_corners(read_bytes(path))
            if p_GVset is not None:
                corners = np.arange(len(p_GVset), dtype=np.int32)
                return p_GVset, corners.reshape(-1, 3), 0.0
        if text is None:
            p_GVset, triangles = self._foreign.read(path)
        else:
            with tempfile.TemporaryDirectory() as place:
                copy = Path(place) / f"mesh{ending}"
                copy.write_bytes(text)
                p_GVset, triangles = self._foreign.read(copy)
        _check_count(len(triangles), expected)
        step = 0.0
        if ending != ".ply" or has_single_vertices(path):
            farthest = np.abs(p_GVset).max(initial=0.0)
            step = float(np.spacing(np.float32(farthest)))
        return p_GVset + p_offset, triangles, step


def _check_count(found: int, expected: int) -> None:
    """Checks that all triangles of a file were read.

    Raises:
        ValueError: some are missing.
    """
    if found < expected:
        raise ValueError(
            f"only {found} of {expected} triangles can be read; faces have"
            " vertices that are not there, or outlines that touch themselves:"
            " export it with valid triangles"
        )


def _write_mesh(source: MeshSource, folder: Path) -> Path:
    """Writes a mesh in memory and its supporting files to a folder.

    Returns:
        The file of the mesh.

    Raises:
        ValueError: a supporting file would be outside the folder.
    """
    mesh = source.in_memory()
    path = folder / f"mesh{source.extension()}"
    path.write_bytes(mesh.mesh_file.contents())
    for uri, file in mesh.supporting_files.items():
        target = folder / uri
        if not target.resolve().is_relative_to(folder.resolve()):
            raise ValueError(
                f"the file '{uri}', which it names, is not beside the mesh"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(
            file.read_bytes() if isinstance(file, Path) else file.contents()
        )
    return path


def mesh_shape_key(shape: Mesh | Convex) -> tuple:
    """Returns a dictionary key for a mesh or convex hull.

    Two keys are equal only if the shapes are equal.
    """
    return type(shape), _source_key(shape.source()), tuple(shape.scale3())


def _source_key(source: MeshSource) -> object:
    """Returns a key that is equal only for sources of the same mesh."""
    if source.is_path():
        return str(source.path())
    mesh = source.in_memory()
    files = {"": mesh.mesh_file, **mesh.supporting_files}
    return tuple(
        (uri, f if isinstance(f, Path) else f.sha256().to_string())
        for uri, f in sorted(files.items())
    )


def _read_hull(shape: Convex, objs: ObjFiles) -> TriangleSurface:
    """Returns Drake's convex hull, with the scale applied."""
    source = shape.source()
    if source.is_path():
        check_mesh_file(Path(source.path()), objs)
        with unmarked(Path(source.path())) as file:
            # Drake reads the file here.
            hull = Convex(str(file), shape.scale3()).GetConvexHull()
    else:
        hull = shape.GetConvexHull()
    vertices = [hull.vertex(k) for k in range(hull.num_vertices())]
    triangles = []
    for k in range(hull.num_faces()):
        face = hull.element(k)
        corners = [face.vertex(i) for i in range(face.num_vertices())]
        for second, third in pairwise(corners[1:]):
            triangles.append((corners[0], second, third))
    return TriangleSurface(
        np.array(vertices, dtype=float), np.array(triangles, dtype=np.int32)
    )
