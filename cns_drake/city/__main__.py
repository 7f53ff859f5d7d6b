"""Generates the stages of a city: `python -m cns_drake.city WORLD`."""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

from cns_drake.city.generate import differing_files, generate_city
from cns_drake.errors import InputError
from cns_drake.sequence_table import write_table


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns its exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m cns_drake.city", description=__doc__
    )
    parser.add_argument(
        "world",
        type=Path,
        help=(
            "folder with roads.yaml, city.yaml and stages.yaml, and the "
            "sequences of the city, whose figures are brought up to date"
        ),
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing; exit with 1 if a file would change",
    )
    options = parser.parse_args(arguments)

    def progress(line: str) -> None:
        print(line, file=sys.stderr)

    try:
        if options.check:
            changed = differing_files(options.world, progress)
            for path in changed:
                print(path)
            return 1 if changed else 0
        files = generate_city(options.world, progress)
        write_table(options.world, progress)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    progress(f"{len(files)} files")
    return 0


if __name__ == "__main__":
    sys.exit(main())
