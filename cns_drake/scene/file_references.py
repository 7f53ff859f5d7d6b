"""Finds the files to which a model refers."""

from collections.abc import Iterable
import contextlib
import os
from pathlib import Path
import re
import stat
from xml.parsers import expat

from cns_drake.scene.file_watch import FileWatch
from cns_drake.scene.model_finder import ModelFinder
from evaluation.base import readable_xml, user_errors

# File name endings of the files of a model's folder, besides meshes.
_MODEL_ENDINGS = (".sdf", ".urdf", ".config", ".xml")
# Ending of a mesh file -> pattern of its references to materials or buffers.
_NAMING = {
    ".obj": re.compile(rb"^mtllib\s+(.+)$", re.MULTILINE),
    ".gltf": re.compile(rb'"uri"\s*:\s*"([^":]+)"'),
}


def referenced_files(
    model: Path, watch: FileWatch, model_paths: Iterable[str] = ()
) -> dict[str, tuple[str, int]]:
    """Returns the files to which a model refers, directly or indirectly.

    Args:
        model: SDF or URDF file of the model.
        watch: records the status of the model and of all files found.
        model_paths: folders in which models are searched first.

    Returns:
        Name -> path of the file and its size [bytes]. The name is the path
        relative to the model's folder or, for a file elsewhere, its URI.

    Raises:
        InputError: a file cannot be read.
    """
    finder = ModelFinder(model, map(Path, model_paths))
    found: dict[str, tuple[str, int]] = {}
    waiting = [str(model)]
    watch.record(str(model))
    while waiting:
        file = waiting.pop()
        folder = os.path.dirname(file)
        for uri in _references(file):
            place = os.path.join(folder, uri)
            name = os.path.relpath(place, model.parent)
            # A file that is missing now must be noticed when it appears.
            status = watch.record(place)
            if status is None:
                place = _found_file(finder, uri, folder)
                name = uri
                status = watch.record(place)
            for one, size in _files_at(place, status, watch):
                key = name
                if one != place:  # It is inside a model's folder.
                    key = os.path.join(name, os.path.basename(one))
                if key not in found:
                    found[key] = one, size
                    waiting.append(one)
    return found


def _found_file(finder: ModelFinder, uri: str, folder: str) -> str:
    """Returns the file of a URI; "" if it does not exist."""
    with contextlib.suppress(OSError, ValueError):  # It may not be a file name.
        return str(finder.find(uri, Path(folder)) or "")
    return ""


def _files_at(
    place: str, status: os.stat_result | None, watch: FileWatch
) -> list[tuple[str, int]]:
    """Returns a file, or the files that define a folder's model, with sizes."""
    if status is not None and stat.S_ISDIR(status.st_mode):
        inside = [
            os.path.join(place, name)
            for name in sorted(os.listdir(place))
            if name.endswith(_MODEL_ENDINGS)
        ]
    else:
        inside = [place]
    found = []
    for path in inside:
        inner = status if path == place else watch.record(path)
        # Only regular files count, not devices.
        if inner is not None and stat.S_ISREG(inner.st_mode):
            found.append((path, inner.st_size))
    return found


def _references(file: str) -> list[str]:
    """Returns the references in a model or a mesh to other files."""
    ending = os.path.splitext(file)[1].lower()
    if ending in (*_MODEL_ENDINGS, ".dae"):
        return _xml_references(_contents(file))
    if ending == ".mtl":
        names = _textures(_contents(file))
    elif ending in _NAMING:
        names = _NAMING[ending].findall(_contents(file))
    else:
        return []
    return [name.decode(errors="replace").strip() for name in names]


def _textures(content: bytes) -> list[bytes]:
    """Returns the textures that a file of materials (.mtl) names."""
    lines = [line.split() for line in content.splitlines()]
    # The name follows the options.
    return [
        words[-1]
        for words in lines
        if len(words) > 1 and words[0].startswith(b"map_")
    ]


def _xml_references(content: bytes) -> list[str]:
    found: list[str] = []
    texts: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        texts.clear()
        if "filename" in attributes:  # A mesh in URDF.
            found.append(attributes["filename"])

    def end(tag: str) -> None:
        if tag in ("uri", "init_from") or tag.endswith("_map"):
            found.append("".join(texts).strip())
        texts.clear()

    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler = start
    parser.CharacterDataHandler = texts.append
    parser.EndElementHandler = end
    # The loader will reject a file that is not XML.
    with contextlib.suppress(expat.ExpatError):
        parser.Parse(readable_xml(content), True)
    return found


def _contents(path: str) -> bytes:
    with user_errors(path), open(path, "rb") as stream:
        return stream.read()
