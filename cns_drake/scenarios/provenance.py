"""All inputs of a recording except its scenario: files and versions."""

from collections.abc import Sequence
import hashlib
import json
from pathlib import Path
import platform

from cns_drake.motion import suspension_file, vehicle_file
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scene import FileWatch, referenced_files
from cns_drake.sensors import KALIBR_FILE
from evaluation.base import __version__ as __version__
from evaluation.base import (
    check_regular,
    fingerprint,
    installed_versions,
    is_there,
    user_errors,
)

# Packages that can influence a message's bytes.
_PACKAGES = (
    "drake", "embreex", "llvmlite", "numba", "numpy", "scipy", "mcap",
    "rosbags", "zstandard",
)  # fmt: skip
_BLOCK_BYTES = 1 << 20
# Counts the changes of what is simulated or recorded of the same scenario and
# files. Raise it with each such change.
SIMULATION_VERSION = 2
# The key of the inputs' combined digest in a recording's metadata.
INPUTS_KEY = "inputs_sha256"


def dependency_versions() -> dict[str, str]:
    """Returns versions of cns-drake and its numerical libraries, by package.

    Missing packages are left out: not all platforms have Embree's wheel.
    """
    return {
        "cns-drake": __version__,
        "python": platform.python_version(),
        **installed_versions(_PACKAGES),
    }


def digest_inputs(
    scenario: Scenario, watch: FileWatch | None = None
) -> dict[str, str]:
    """Returns SHA-256 digests of the files that a scenario reads.

    The digest of a world covers the meshes and models that the world names, and
    the files that these meshes and models name.

    Args:
        scenario: the scenario.
        watch: records size and time of each file before the file is read, so
            that a later change can be noticed; None records nothing.

    Returns:
        Kind of file -> hexadecimal digest. The kinds are `world` and `vehicle`
        and, if used, `structures`, `suspension`, `roads`, `traffic`,
        `waypoints`, `fcd`, `towards` and `kalibr`. The digests depend only on
        contents and relative names, not on the folder of the files.

    Raises:
        InputError: a file cannot be read.
    """
    inputs = _input_files(scenario)
    digests = {
        name: digest_file(
            file, watch, scenario.model_paths if name == "world" else ()
        )
        for name, file in inputs.items()
    }
    if watch and scenario.imu.kalibr is not None:
        watch.record(str(scenario.imu.kalibr))
    kalibr = scenario.imu.describe_kalibr(scenario.fastest_rate)
    if kalibr is not None:
        text = json.dumps(kalibr).encode()
        digests["kalibr"] = hashlib.sha256(text).hexdigest()
    return digests


def _input_files(scenario: Scenario) -> dict[str, Path]:
    """Returns the input files by kind, except the file of the IMU's noise."""
    inputs = {"world": scenario.world_file, "vehicle": vehicle_file()}
    if scenario.city.towards is not None:
        inputs["towards"] = scenario.folder.stage(scenario.city.towards)
    structures = scenario.structures
    if is_there(structures):
        inputs["structures"] = structures
    if scenario.ride.profile() is not None:
        inputs["suspension"] = suspension_file()
    if scenario.waypoints is not None:
        inputs["waypoints"] = Path(scenario.waypoints)
    traffic = scenario.traffic
    with_roads = traffic.queues or not scenario.transient.is_off
    if scenario.waypoints is None or (
        with_roads
        and scenario.map is not None
        and scenario.folder.roads.is_file()
    ):
        inputs["roads"] = scenario.folder.roads
    if traffic.is_recorded:
        inputs["traffic"] = scenario.folder.traffic
    if traffic.fcd is not None:
        inputs["fcd"] = Path(traffic.fcd)
    return inputs


def combined_digest(inputs: dict[str, str]) -> str:
    """Returns one digest of all digests that `digest_inputs` returns."""
    return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()


def recording_fingerprint(scenario: Scenario, inputs: dict[str, str]) -> str:
    """Returns a hash of everything that determines a scenario's recording.

    The hash does not depend on the folders of the files.

    Args:
        scenario: the scenario.
        inputs: digests of the scenario's files, see `digest_inputs`.
    """
    places: dict[str, object] = {
        field: Path(place).name
        for field in ("map", "world", "waypoints")
        if (place := getattr(scenario, field)) is not None
    }
    if scenario.model_paths:
        names = tuple(Path(place).name for place in scenario.model_paths)
        places["model_paths"] = names
    if scenario.imu.kalibr is not None:
        places["imu"] = scenario.imu.replaced(kalibr=KALIBR_FILE)
    if scenario.traffic.fcd is not None:
        name = Path(scenario.traffic.fcd).name
        places["traffic"] = scenario.traffic.replaced(fcd=name)
    return fingerprint(
        {
            # LiDARs become one text, because their order matters.
            "scenario": scenario.replaced(**places).model_dump_json(),
            "inputs": inputs,
            "version": [__version__, SIMULATION_VERSION],
        }
    )


def digest_file(
    path: Path,
    watch: FileWatch | None = None,
    model_paths: Sequence[str] = (),
) -> str:
    """Returns the SHA-256 digest of a file, or of a model and its files.

    A model in SDF or URDF names other files, such as meshes.

    Args:
        path: the file.
        watch: object that records size and time of each file before the file is
            read, so that a later change can be noticed; by default nothing is
            recorded.
        model_paths: folders in which the models of a world are searched first.

    Raises:
        InputError: a file cannot be read.
    """
    check_regular(path)
    digest = hashlib.sha256()
    found = referenced_files(path, watch or FileWatch(), model_paths)
    named = [(f"{n} {size}\n", one) for n, (one, size) in sorted(found.items())]
    # The file itself comes last, without its name. Meshes may have any size.
    files: list[tuple[str, Path | str]] = [*named, ("", path)]
    for line, file in files:
        digest.update(line.encode())
        with user_errors(file), open(file, "rb") as stream:
            while block := stream.read(_BLOCK_BYTES):
                digest.update(block)
    return digest.hexdigest()
