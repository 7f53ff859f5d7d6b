"""What the system lacks: shared libraries, or a locale with UTF-8."""

import locale
import re
import sys

# Message of a failed import.
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


def has_utf8() -> bool:
    """Returns whether Python runs in a UTF-8 locale or in its UTF-8 mode."""
    return sys.getfilesystemencoding() == "utf-8"


def missing_library(error: ImportError) -> str | None:
    """Returns what the system lacks for a failed import, as one line.

    The system can lack a shared library, or a locale with UTF-8. The result is
    None if the import failed for another reason.
    """
    if "initialization failed" in str(error) and not has_utf8():
        name = locale.setlocale(locale.LC_CTYPE)
        return (
            f"the locale {name} lacks UTF-8, which Drake needs (LC_ALL=C.UTF-8)"
        )
    match = _MISSING.search(str(error))
    if match is None:
        return None
    package = _PACKAGES.get(match[1])
    how = f" (Debian: apt install {package})" if package else ""
    return f"this system lacks the shared library {match[1]}.so{how}"
