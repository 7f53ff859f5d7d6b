"""Reads OBJ files, each content once for all processes of a user.

What was read from the meshes of a folder is in one file of the user's cache,
which is mapped into memory. A mesh is known by a digest of its content, so that
the file holds for every stage of a city, and a changed mesh is read again.
Whatever is wrong with the cache, the meshes are read without it.
"""

from __future__ import annotations

import codecs
from collections.abc import Mapping
import contextlib
import hashlib
from importlib.metadata import version
import json
import mmap
import os
from pathlib import Path
import struct
import sys
from typing import NamedTuple
import zlib

import numpy as np
from pydrake.geometry import ReadObjToTriangleSurfaceMesh

from cns_drake.scene.obj_check import (
    ObjFaces,
    check_obj,
    unmarked,
)
from evaluation.base import (
    completing,
    mark_used,
    own_cache,
    read_bytes,
    remove_unused,
)

# Counts the changes of the form of a file of the cache, and of what is read
# from equal contents.
_FORM = 1
# Fewer new meshes are read sooner than a file is written.
_FEWEST = 32
# A file of the cache that would be larger starts anew [bytes].
_LARGEST = 1 << 30
# How the names of the cache's files end.
_SUFFIX = ".meshes"
# At the end of a file: length and CRC-32 of the index before it.
_TRAILER = struct.Struct("<QI")
# Vertices (N, 3), float64 [m], and triangles (M, 3), int32.
Surface = tuple[np.ndarray, np.ndarray]


class _Mesh(NamedTuple):
    """What is known of a content.

    Attributes:
        faces: its faces.
        surface: its surface; None while nobody has asked for it.
        checksum: CRC-32 that the surface must have; None if that is known.
    """

    faces: ObjFaces
    surface: Surface | None = None
    checksum: int | None = None

    def checked(self) -> _Mesh:
        """Returns the mesh without its surface if that is damaged."""
        if self.checksum is None or self.surface is None:
            return self
        is_whole = _checksum(self.surface) == self.checksum
        return _Mesh(self.faces, self.surface if is_whole else None)


class ObjFiles:
    """Reads OBJ files; a context manager, which keeps what it has read."""

    def __init__(self) -> None:
        self._folders: dict[str, _Folder] = {}

    def __enter__(self) -> ObjFiles:
        return self

    def __exit__(self, *_: object) -> None:
        for folder in self._folders.values():
            folder.keep()

    def faces(self, path: Path | str) -> ObjFaces:
        """Checks a file; see `check_obj`.

        Raises:
            ValueError: `check_obj` refuses the file.
            InputError: the file cannot be read.
        """
        folder, name = self._split(path)
        return folder.mesh(name).faces

    def surface(self, path: Path | str) -> Surface:
        """Returns the surface of a file, in read-only arrays.

        Returns:
            Vertices (N, 3), float64 [m], and triangles (M, 3), int32.

        Raises:
            RuntimeError, ValueError: the file is not a valid OBJ file.
            InputError: the file cannot be read.
        """
        folder, name = self._split(path)
        return folder.surface(name)

    def _split(self, path: Path | str) -> tuple[_Folder, str]:
        # Path takes longer, and a city has thousands of meshes.
        place, name = os.path.split(path)
        folder = self._folders.get(place)
        if folder is None:
            folder = self._folders[place] = _Folder(Path(place))
        return folder, name


