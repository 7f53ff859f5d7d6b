"""What a recording was made from and with, besides its scenario."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import hashlib
import json
import os
from pathlib import Path
import platform
import re
from xml.parsers import expat

from cns_drake.base.files import user_errors
from cns_drake.base.installed_versions import installed_versions
from cns_drake.base.jobs.fingerprint import code_digest, fingerprint
from cns_drake.base.version import __version__
from cns_drake.scenarios.imu_making import KALIBR_FILE, describe_kalibr
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder, world_file
from cns_drake.scenarios.shipped import suspension_file, vehicle_file
from cns_drake.scene.gazebo_models import ModelFinder

# Whatever can have a say in a message's bytes.
_PACKAGES = (
    "drake",
    "embreex",
    "llvmlite",
    "numba",
    "numpy",
    "scipy",
    "mcap",
    "rosbags",
    "zstandard",
)
_BLOCK_BYTES = 1 << 20
# Where a recording's metadata keep the combined digest of its inputs.
INPUTS_KEY = "inputs_sha256"

# What a folder that is included as a model consists of, besides meshes.
_MODEL_ENDINGS = (".sdf", ".urdf", ".config", ".xml")
# How mesh files name others, by ending: materials, textures, buffers.
_NAMING = {
    ".obj": re.compile(rb"^mtllib\s+(.+)$", re.MULTILINE),
    ".mtl": re.compile(rb"^\s*map_\w+.*?(\S+)\s*$", re.MULTILINE),
    ".gltf": re.compile(rb'"uri"\s*:\s*"([^":]+)"'),
}


def dependency_versions() -> dict[str, str]:
    """Returns package -> version, of cns-drake and what it computes with.

    What is not installed is left out: not all platforms have Embree's wheel.
    """
    return {
        "cns-drake": __version__,
        "python": platform.python_version(),
        **installed_versions(_PACKAGES),
    }


def digest_inputs(scenario: Scenario) -> dict[str, str]:
    """Returns SHA-256 digests of the files that a scenario reads.

    A world counts with the meshes and models that it names, and these with
    what they name.

    Returns:
        `world`, `vehicle`, and `structures`, `suspension`, `roads`,
        `waypoints` or `kalibr` where there are such -> hexadecimal digest. It
        depends on contents and on the relative names alone, not on where the
        files lie.

    Raises:
        InputError: a file cannot be read.
    """
    inputs = {"world": world_file(scenario), "vehicle": vehicle_file()}
    structures = map_folder(scenario).structures
    if structures.is_file():
        inputs["structures"] = structures
    if scenario.ride.profile() is not None:
        inputs["suspension"] = suspension_file()
    if scenario.waypoints is not None:
        inputs["waypoints"] = Path(scenario.waypoints)
    roads = map_folder(scenario).roads
    if (
        scenario.waypoints is None
        or not scenario.traffic.is_off
        or (not scenario.transient.is_off and roads.is_file())
    ):
        inputs["roads"] = roads
    digests = {name: digest_file(path) for name, path in inputs.items()}
    kalibr = describe_kalibr(scenario)
    if kalibr is not None:
        text = json.dumps(kalibr).encode()
        digests["kalibr"] = hashlib.sha256(text).hexdigest()
    return digests


def combined_digest(inputs: dict[str, str]) -> str:
    """Returns one digest for all that `digest_inputs` returns."""
    return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()


def recording_fingerprint(scenario: Scenario, inputs: dict[str, str]) -> str:
    """Returns the fingerprint of what a scenario records.

    Where its files lie does not matter, nor does how a page shows the drive.

    Args:
        scenario: what is recorded.
        inputs: its `digest_inputs`.
    """
    places: dict[str, object] = {
        field: Path(place).name
        for field in ("map", "world", "waypoints")
        if (place := getattr(scenario, field)) is not None
    }
    if scenario.imu.kalibr is not None:
        update = {"kalibr": KALIBR_FILE}
        places["imu"] = scenario.imu.model_copy(update=update)
    return fingerprint(
        {
            # As text, since the order of LiDARs matters.
            "scenario": scenario.model_copy(update=places).model_dump_json(),
            "inputs": inputs,
            "code": code_digest(
                "cns_drake.simulation.simulation",
                without=("cns_drake.pictures",),
            ),
        }
    )


def digest_file(path: Path) -> str:
    """Returns the SHA-256 digest of a model and of the files that it names.

    Raises:
        InputError: a file cannot be read.
    """
    digest = hashlib.sha256()
    for name, file in sorted(_referenced_files(path).items()):
        with user_errors(file):
            size = file.stat().st_size
        digest.update(f"{name} {size}\n".encode())
        _take(file, digest.update)
    # The file itself comes last, without its name.
    _take(path, digest.update)
    return digest.hexdigest()


def _take(path: Path, update: Callable[[bytes], None]) -> None:
    """Shows a file in blocks: textures and meshes may be of any size."""
    with user_errors(path), open(path, "rb") as stream:
        while block := stream.read(_BLOCK_BYTES):
            update(block)


def _referenced_files(model: Path) -> dict[str, Path]:
    """Returns the files that a model and the files that it names refer to.

    Returns:
        The path relative to the model's folder, or the URI of what is found
        elsewhere -> file.
    """
    finder = ModelFinder(model)
    found: dict[str, Path] = {}
    waiting = [str(model)]
    while waiting:
        file = waiting.pop()
        folder = os.path.dirname(file)
        for uri in _references(file):
            place = os.path.join(folder, uri)
            name = os.path.relpath(place, model.parent)
            if not os.path.exists(place):
                place, name = _find(finder, uri, folder), uri
            for one in _files_at(place):
                key = name
                if one != place:  # It lies in the folder of a model.
                    key = os.path.join(name, os.path.basename(one))
                if key not in found:
                    found[key] = Path(one)
                    waiting.append(one)
    return found


def _find(finder: ModelFinder, uri: str, folder: str) -> str:
    """Returns where a URI leads; "" if that is nowhere."""
    with contextlib.suppress(OSError, ValueError):  # It may be no name.
        return str(finder.find(uri, Path(folder)) or "")
    return ""


def _files_at(place: str) -> list[str]:
    """Returns a file, or those of a model's folder that say what it is."""
    if os.path.isdir(place):
        return [
            path
            for name in sorted(os.listdir(place))
            if name.endswith(_MODEL_ENDINGS)
            and os.path.isfile(path := os.path.join(place, name))
        ]
    # Only what is really a file: no device.
    return [place] if os.path.isfile(place) else []


def _references(file: str) -> list[str]:
    """Returns what a model or a mesh says of other files."""
    ending = os.path.splitext(file)[1].lower()
    if ending in (*_MODEL_ENDINGS, ".dae"):
        return _xml_references(_read(Path(file)))
    if ending not in _NAMING:
        return []
    names = _NAMING[ending].findall(_read(Path(file)))
    return [name.decode(errors="replace").strip() for name in names]


def _xml_references(content: bytes) -> list[str]:
    found: list[str] = []
    texts: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        texts.clear()
        if "filename" in attributes:  # Of URDF.
            found.append(attributes["filename"])

    def end(tag: str) -> None:
        if tag in ("uri", "init_from") or tag.endswith("_map"):
            found.append("".join(texts).strip())
        texts.clear()

    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler = start
    parser.CharacterDataHandler = texts.append
    parser.EndElementHandler = end
    # What is no XML is refused by whoever loads it.
    with contextlib.suppress(expat.ExpatError):
        parser.Parse(content, True)
    return found


def _read(path: Path) -> bytes:
    with user_errors(path):
        return path.read_bytes()
