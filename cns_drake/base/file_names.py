"""Safe names of files, and the folder of the user's cache."""

import hashlib
import os
from pathlib import Path

# Some file systems allow 255; this leaves room for endings and joined names.
_LONGEST_NAME_BYTES = 120
# Number of characters at the beginning of a longer name that are kept.
_KEPT_CHARACTERS = 20


def cache_folder() -> Path:
    """Returns cns-drake's folder in the cache of the user.

    Source: the XDG base directory specification. The folder may not exist.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    folder = Path(base) if os.path.isabs(base) else Path("~/.cache")
    return Path(os.path.expanduser(folder)) / "cns-drake"


def file_name(text: str) -> str:
    """Turns a text into a file name that cannot lead to another folder.

    Use this function for the names of the drive, map and stage in a recording
    before these names become parts of paths. Usual names stay unchanged. In
    unusual names, unsafe characters are replaced such that different names stay
    different.
    """
    name = "".join(
        c if c.isalnum() or c in "_-+ " or (c == "." and k) else _escaped(c)
        for k, c in enumerate(text)
    )
    if not name or len(name.encode()) > _LONGEST_NAME_BYTES:
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass"))
        # An escaped character never has a tilde behind its percent sign.
        name = f"{name[:_KEPT_CHARACTERS]}%~{digest.hexdigest()[:32]}"
    return name


def _escaped(character: str) -> str:
    octets = character.encode("utf-8", "surrogatepass")
    return "".join(f"%{octet:02X}" for octet in octets)
