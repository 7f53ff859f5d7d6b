"""Pairs of simulated drives, changed as the conditions of an experiment say."""

from collections.abc import Callable, Sequence

from cns_drake.scenarios import Scenario, city_step, make_maps
from cns_drake.studies.drives.named_stages import MissingError
from cns_drake.studies.maps.experiment_maps import MapPairs
from cns_drake.studies.pairs.comparisons import QUERY_SCANS, PairMaker
from cns_drake.studies.pairs.map_upkeep import UpkeptSource, plain_source
from evaluation.base import fingerprint
from evaluation.map_update import NOT_MAINTAINED
from evaluation.recognition import KEEP_ALL
from evaluation.results import CAUSE
from evaluation.study import ExperimentRun, Pair


def changed_pairs(
    run: ExperimentRun, maps: Sequence[MapPairs]
) -> list[list[Pair]]:
    """Returns the pairs of each map, changed as its conditions say.

    All pairs are built before a city is made, because faults come before
    slow work.

    Raises:
        InputError: a field of a condition cannot be used, or a city cannot
            be made.
    """
    found = []
    for some in maps:
        noted: dict[str, None] = {}
        found.append(_built(run, some, noted.setdefault))
        for text in noted:
            run.on_note(f"{some.map_name}: {text}")
    cities = run.output / "cities"
    steps = {
        step.folder: step
        for pairs in found
        for one in pairs
        for drive in simulated_drives(one)
        if (step := city_step(drive, cities)) is not None
    }
    make_maps([*steps.values()], cities, run.cluster)
    return found


def simulated_drives(pair: Pair) -> list[Scenario]:
    """Returns the drives of a database, from older to newer, and the query."""
    drives = (*pair.database, pair.query)
    return [plain_source(one.source).scenario for one in drives]


def pair_fingerprint(pair: Pair, drives: Sequence[Scenario]) -> str:
    """Returns a hash of drives, and of how a pair compares them.

    Drives that differ only in their names have different hashes.

    Args:
        pair: the pair.
        drives: the drives of its database, and the query.
    """
    database, *beside, query = (one.model_dump(mode="json") for one in drives)
    source = pair.database[0].source
    several = {
        "beside": beside,
        "keep": pair.keep,
        "maintain": source.maintain
        if isinstance(source, UpkeptSource)
        else NOT_MAINTAINED,
    }
    is_one = not beside and pair.keep == KEEP_ALL
    of_cause = {
        name: getattr(pair.protocol, name)
        for name in QUERY_SCANS
        if getattr(pair.protocol, name) != getattr(pair.stated, name)
    }
    if of_cause:
        of_cause["seed"] = pair.seed
    return fingerprint(
        {
            "database": database,
            "query": query,
            "distractors": pair.num_distractors,
            **({} if is_one else several),
            **of_cause,
        }
    )


def _built(
    run: ExperimentRun, some: MapPairs, on_note: Callable[[str], object]
) -> list[Pair]:
    """Returns a map's pairs in each possible condition."""
    experiment = run.experiment
    found = []
    for database, query in some.pairs:
        maker = PairMaker(
            database,
            query,
            experiment.drives == "same-route",
            some.map_name,
            some.factors,
            run.output,
            run.source,
            on_note,
        )
        known: set[str] = set()
        for condition in experiment.conditions:
            # A condition without random numbers has the least seed, in whatever
            # order the seeds are given.
            for seed in sorted(experiment.seeds):
                try:
                    pair = maker.build(condition, seed)
                except MissingError as error:
                    label = condition.factors.get(CAUSE, "a condition")
                    on_note(f"{label} left out: {error}")
                    break
                # It is measured once.
                drawn = pair_fingerprint(pair, simulated_drives(pair))
                key = f"{condition.factors} {drawn}"
                if key not in known:
                    known.add(key)
                    found.append(pair)
    return found
