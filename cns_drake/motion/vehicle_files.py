"""The files of the car that drives and carries the sensors."""

from pathlib import Path

_FOLDER = Path(__file__).parent / "vehicle"


def vehicle_file() -> Path:
    """Returns the SDF file of the vehicle."""
    return _FOLDER / "vehicle.sdf"


def suspension_file() -> Path:
    """Returns the YAML file of the vehicle's springs."""
    return _FOLDER / "suspension.yaml"
