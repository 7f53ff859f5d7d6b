"""Finds the files to which a world refers, in Gazebo's folders."""

from collections.abc import Iterable, Mapping, Sequence
import os
from pathlib import Path
from urllib.parse import unquote

from evaluation.base import InputError, natural_key, read_elements

# Environment variables of old and new Gazebo and of libsdformat that list
# folders of models.
_VARIABLES = (
    "GZ_SIM_RESOURCE_PATH",
    "SDF_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GAZEBO_MODEL_PATH",
)
# A world of which more is missing is refused [share].
_MOST_MISSING = 0.5
_SCHEMES = ("model://", "package://", "file://")


# Variables with the folder of models that were downloaded from Fuel, and that
# folder's usual places.
_FUEL_VARIABLES = ("GZ_FUEL_CACHE_PATH", "IGN_FUEL_CACHE_PATH")
_FUEL_FOLDERS = ("~/.gz/fuel", "~/.ignition/fuel")
_FUEL_HOSTS = ("fuel.gazebosim.org", "fuel.ignitionrobotics.org")


class ModelFinder:
    """Finds the files to which URIs in a world refer."""

    def __init__(self, world: Path, model_paths: Iterable[Path] = ()):
        """Determines the folders to search.

        The folders are, in order of precedence: `model_paths`; the folders that
        the environment variables name; the world's folder and its subfolder
        `models`; the parent of the world's folder and the parent's subfolder
        `models`.
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
            uri: `model://<name>/...`, an absolute path, a relative path, or the
                address of a model on Fuel.
            folder: folder of the file that contains the URI, from which
                relative paths start.
        """
        return resolve(uri, folder, self._places)


def resolve(
    uri: str, folder: Path, search_path: Sequence[Path] = ()
) -> Path | None:
    """Returns the file or folder to which a reference leads; None if none.

    All references of worlds and meshes to other files are resolved here. A name
    is tried as it is written, and then with its percent escapes decoded.

    Args:
        uri: the reference: a path, `file://`, `model://`, `package://`, or the
            address of a model on Fuel, which must be in the local cache or in a
            folder of the search path.
        folder: folder of the file that contains the reference.
        search_path: folders that contain models.
    """
    if uri.startswith(("http://", "https://")):
        return _on_fuel(uri, search_path)
    rest = uri
    for scheme in _SCHEMES:
        rest = rest.removeprefix(scheme)
    if "://" in rest or not rest:
        return None
    places = [folder, *search_path] if rest == uri else list(search_path)
    if uri.startswith("file://"):
        places = [folder]
    for name in dict.fromkeys((rest, unquote(rest))):
        for place in places:
            path = place / name
            # Not Path.exists, which fails on names that are too long.
            if os.path.exists(path):
                return path.resolve()
            # The folder may contain the model's folder, or be that folder
            # itself.
            first, _, within = name.partition("/")
            if place.name == first and os.path.exists(place / within):
                return (place / within).resolve()
    return None


def _on_fuel(uri: str, search_path: Sequence[Path]) -> Path | None:
    """Returns a model on Fuel, or a file of it, if there is a local copy.

    Such an address is `https://HOST/1.0/OWNER/models/NAME`, with `/VERSION` and
    `/files/FILE` behind it if it names them.
    """
    before, _, after = unquote(uri).partition("/models/")
    name, *rest = [part for part in after.split("/") if part] or [""]
    version = rest.pop(0) if rest and (rest[0] + "0").isdigit() else ""
    if rest[:1] == ["tip"]:
        rest.pop(0)
    within = "/".join(rest[1:] if rest[:1] == ["files"] else rest)
    if not name:
        return None
    owner = before.rpartition("/")[2].lower()
    roots = [os.environ.get(one, "") for one in _FUEL_VARIABLES]
    for root in [*filter(None, roots), *_FUEL_FOLDERS]:
        for host in _FUEL_HOSTS:
            folder = Path(root).expanduser() / host / owner / "models"
            copies = folder / name.lower()
            if not copies.is_dir():
                continue
            numbers = [one.name for one in copies.iterdir()]
            there = [one for one in numbers if one.isdigit()]
            wanted = version or max(there, key=int, default="")
            if wanted in there and (copies / wanted / within).exists():
                return (copies / wanted / within).resolve()
    for local in (name, name.strip().lower().replace(" ", "_")):
        found = resolve(f"model://{local}/{within}", Path(), search_path)
        if found is not None:
            return found
    return None


def model_file(path: Path) -> Path | None:
    """Returns the SDF file of a model.

    `path` is this file, or the folder of the model. The result is None for a
    folder without a model.
    """
    if not path.is_dir():
        return path
    for name in ("model.config", "manifest.xml"):
        if (path / name).is_file():
            root = read_elements(path / name, encoding="utf-8")
            versions = sorted(
                root.iter("sdf"),
                key=lambda sdf: natural_key(sdf.get("version", "")),
            )
            for sdf in reversed(versions):
                file = path / (sdf.text or "").strip()
                if file.is_file():
                    return file
    found = sorted(path.glob("*.sdf"))
    if not found:
        return None
    preferred = path / "model.sdf"
    return preferred if preferred in found else found[0]


def note_of_missing(
    path: Path, what: str, uris: Mapping[str, int], whole: int
) -> tuple[str, ...]:
    """Returns a note on the models or meshes of a file that are missing.

    The advice holds for every program and for `load_world`.

    Args:
        path: the file.
        what: `models` or `meshes`.
        uris: URI that leads to no file -> number of those that have it.
        whole: number of models, or of visuals, of the world.

    Raises:
        InputError: more than half of the world is missing.
    """
    if not uris:
        return ()
    number = sum(uris.values())
    some = ", ".join(list(uris)[:3]) + (", ..." if len(uris) > 3 else "")
    of_what = "models" if what == "models" else "visuals"
    told = (
        f"{path}: {len(uris)} {what} not found, and left out: {some}"
        f" ({number} of {whole} {of_what})"
    )
    first = next(iter(uris))
    if not first.startswith(("file:", "/")):
        words = first.rpartition("://")[2].split("/")
        name = words[-1 if first.startswith("http") else 0]
        told += (
            f"; name the folder that has {name} in the variable"
            " GZ_SIM_RESOURCE_PATH"
        )
    if number > _MOST_MISSING * whole:
        raise InputError(told.replace(", and left out:", ":"))
    return (told,)
