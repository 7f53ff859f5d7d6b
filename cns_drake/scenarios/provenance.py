"""What a recording was made from and with, besides its scenario."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import json
import os
from pathlib import Path
import platform
import re

from cns_drake.base.files import user_errors
from cns_drake.base.version import __version__
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder, world_file
from cns_drake.scenarios.shipped import suspension_file, vehicle_file

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
# Where a recording's metadata keep the combined digest of its inputs.
INPUTS_KEY = "inputs_sha256"

_URI = re.compile(r"<uri>\s*([^<>\0]+?)\s*</uri>")


def dependency_versions() -> dict[str, str]:
    """Returns package -> version, of cns-drake and what it computes with.

    What is not installed is left out: not all platforms have Embree's wheel.
    """
    versions = {
        "cns-drake": __version__,
        "python": platform.python_version(),
    }
    for name in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    return versions


def digest_inputs(scenario: Scenario) -> dict[str, str]:
    """Returns SHA-256 digests of the files that a scenario reads.

    A world counts with the meshes and models that it names by relative
    paths; what it finds by a `package://` or `model://` URI does not count.

    Returns:
        `world`, `vehicle`, and `structures`, `suspension`, `roads` or
        `waypoints` where there are such -> hexadecimal digest. It depends on
        contents and on the relative names alone, not on where the files lie.

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
    else:
        inputs["roads"] = map_folder(scenario).roads
    return {name: digest_file(path) for name, path in inputs.items()}


def combined_digest(inputs: dict[str, str]) -> str:
    """Returns one digest for all that `digest_inputs` returns."""
    return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()


def digest_file(path: Path) -> str:
    """Returns the SHA-256 digest of a file and of the files it names.

    Raises:
        InputError: a file cannot be read.
    """
    digest = hashlib.sha256()
    for name in sorted(_referenced_files(path)):
        content = _read(path.parent / name)
        digest.update(f"{name} {len(content)}\n".encode())
        digest.update(content)
    # The file itself comes last, without its name.
    digest.update(_read(path))
    return digest.hexdigest()


def _referenced_files(model: Path) -> set[str]:
    """Returns the files that an SDF file and the models in it name.

    Returns:
        Paths relative to the model's folder.
    """
    found: set[str] = set()
    waiting = [model]
    while waiting:
        file = waiting.pop()
        for uri in _URI.findall(_read(file).decode(errors="replace")):
            place = file.parent / uri
            name = os.path.relpath(place, model.parent)
            # Only what is really a file: no folder, no device.
            if name not in found and os.path.isfile(place):
                found.add(name)
                if place.suffix == ".sdf":
                    waiting.append(place)
    return found


def _read(path: Path) -> bytes:
    with user_errors(path):
        return path.read_bytes()
