"""Finds the models and files that Gazebo's worlds refer to."""

from __future__ import annotations

from collections.abc import Iterable
import os
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.scene.model_check import check_model

# Environment variables with folders of models, of old and new Gazebo and
# libsdformat.
_VARIABLES = (
    "GZ_SIM_RESOURCE_PATH",
    "SDF_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GAZEBO_MODEL_PATH",
)
_SCHEMES = ("model://", "package://", "file://")


class ModelFinder:
    """Finds files by the URIs of a world."""

    def __init__(self, world: Path, model_paths: Iterable[Path] = ()):
        """Takes the folders to search; the first one wins.

        Args:
            world: its folder, the one above, and `models` in both are searched
                last.
            model_paths: searched first; then come those of the environment.
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
        """Returns the file or folder of a URI, None if it is not there.

        Args:
            uri: absolute, `model://<name>/...`, or relative.
            folder: base of a relative URI.
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
            # A model may be in its own folder, or be that folder.
            name, _, within = rest.partition("/")
            if place.name == name and (place / within).exists():
                return (place / within).resolve()
        return None


def model_file(path: Path) -> Path:
    """Returns a model's SDF file: the path, or the file named by its folder.

    Raises:
        InputError: the folder has none.
    """
    if not path.is_dir():
        return path
    for name in ("model.config", "manifest.xml"):
        if (path / name).is_file():
            root = read_xml(path / name)
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


def read_xml(path: Path) -> ElementTree.Element:
    """Reads a file.

    Raises:
        InputError: it cannot be read, or is not the XML of a model.
    """
    check_model(path)
    builder = ElementTree.TreeBuilder()
    # ElementTree's own parser would require declared prefixes.
    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(read_bytes(path), True)
    except expat.ExpatError as error:
        raise InputError(f"{path}: cannot be parsed: {error}") from error
    return builder.close()
