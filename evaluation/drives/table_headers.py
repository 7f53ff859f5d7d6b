"""The columns of a table of poses, from the names in its header.

Programs write quaternions with w first or last, and Euler angles in several
orders. Numbers do not show the order of the columns, so a header is read and
not skipped.
"""

from collections.abc import Sequence
import re

_UNIT = re.compile(r"\[[^]]*\]|\([^)]*\)")
_OTHER = re.compile(r"[^a-z0-9]+")
_TIME = re.compile(r"t|n?secs?|\w*(time|stamp)\w*")
_WORDS = {
    **{"easting": "x", "northing": "y", "altitude": "z", "height": "z"},
    **{"roll": "roll", "pitch": "pitch", "yaw": "yaw", "heading": "yaw"},
    **{axis: axis for axis in "wxyz"},
}
# First letter of a name -> spellings that come before an axis.
_VECTORS = {
    letter: re.compile(
        rf"(\w+_)?({'|'.join(heads.split())})(_\w+)??_?(?P<axis>[wxyz])"
    )
    for letter, heads in {
        "q": "q quat quaternion orient orientation rot rotation",
        "w": "w omega gyr gyro angvel angular_velocity",
        "a": "a acc accel acceleration linear_acceleration specific_force",
        "": "p t pos position trans translation",
    }.items()
}


def split_header(line: str, separator: str | None) -> list[str]:
    """Returns the words of a header, without units.

    The result is empty unless most of the words are known names of columns.
    White space may separate the words even if there is another separator.

    Args:
        line: the header, or a remark that may be a header.
        separator: text between columns; None for white space.
    """
    text = _UNIT.sub("", line.lstrip("# "))
    words = text.split(separator)
    if len(words) == 1:
        words = text.split()
    num_known = sum(_column(word) is not None for word in words)
    return words if 2 * num_known > len(words) else []


def find_columns(
    words: Sequence[str], names: Sequence[str]
) -> list[int] | None:
    """Returns the positions of columns in a table that has a header.

    The known columns are `time`; `x`, `y`, `z`; `qx` to `qz` and `qw` of a
    quaternion; `roll`, `pitch`, `yaw`; `wx` to `wz` of an angular velocity; and
    `ax` to `az` of a specific force. Each name is known in the spellings of
    many programs.

    Args:
        words: words of the header, one for each column of the table.
        names: names of the columns of a table without header; "" for a column
            that is not used.

    Returns:
        For each used column, its position in the table. None if the header
        names too few of the used columns; the columns are then in the order of
        `names`.

    Raises:
        ValueError: the header names a column twice; or it names too few
            columns, and one of these is not at its position in `names`.
    """
    found = [_column(word) for word in words]
    if found.count("w"):
        # A second x y z beside a w belongs to the quaternion.
        for k, name in enumerate(found):
            is_second = name in ("x", "y", "z") and name in found[:k]
            found[k] = f"q{name}" if is_second or name == "w" else name
    used = [name for name in names if name]
    for name in used:
        # A table may have a second time, such as the time of its recording.
        if name != "time" and found.count(name) > 1:
            raise ValueError(f"header: {name} is there twice")
    if set(used) <= set(found):
        return [found.index(name) for name in used]
    for k, name in enumerate(found):
        if name in used and not (k < len(names) and names[k] == name):
            wanted = " ".join(name or "-" for name in names)
            raise ValueError(
                f"header: {words[k]!r} in column {k + 1}; the columns must be"
                f" {wanted}, or the header must name all of these"
            )
    return None


def _column(word: str) -> str | None:
    """Returns the name of a column; None for an unknown word."""
    text = _OTHER.sub("_", word.lower()).strip("_")
    if _TIME.fullmatch(text):
        return "time"
    for letter, pattern in _VECTORS.items():
        if match := pattern.fullmatch(text):
            return f"{letter}{match['axis']}"
    return _WORDS.get(text)
