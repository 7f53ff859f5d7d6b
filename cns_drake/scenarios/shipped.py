"""Where the shipped worlds are."""

from __future__ import annotations

from pathlib import Path


def worlds_folder() -> Path:
    """Returns the folder of shipped maps.

    In a wheel it lies inside the package, in a checkout beside it.
    """
    package = Path(__file__).resolve().parents[1]
    inside = package / "worlds"
    return inside if inside.is_dir() else package.parent / "worlds"


def vehicle_file() -> Path:
    """Returns the SDF file of the vehicle."""
    return worlds_folder() / "vehicle.sdf"


def shipped_maps() -> dict[str, Path]:
    """Returns the folder of each shipped map, by name."""
    return {
        path.parent.name: path.parent
        for path in sorted(worlds_folder().glob("*/roads.yaml"))
    }


def shipped_sequences() -> dict[str, Path]:
    """Returns the file of each shipped sequence, by name (`<map>_<NN>`)."""
    return {
        sequence_name(path): path
        for folder in shipped_maps().values()
        for path in sorted(folder.glob("sequence_*.yaml"))
    }


def recordable_sequences() -> dict[str, Path]:
    """Returns the shipped sequences whose stage is shipped as well, by name.

    A map's roads and drives may be there before its city is.
    """
    return {
        sequence_name(path): path
        for folder in shipped_maps().values()
        for path in sequences_of_map(folder)
    }


def sequences_of_map(folder: Path) -> list[Path]:
    """Returns the sequences in a map's folder whose stage is there as well."""
    return [
        path
        for path in sorted(folder.glob("sequence_*.yaml"))
        if path.with_name(path.name.replace("sequence_", "stage_"))
        .with_suffix(".sdf")
        .is_file()
    ]


def sequence_name(path: Path) -> str:
    """Returns the name of the sequence that a scenario file describes.

    `<map>/sequence_04.yaml` is `<map>_04`; any other file has the name of
    its stem.
    """
    if path.stem.startswith("sequence_"):
        number = path.stem.removeprefix("sequence_")
        return f"{path.resolve().parent.name}_{number}"
    return path.stem
