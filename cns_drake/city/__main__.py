"""Generates the stages of a city: `python -m cns_drake.city WORLD`."""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

from cns_drake.city.generate import differing_files, generate_city
from cns_drake.city.starter import start_city
from cns_drake.errors import InputError
from cns_drake.scenario import load_scenario
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
        "--start",
        action="store_true",
        help="first write what is missing besides roads.yaml: a plan with a "
        "district for each block, two stages, a sequence for each",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        help="of what --start draws by lot (default: %(default)s)",
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing; exit with 1 if a file would change",
    )
    parser.add_argument(
        "--calibrate",
        nargs=2,
        metavar=("EARLIER", "LATER"),
        help="generate nothing; estimate TCR_sym between the sequences of two "
        "stages of the generated city, such as 01 04, and what each group of "
        "stages.yaml contributes to it",
    )
    parser.add_argument(
        "--target",
        type=float,
        metavar="TCR_SYM",
        help="with --calibrate: propose what to change in the earlier stage "
        "to reach this TCR_sym",
    )
    options = parser.parse_args(arguments)
    if options.seed < 0:
        parser.error(f"--seed: {options.seed} is negative")
    if options.target is not None and not options.calibrate:
        parser.error("--target: only with --calibrate")

    def progress(line: str) -> None:
        print(line, file=sys.stderr)

    try:
        if options.calibrate:
            _calibrate(options.world, options.calibrate, options.target)
            return 0
        if options.check:
            changed = differing_files(options.world, progress)
            for path in changed:
                print(path)
            return 1 if changed else 0
        if options.start:
            start_city(options.world, options.seed, progress)
        files = generate_city(options.world, progress)
        write_table(options.world, progress)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    progress(f"{len(files)} files")
    return 0


def _calibrate(world: Path, stages: list[str], target: float | None) -> None:
    # Only who calibrates needs the evaluation.
    from cns_drake.city.calibration import Calibration
    from cns_drake.city.calibration_report import report_lines

    earlier, later = (
        load_scenario(world / f"sequence_{stage}.yaml") for stage in stages
    )
    calibration = Calibration(
        earlier, later, progress=lambda line: print(line, file=sys.stderr)
    )
    for line in report_lines(calibration, target):
        print(line)


if __name__ == "__main__":
    sys.exit(main())