class _Folder:
    """The OBJ files of a folder."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._place = _place(folder)
        # Digest of a content -> what is known of it.
        self._meshes = {} if self._place is None else _cached(self._place)
        # Name of a file -> digest of its content.
        self._digests: dict[str, str] = {}
        self._num_new = 0

    def mesh(self, name: str) -> _Mesh:
        """Returns what is known of a file; see `ObjFiles.faces`."""
        digest = self._digests.get(name)
        if digest is None:
            content = read_bytes(self._folder / name)
            digest = _digest(content)
            if digest not in self._meshes:
                content = content.removeprefix(codecs.BOM_UTF8)
                self._meshes[digest] = _Mesh(check_obj(content))
                self._num_new += 1
            self._digests[name] = digest
        return self._meshes[digest]

    def surface(self, name: str) -> Surface:
        """Returns the surface of a file; see `ObjFiles.surface`."""
        mesh = self.mesh(name).checked()
        digest = self._digests[name]
        if mesh.surface is None:
            path = self._folder / name
            mesh = _Mesh(mesh.faces, _read(path))
            if _digest(read_bytes(path)) != digest:
                raise ValueError("changed while it was being read")
            self._num_new += 1
        self._meshes[digest] = mesh
        assert mesh.surface is not None
        return mesh.surface

    def keep(self) -> None:
        """Writes what is known into the cache, if that is worth its time."""
        if self._place is None or self._num_new < _FEWEST:
            return
        # A cache that cannot be written only costs time.
        with contextlib.suppress(Exception):
            meshes = {
                digest: mesh.checked() for digest, mesh in self._meshes.items()
            }
            sizes = (
                sum(a.nbytes for a in m.surface or ()) for m in meshes.values()
            )
            if sum(sizes) > _LARGEST:
                meshes = {one: meshes[one] for one in self._digests.values()}
            remove_unused(self._place.parent, f"*{_SUFFIX}")
            with completing(self._place) as part:
                _write(part, meshes)


def _read(path: Path) -> Surface:
    """Returns the surface of an OBJ file, as Drake reads it."""
    with unmarked(path) as file:
        mesh = ReadObjToTriangleSurfaceMesh(file)
    triangles = np.array(
        [(t.vertex(0), t.vertex(1), t.vertex(2)) for t in mesh.triangles()],
        dtype=np.int32,
    ).reshape(-1, 3)
    p_GVset = np.asarray(mesh.vertices(), dtype=float).reshape(-1, 3)
    for array in (p_GVset, triangles):
        array.setflags(write=False)
    return p_GVset, triangles


def _place(folder: Path) -> Path | None:
    """Returns the file of the cache for a folder; None without a cache."""
    cache = own_cache("meshes")
    if cache is None:
        return None
    # Numbers are stored as the processor has them.
    key = json.dumps(
        [_FORM, version("drake"), sys.byteorder, str(folder.resolve())]
    )
    digest = hashlib.sha256(key.encode(errors="surrogatepass")).hexdigest()
    return cache / f"{digest[:32]}{_SUFFIX}"


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _checksum(surface: Surface) -> int:
    p_GVset, triangles = surface
    return zlib.crc32(triangles.data, zlib.crc32(p_GVset.data))


def _write(path: Path, meshes: Mapping[str, _Mesh]) -> None:
    """Writes a file of the cache: the surfaces, an index, and the trailer."""
    index = []
    with path.open("wb") as stream:
        for digest, (faces, surface, _) in meshes.items():
            box = None if faces.box is None else faces.box.tolist()
            place = None
            if surface is not None:
                # Doubles begin at multiples of their size.
                stream.write(bytes(-stream.tell() % 8))
                place = (stream.tell(), *map(len, surface), _checksum(surface))
                stream.writelines(array.data for array in surface)
            index.append((digest, faces.notes, faces.num_triangles, box, place))
        text = json.dumps(index).encode()
        stream.write(text)
        stream.write(_TRAILER.pack(len(text), zlib.crc32(text)))


def _cached(path: Path) -> dict[str, _Mesh]:
    """Returns what the cache has of a folder; nothing if it is damaged."""
    # A cache that cannot be read only costs time.
    with contextlib.suppress(Exception):
        with path.open("rb") as stream:
            content = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        end = len(content) - _TRAILER.size
        length, checksum = _TRAILER.unpack(content[end:])
        text = content[end - length : end]
        if zlib.crc32(text) == checksum:
            mark_used(path)
            return {
                digest: _mesh(content, *rest)
                for digest, *rest in json.loads(text)
            }
    return {}


def _mesh(
    content: mmap.mmap,
    notes: list[str],
    num_triangles: int,
    box: list | None,
    place: tuple[int, int, int, int] | None,
) -> _Mesh:
    """Returns what the index says of a mesh, its surface still unchecked."""
    corners = None
    if box is not None:
        corners = np.array(box, float)
        corners.setflags(write=False)
    faces = ObjFaces(tuple(notes), num_triangles, corners)
    if place is None:
        return _Mesh(faces)
    begin, num_vertices, num_read, checksum = place
    p_GVset = np.frombuffer(content, float, 3 * num_vertices, begin)
    triangles = np.frombuffer(
        content, np.int32, 3 * num_read, begin + p_GVset.nbytes
    )
    surface = p_GVset.reshape(-1, 3), triangles.reshape(-1, 3)
    return _Mesh(faces, surface, checksum)
