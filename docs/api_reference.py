"""Builds the API reference: one page of the public names of each package.

python docs/api_reference.py FOLDER
"""

import importlib
from pathlib import Path
import re
import sys
import textwrap

import pdoc

PACKAGES = ("cns_drake", "evaluation")
_EXAMPLE = re.compile(r"^Example:\n((?:[ \t]+.+\n?|\n)+)", re.MULTILINE)


def build(folder: Path) -> None:
    """Writes the pages of both packages and their index to a folder."""
    for package in PACKAGES:
        module = importlib.import_module(package)
        # The packages load a name when it is asked for; pdoc documents what
        # is there.
        vars(module).update({n: getattr(module, n) for n in module.__all__})
    sections = pdoc.docstrings.google
    # It would set an example as a paragraph.
    pdoc.docstrings.google = lambda text: sections(_with_code(text))
    try:
        pdoc.render.configure(docformat="google")
        pdoc.pdoc(*PACKAGES, output_directory=folder)
    finally:
        pdoc.docstrings.google = sections


def _with_code(text: str) -> str:
    """Returns a docstring whose examples are blocks of code."""

    def fenced(match: re.Match) -> str:
        code = textwrap.dedent(match[1]).strip()
        return f"**Example**\n\n```python\n{code}\n```\n"

    return _EXAMPLE.sub(fenced, text)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    build(Path(sys.argv[1]))
