"""Faults of an imported file, counted by kind."""

from __future__ import annotations

from collections import Counter

_LONGEST = 100


class ImportFaults:
    """Counts of repaired and omitted parts, with one example of each kind."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._examples: dict[str, str] = {}

    def add(self, kind: str, example: str, number: int = 1) -> None:
        """Counts faults.

        Args:
            kind: the fault and its remedy, in words.
            example: name of the object that has it.
            number: the number of faults.
        """
        kind = _printable(kind)
        self._counts[kind] += number
        self._examples.setdefault(kind, _printable(example))

    def extend(self, others: ImportFaults) -> None:
        """Adds the counts of others, found later."""
        self._counts += others._counts
        self._examples = {**others._examples, **self._examples}

    def take_back(self, kind: str) -> None:
        """Counts one fault less of a kind that has some."""
        kind = _printable(kind)
        self._counts[kind] -= 1
        if not self._counts[kind]:
            del self._counts[kind], self._examples[kind]

    def rows(self) -> list[tuple[str, int, str]]:
        """Returns kind, number and example, most frequent first."""
        return [
            (kind, number, self._examples[kind])
            for kind, number in sorted(
                self._counts.items(), key=lambda item: (-item[1], item[0])
            )
        ]


def _printable(text: str) -> str:
    """Returns a text of a file without control characters."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST - 3]}..."
