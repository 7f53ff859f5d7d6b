"""Reads meshes in formats that Drake cannot read, using Open3D.

Some of Open3D's parsers crash on damaged files and print messages, and some
believe every count that a file declares. The parsers therefore run in a
separate process, which is started only for worlds with such meshes, and whose
memory and time are limited by the size of the file.
"""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
import pickle
import re
import subprocess
import sys
import tempfile
from types import ModuleType
from typing import IO

import numpy as np

from evaluation.base import limit_process, missing_library, start_python

# Open3D returns what it has read before a fault, and warns.
_FAULT = re.compile(
    r"WARNING\] (?:Read \w+ failed|Unable to load file .* with ASSIMP): (.*)"
)
# Codes with which a terminal sets the colour of text.
_COLOUR = re.compile(r"\x1b\[[\d;]*m")


class ForeignMeshes:
    """Reads mesh files with Open3D in another process; a context manager."""

    def __init__(self) -> None:
        self._process: subprocess.Popen | None = None

    def __enter__(self) -> ForeignMeshes:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def read(self, path: Path) -> tuple[np.ndarray, np.ndarray]:
        """Returns the vertices and triangles of a mesh file.

        Returns:
            Vertices (N, 3), float64 [m], and triangles (M, 3), int32. There are
            no triangles if the file is not a mesh.

        Raises:
            ValueError: if Open3D crashes on the file, reads only a part of the
                file, or cannot be loaded.
        """
        if self._process is None:
            self._process = start_python(__name__)
        # Both are pipes, so they are not None.
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            pickle.dump(str(path.absolute()), self._process.stdin)
            self._process.stdin.flush()
            answer = pickle.load(self._process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            self._end()
            raise ValueError("Open3D cannot read it") from error
        if isinstance(answer, str):
            raise ValueError(answer)
        return answer

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def _serve() -> None:
    """Reads the requested meshes: the main function of the process."""
    # Messages of a parser must not mix with the answers.
    answers = os.fdopen(os.dup(1), "wb")
    messages = tempfile.TemporaryFile()  # noqa: SIM115  # For the whole process.
    os.dup2(messages.fileno(), 1)
    os.dup2(messages.fileno(), 2)
    # Left out: Open3D's machine learning, which no mesh needs. Its import takes
    # longer than all the rest.
    sys.modules["open3d.ml"] = ModuleType("open3d.ml")
    try:
        import open3d
    except ImportError as error:
        pickle.dump(missing_library(error) or str(error), answers)
        return
    while True:
        try:
            path = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        messages.seek(0)
        messages.truncate()
        limit_process(Path(path))
        surface = _read_surface(open3d, path)
        fault = _printed_fault(messages, path)
        pickle.dump(fault or surface, answers)
        answers.flush()


def _read_surface(
    open3d: ModuleType, path: str
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices and triangles of a mesh file."""
    if path.lower().endswith(".dae"):
        # Only Open3D's reader of models supports the format.
        mesh = open3d.geometry.TriangleMesh()
        for part in open3d.io.read_triangle_model(path).meshes:
            mesh += part.mesh
    else:
        mesh = open3d.io.read_triangle_mesh(path)
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles, np.int32)


def _printed_fault(messages: IO[bytes], path: str) -> str:
    """Returns the fault that a parser has printed, or "" without one."""
    sys.stdout.flush()  # Open3D prints through Python, its parsers through C.
    ctypes.CDLL(None).fflush(None)
    messages.seek(0)
    text = _COLOUR.sub("", messages.read().decode("utf-8", "replace"))
    found = _FAULT.search(text)
    if found is None:
        return ""
    fault = found[1].replace(path, Path(path).name)
    return f"Open3D cannot read it: {fault}"


if __name__ == "__main__":
    _serve()
