"""The folder for files that can be made again at any time."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path:
    """Returns cns-drake's folder in the cache of the user.

    Source: the XDG base directory specification. The folder may not exist.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    folder = Path(base) if os.path.isabs(base) else Path("~/.cache")
    return Path(os.path.expanduser(folder)) / "cns-drake"
