"""The parts of the documents that a reader may run or copy."""

from dataclasses import dataclass
from pathlib import Path
import re
import textwrap

ROOT = Path(__file__).resolve().parents[2]

# First words of inline code that is meant to be run.
PROGRAMS = (
    "cns-drake",
    "cns-eval",
    "dask",
    "python",
    "python3",
    "pip",
    "pytest",
    "ruff",
    "ros2",
    "npm",
    "apt",
    "git",
    "docker",
    "pre-commit",
    "mkdocs",
)
_FENCE = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
_INLINE = re.compile(r"`([^`]+)`")
# A name such as `cns-drake scan`, which the table of commands explains, or
# `cns-drake study ladder`.
_MENTION = re.compile(r"(cns-drake|cns-eval) (study )?[a-z-]+")


@dataclass(frozen=True)
class Page:
    """One document.

    Attributes:
        name: its path from the root of the project.
    """

    name: str
    text: str


@dataclass(frozen=True)
class Piece:
    """One piece of code.

    Attributes:
        page: name of its page.
        line: its first line on the page, from 1.
        language: of a fenced block; empty for shell; "inline" in a sentence
            or a table.
        text: the code itself, without indentation.
    """

    page: str
    line: int
    language: str
    text: str

    @property
    def place(self) -> str:
        """Its place, in the form that editors jump to."""
        return f"{self.page}:{self.line}"


def read(name: str) -> Page:
    """Returns a document by its path from the root of the project."""
    return Page(name, (ROOT / name).read_text(encoding="utf-8"))


def pages() -> list[Page]:
    """Returns all documents, the README first."""
    others = {*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")}
    names = sorted(str(path.relative_to(ROOT)) for path in others)
    names.remove("README.md")
    return [read(name) for name in ["README.md", *names]]


def fenced(page: Page) -> list[Piece]:
    """Returns the fenced blocks of a page, in order."""
    return [
        Piece(
            page.name,
            _line(page.text, block),
            block[2],
            textwrap.dedent(block[3]),
        )
        for block in _FENCE.finditer(page.text)
    ]


def prose(page: Page) -> str:
    """Returns a page without its blocks; lines keep their numbers."""
    return _FENCE.sub(lambda block: "\n" * block[0].count("\n"), page.text)


def inline(page: Page) -> list[Piece]:
    """Returns all code in sentences and tables of a page, in order."""
    rest = prose(page)
    return [
        Piece(
            page.name,
            _line(rest, code),
            "inline",
            " ".join(code[1].replace("\\|", "|").split()),
        )
        for code in _INLINE.finditer(rest)
    ]


def pieces(page: Page) -> list[Piece]:
    """Returns the blocks and the commands in sentences and tables."""
    drawn = ("math", "text")  # Formulas and diagrams.
    return [piece for piece in fenced(page) if piece.language not in drawn] + [
        piece for piece in inline(page) if _is_command(piece)
    ]


def table(page: Page, title: str) -> list[list[str]]:
    """Returns the first table under a heading, or with a row of headings.

    Args:
        page: where it is.
        title: a heading, such as `### A road`, or the first cells, such as
            `| command | does |`.

    Returns:
        The rows below the row of headings, as lists of cells.
    """
    _, found, rest = f"\n{page.text}".partition(f"\n{title}\n")
    assert found, f"{page.name}: no {title}"
    if not title.startswith("|"):
        rest = rest[rest.index("\n|") + 1 :].partition("\n")[2]
    lines = rest.split("\n\n")[0].splitlines()[1:]
    cells = [re.split(r"(?<!\\)\|", line)[1:-1] for line in lines]
    assert cells, f"{page.name}: no table under {title}"
    return [[cell.strip() for cell in row] for row in cells]


def anchors(page: Page) -> set[str]:
    """Returns the anchors of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    return {
        re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-")
        for heading in headings
    }


def _is_command(piece: Piece) -> bool:
    program, _, arguments = piece.text.removeprefix(".venv/bin/").partition(" ")
    return (
        program in PROGRAMS
        and bool(arguments)
        and not _MENTION.fullmatch(piece.text)
    )


def _line(text: str, match: re.Match) -> int:
    return text.count("\n", 0, match.start()) + 1
