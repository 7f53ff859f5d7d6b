"""The version of the release, which recordings and reports contain."""

from collections.abc import Iterable
import contextlib
import importlib.metadata

__version__ = "5.0.0"


def installed_versions(packages: Iterable[str]) -> dict[str, str]:
    """Returns package -> version for the given packages that are installed."""
    versions = {}
    for name in packages:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    return versions
