"""Finds the files to which an SDF world refers, in Gazebo's folders."""

from collections.abc import Iterable
import os
from pathlib import Path

from cns_drake.base import InputError, read_elements

# Environment variables of old and new Gazebo and of libsdformat that list
# folders of models.
_VARIABLES = (
    "GZ_SIM_RESOURCE_PATH",
    "SDF_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GAZEBO_MODEL_PATH",
)
_SCHEMES = ("model://", "package://", "file://")


class ModelFinder:
    """Finds the files to which URIs in a world refer."""

    def __init__(self, world: Path, model_paths: Iterable[Path] = ()):
        """Determines the folders to search.

        The folders are, in order of precedence: `model_paths`; the folders that
        the environment variables name; the world's folder and its subfolder
        `models`; the parent of the world's folder and the parent's subfolder
        `models`.

        Args:
            world: SDF file of the world.
            model_paths: folders to search first.
        """
        folder = world.absolute().parent
        named = [
            Path(place)
            for variable in _VARIABLES
            for place in os.environ.get(variable, "").split(os.pathsep)
            if place
        ]
        near = [folder, folder / "models"]
        near += [folder.parent, folder.parent / "models"]
        self._places = [*map(Path, model_paths), *named, *near]

    def find(self, uri: str, folder: Path) -> Path | None:
        """Returns the file or folder of a URI, or None if there is none.

        Args:
            uri: `model://<name>/...`, an absolute path, or a relative path.
            folder: folder of the file that contains the URI, from which
                relative paths start.
        """
        rest = uri
        for scheme in _SCHEMES:
            rest = rest.removeprefix(scheme)
        if "://" in rest:
            return None
        places = self._places
        if rest == uri:
            places = [folder, *places]
        for place in places:
            path = place / rest
            if path.exists():
                return path.resolve()
            # The folder may contain the model's folder, or be that folder
            # itself.
            name, _, within = rest.partition("/")
            if place.name == name and (place / within).exists():
                return (place / within).resolve()
        return None


def model_file(path: Path) -> Path:
    """Returns the SDF file of a model.

    `path` is this file, or the folder of the model.

    Raises:
        InputError: the folder has no SDF file.
    """
    if not path.is_dir():
        return path
    for name in ("model.config", "manifest.xml"):
        if (path / name).is_file():
            root = read_elements(path / name, encoding="utf-8")
            versions = sorted(
                root.iter("sdf"), key=lambda sdf: sdf.get("version", "")
            )
            for sdf in reversed(versions):
                file = path / (sdf.text or "").strip()
                if file.is_file():
                    return file
    found = sorted(path.glob("*.sdf"))
    if not found:
        raise InputError(f"{path}: holds no SDF model")
    preferred = path / "model.sdf"
    return preferred if preferred in found else found[0]
