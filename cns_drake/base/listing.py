"""The order in which numbered files and stages are read."""

from pathlib import Path
import re

_NUMBERS = re.compile(r"([0-9]+)")


def natural_key(text: str) -> tuple:
    """Returns the key by which names are sorted in natural order.

    Digits in a name count as whole numbers: 9 comes before 10, `v9` before
    `v10`, and `2012-2-4` before `2012-10-28`. Names that differ only in leading
    zeros are in the order of text.
    """
    # Text and numbers alternate. Of two numbers, the longer one is greater.
    return tuple(
        (len(part.lstrip("0")), part.lstrip("0")) if k % 2 else part
        for k, part in enumerate(_NUMBERS.split(text))
    ), text


def listed(folder: Path, pattern: str = "*") -> list[Path]:
    """Returns the files and folders in a folder, in natural order.

    Hidden files are left out: editors and macOS write files such as
    `._000001.bin` next to the user's files.

    Args:
        folder: the folder. If the folder does not exist, the result is empty.
        pattern: pattern of the names, as for `Path.glob`.
    """
    found = [path for path in folder.glob(pattern) if not _is_hidden(path)]
    return sorted(found, key=lambda path: natural_key(str(path)))


def _is_hidden(path: Path) -> bool:
    return path.name.startswith(".")
