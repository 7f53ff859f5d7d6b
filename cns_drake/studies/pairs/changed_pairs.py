"""Pairs of simulated drives, changed as the conditions of an experiment say."""

from collections.abc import Iterable, Sequence

from cns_drake.studies.drives.named_stages import MissingError
from cns_drake.studies.maps.experiment_maps import MapPairs
from cns_drake.studies.maps.made_maps import MadeMaps
from cns_drake.studies.pairs.comparisons import ChangedPair, PairMaker
from evaluation.results import CAUSE
from evaluation.study import ExperimentRun


def changed_pairs(
    run: ExperimentRun, maps: Sequence[MapPairs]
) -> list[list[ChangedPair]]:
    """Returns the pairs of each map, changed as its conditions say.

    All pairs are built before a city is made, because faults come before
    slow work. Only the pairs of a map whose drives need new cities are
    then built anew.

    Raises:
        InputError: a field of a condition cannot be used, or a city cannot
            be made.
    """
    made = MadeMaps(run.output / "cities")
    found = []
    for some in maps:
        before = made.num_requests
        built = _built(run, some, made)
        found.append((some, *built, made.num_requests > before))
    made.make(run.cluster)
    pairs = []
    for some, changed, notes, lacks_cities in found:
        if lacks_cities:
            changed, notes = _built(run, some, made)
        for text in notes:
            run.on_note(f"{some.map_name}: {text}")
        pairs.append(changed)
    return pairs


def _built(
    run: ExperimentRun, some: MapPairs, made: MadeMaps
) -> tuple[list[ChangedPair], Iterable[str]]:
    """Returns a map's pairs in each possible condition, and notes.

    Args:
        some: the pairs of the map.
        made: the maps that conditions need.
    """
    experiment, source = run.experiment, run.source
    noted: dict[str, None] = {}
    found = []
    for database, query in some.pairs:
        pair = PairMaker(
            database,
            query,
            experiment.drives == "same-route",
            source,
            made.aged,
            made.redrawn,
            noted.setdefault,
        )
        known: set[str] = set()
        for condition in experiment.conditions:
            for seed in experiment.seeds:
                try:
                    changed = pair.build(condition, seed)
                except MissingError as error:
                    label = condition.factors.get(CAUSE, "a condition")
                    noted.setdefault(f"{label} left out: {error}")
                    break
                # A condition without random numbers is measured once.
                key = f"{condition.factors} {changed.fingerprint()}"
                if key not in known:
                    known.add(key)
                    found.append(changed)
    return found, noted
