"""Surfaces of mesh files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.geometry import Mesh, ReadObjToTriangleSurfaceMesh

from cns_drake.scene.drake_errors import PARSER_ERRORS, told_by_drake
from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.surfaces import LARGEST_SIZE, TriangleSurface
from evaluation.support.errors import InputError


class MeshFiles:
    """Reads mesh files, each once however many geometries refer to it."""

    def __init__(self, foreign: ForeignMeshes):
        self._foreign = foreign
        self._unscaled: dict[Path, TriangleSurface] = {}

    def read(self, name: str, shape: Mesh) -> TriangleSurface:
        with told_by_drake():  # Beside an error, no warning.
            return self._read(name, shape)

    def _read(self, name: str, shape: Mesh) -> TriangleSurface:
        if not shape.source().is_path():
            raise InputError(f"geometry '{name}': its mesh is not a file")
        path = Path(shape.source().path())
        surface = self._unscaled.get(path)
        if surface is None:
            surface = self._unscaled[path] = self._read_file(name, path)
        triangles = surface.triangles
        scale = shape.scale3()
        if np.prod(scale) < 0.0:  # A reflection turns the faces inside out.
            triangles = triangles[:, ::-1]
        with np.errstate(over="ignore", invalid="ignore"):
            p_GVset = surface.p_GVset * scale
            is_small = np.abs(p_GVset).max() <= LARGEST_SIZE  # False for NaN.
        if not is_small:
            raise InputError(
                f"{path}: geometry '{name}': larger than {LARGEST_SIZE:g} m"
            )
        return TriangleSurface(p_GVset, triangles)

    def _read_file(self, name: str, path: Path) -> TriangleSurface:
        if not path.is_file():
            raise InputError(f"{path}: geometry '{name}': no such mesh file")
        is_obj = path.suffix.lower() == ".obj"
        read = _read_obj if is_obj else self._foreign.read
        try:
            p_GVset, triangles = read(path)
            if len(triangles) == 0:
                raise ValueError("holds no triangles")
            # Drake warns of it and goes on; a ray caster reads foreign memory.
            if not 0 <= triangles.min() <= triangles.max() < len(p_GVset):
                raise ValueError("a face has a vertex that is not there")
        except PARSER_ERRORS as error:
            fault = " ".join(str(error).split())
            raise InputError(f"{path}: geometry '{name}': {fault}") from error
        return TriangleSurface(p_GVset, triangles)


def _read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    mesh = ReadObjToTriangleSurfaceMesh(path)
    triangles = [[t.vertex(k) for k in range(3)] for t in mesh.triangles()]
    return (
        np.asarray(mesh.vertices(), dtype=float).reshape(-1, 3),
        np.asarray(triangles, dtype=np.int32).reshape(-1, 3),
    )
