"""What an import does with each part of the elements that it reads.

The readers of all formats share this module. Tables say for each element which
of its parts (tags, attributes) are read, and which cannot change a shape. All
other parts are counted, so that no part is dropped in silence.
"""

from collections.abc import Iterable, Mapping, Sequence
import functools
from pathlib import Path
import re

from evaluation.base import parse_yaml
from worlds.imports.faults import ImportFaults


class PartTable:
    """A table of the parts of elements.

    The file has up to three sections. In names of parts, `*` stands for any
    text.

    - `elements`: element -> `read` and `shapeless`, both lists of names;
      `usual`, name -> values that have no effect. A name in `usual` need not be
      in a list: with other values it is counted.
    - `shapeless`: names of parts that change no shape, of any element.
    """

    def __init__(self, file: Path):
        """Reads a table from a file that belongs to this program."""
        table = parse_yaml(file.read_bytes())
        self._elements: Mapping[str, Mapping] = table["elements"]
        self._shapeless = " ".join(table.get("shapeless", ()))
        # Elements and a part -> usual values and use.
        self._rules: dict[tuple, tuple[list[str] | None, str | None]] = {}

    def names(self, element: str, use: str) -> list[str]:
        """Returns the names in one list of an element, such as `read`."""
        return " ".join(self._elements[element].get(use, ())).split()

    def account(
        self,
        elements: Sequence[str],
        parts: Mapping[str, str],
        name: str,
        faults: ImportFaults,
        word: str = "",
    ) -> None:
        """Accounts for each part of one object, in `faults`.

        Args:
            elements: what the object is, at least one element. A part is read
                if any of these elements reads it.
            parts: names and values of the object's parts.
            name: name of the object.
            faults: gets the counts of parts that are not read, and the names of
                all other parts.
            word: what a part is called, such as `tag `, before its name.
        """
        for part, value in parts.items():
            use = self._use(tuple(elements), part, str(value).strip())
            if use is None:
                where = f"{elements[0]}, not read"
                faults.add(f"{word}{part} of {where}", name)
            elif use:
                faults.note_part(elements[0], use, part)

    def _use(
        self, elements: tuple[str, ...], part: str, value: str
    ) -> str | None:
        """Returns `read` or `shapeless`; "" if no effect; None to count."""
        key = elements, part
        if key not in self._rules:
            self._rules[key] = self._rule(elements, part)
        usual, use = self._rules[key]
        if usual is not None and value not in usual:
            return None
        return use

    def _rule(
        self, elements: tuple[str, ...], part: str
    ) -> tuple[list[str] | None, str | None]:
        """Returns the usual values of a part, if listed, and its use."""
        usual = None
        for element in elements:
            values = self._elements[element].get("usual", {})
            if part in values:
                usual = [*(usual or []), *values[part]]
        for use in ("read", "shapeless"):
            for element in elements:
                listed = self._elements[element].get(use, ())
                if _pattern(" ".join(listed)).fullmatch(part):
                    return usual, use
        if _pattern(self._shapeless).fullmatch(part):
            return usual, "shapeless"
        return usual, None if usual is None else ""


@functools.cache
def _pattern(names: str) -> re.Pattern[str]:
    """Returns a pattern of names between blanks, in which `*` is any text."""
    return re.compile(
        "|".join(_pattern_of(names.split())) or r"(?!)", re.IGNORECASE
    )


def _pattern_of(names: Iterable[str]) -> Iterable[str]:
    return (re.escape(name).replace(r"\*", ".*") for name in names)
