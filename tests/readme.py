"""The README taken apart: everything in it that a reader may run or copy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import re
import textwrap

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"

# What an inline piece of code begins with if it is meant to be run.
PROGRAMS = (
    *("cns-drake", "cns-eval", "dask", "python", "python3", "pip", "pytest"),
    *("ruff", "ros2", "npm", "apt", "git", "docker"),
)
_FENCE = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
_INLINE = re.compile(r"`([^`]+)`")
# `cns-drake scan`, as a name of what the table of commands explains.
_MENTION = re.compile(r"(cns-drake|cns-eval) [a-z]+")


@dataclass(frozen=True)
class Piece:
    """One piece of code.

    Attributes:
        line: where it begins in the README, from 1.
        language: of a fenced block; empty for shell; "inline" in a sentence
            or a table.
        text: the code itself, without indentation.
    """

    line: int
    language: str
    text: str


def read() -> str:
    """Returns the text of the README."""
    return README.read_text(encoding="utf-8")


def fenced(markdown: str) -> list[Piece]:
    """Returns the fenced blocks of a text, in order."""
    return [
        Piece(_line(markdown, block), block[2], textwrap.dedent(block[3]))
        for block in _FENCE.finditer(markdown)
    ]


def inline(markdown: str) -> list[Piece]:
    """Returns all code in sentences and tables of a text, in order."""
    # Blocks are blanked, not removed, so that lines keep their numbers.
    rest = _FENCE.sub(lambda block: "\n" * block[0].count("\n"), markdown)
    return [
        Piece(
            _line(rest, code),
            "inline",
            " ".join(code[1].replace("\\|", "|").split()),
        )
        for code in _INLINE.finditer(rest)
    ]


def pieces(markdown: str) -> list[Piece]:
    """Returns the blocks and the commands in sentences and tables."""
    return fenced(markdown) + [p for p in inline(markdown) if _is_command(p)]


def _is_command(piece: Piece) -> bool:
    program, _, arguments = piece.text.removeprefix(".venv/bin/").partition(" ")
    return (
        program in PROGRAMS
        and bool(arguments)
        and not _MENTION.fullmatch(piece.text)
    )


def _line(text: str, match: re.Match) -> int:
    return text.count("\n", 0, match.start()) + 1
