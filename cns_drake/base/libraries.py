"""Shared libraries of the system that the wheels of others need."""

from __future__ import annotations

import re

_MISSING = re.compile(
    r"(lib[\w.+-]+?)\.so[\w.]*: cannot open shared object file"
)
# Library -> Debian's package. Drake needs the first, Open3D the others.
_PACKAGES = {
    "libglib-2.0": "libglib2.0-0",
    "libgobject-2.0": "libglib2.0-0",
    "libgthread-2.0": "libglib2.0-0",
    "libGL": "libgl1",
    "libX11": "libx11-6",
    "libudev": "libudev1",
    "libgomp": "libgomp1",
    "libusb-1.0": "libusb-1.0-0",
}


def missing_library(error: ImportError) -> str | None:
    """Returns a line about the shared library that an import lacked.

    None if it failed for another reason.
    """
    match = _MISSING.search(str(error))
    if match is None:
        return None
    package = _PACKAGES.get(match[1])
    how = f" (Debian: apt install {package})" if package else ""
    return f"this system lacks the shared library {match[1]}.so{how}"
