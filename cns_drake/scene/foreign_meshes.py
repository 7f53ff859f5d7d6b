"""Reads meshes in formats that Drake cannot read, using Open3D.

Some of Open3D's parsers crash on damaged files and print messages. They
therefore run in a separate process, which is started only for worlds with such
meshes.
"""

from __future__ import annotations

import os
from pathlib import Path
import pickle
import subprocess
import sys
from types import ModuleType

import numpy as np

from cns_drake.base.errors import missing_library


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
            ValueError: if Open3D crashes on the file, or cannot be loaded.
        """
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        # Both are pipes, so they are not None.
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            pickle.dump(str(path), self._process.stdin)
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
    """Reads requested meshes until there are no more requests."""
    # Messages of a parser must not mix with the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
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
        if path.lower().endswith(".dae"):
            # Only Open3D's reader of models supports the format.
            parts = open3d.io.read_triangle_model(path).meshes
            mesh = open3d.geometry.TriangleMesh()
            for part in parts:
                mesh += part.mesh
        else:
            mesh = open3d.io.read_triangle_mesh(path)
        triangles = np.asarray(mesh.triangles, np.int32)
        pickle.dump((np.asarray(mesh.vertices), triangles), answers)
        answers.flush()


if __name__ == "__main__":
    _serve()
