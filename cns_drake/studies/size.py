"""Size: what more and more places of other cities cost each method.

The drives are those of the ladder's rung `none`; all other places are of other
cities. Each method has its AUC and the time of a query at each size.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
import math
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.studies.ladder import describe_job, distracting_drives
from cns_drake.studies.ladder_rungs import plain_drives
from cns_drake.studies.reproduction import recordable_map
from evaluation.recognition.description import Role
from evaluation.recognition.protocol import DEFAULT_PROTOCOL, RetrievalProtocol
from evaluation.report.tables import Table, in_table_order
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import MakePart, Part, StudyFiles
from evaluation.study.rungs import SizePoint, measure_size

# More would not be drawn within days.
MOST_PLACES = 100_000
# Expected seconds to measure a method at a size.
_SIZE_COST = 60.0


def measure_sizes(
    map_name: str,
    sizes: Iterable[int],
    output: Path,
    cluster: Cluster,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol = DEFAULT_PROTOCOL,
    on_note: Callable[[str], None] = lambda text: None,
) -> Path:
    """Measures methods with more and more places of other cities.

    The last drive of the map, given by name or folder, asks. Finished work is
    not repeated. Returns the path of `size.csv`.

    Raises:
        InputError: the map is unknown, a number is not from 0 to 100,000, or a
            step failed.
    """
    numbers = sorted(set(sizes))
    for number in numbers:
        if not 0 <= number <= MOST_PLACES:
            raise InputError(
                f"--places: {number} is not from 0 to {MOST_PLACES}"
            )
    folder = MapFolder(recordable_map(map_name))
    drive = load_scenario(folder.recordable_drives()[-1])
    plain = plain_drives(drive)
    files = StudyFiles(output.absolute())
    make_folder(output)
    others = distracting_drives(
        plain.database,
        numbers[-1],
        protocol.place_spacing,
        output / "cities",
        cluster,
        on_note,
    )
    drives: list[tuple[Scenario, Role]] = [
        *((one, "places") for one in (plain.database, *others)),
        (plain.query, "queries"),
    ]
    described = [
        describe_job(one, role, methods, protocol, files)
        for one, role in drives
    ]
    jobs = [job for job, _ in described]
    *places, asking = (written for _, written in described)
    needs = tuple(job.name for job in jobs)
    parts: list[Part] = []
    for number in numbers:
        for method in methods:
            name = f"size {number} {method.name}"
            part = files.part("rungs", name)
            first, *rest = (one.described(method.name) for one in places)
            step = MakePart(
                part,
                measure_size,
                (
                    first,
                    asking.described(method.name),
                    tuple(rest) if number else (),
                    number,
                    method,
                    protocol,
                ),
            )
            jobs.append(Job(name, step, needs, _SIZE_COST))
            parts.append(part)
    run_jobs(jobs, cluster)
    path = output / "size.csv"
    size_table(folder.name, [part.read() for part in parts]).write_csv(path)
    return path


def size_table(map_name: str, points: Sequence[SizePoint]) -> Table:
    """Returns a row for each method and size.

    `growth` is the exponent with which the time of a query grows with the
    number of all places, from the size before.
    """
    rows = []
    for method in in_table_order(one.method for one in points):
        before = None
        for one in sorted(
            (one for one in points if one.method == method),
            key=lambda point: point.places,
        ):
            growth = math.nan
            if before is not None and before.places < one.places:
                growth = math.log(one.query_ms / before.query_ms) / math.log(
                    one.places / before.places
                )
            rows.append({"map": map_name, **asdict(one), "growth": growth})
            before = one
    return Table.of_rows(rows)
