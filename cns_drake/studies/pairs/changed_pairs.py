"""Pairs of simulated drives, changed as the conditions of an experiment say."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from cns_drake.scenarios import city_step, in_made_city, make_maps
from cns_drake.studies.drives.named_stages import MissingError
from cns_drake.studies.maps.experiment_maps import MapPairs
from cns_drake.studies.pairs.comparisons import ChangedPair, PairMaker
from evaluation.base import InputError
from evaluation.results import CAUSE
from evaluation.study import ExperimentRun


def changed_pairs(
    run: ExperimentRun, maps: Sequence[MapPairs]
) -> list[list[ChangedPair]]:
    """Returns the pairs of each map, changed as its conditions say.

    All pairs are built before a city is made, because faults come before
    slow work.

    Raises:
        InputError: a field of a condition cannot be used, or a city cannot
            be made.
    """
    cities = run.output / "cities"
    found = []
    for some in maps:
        noted: dict[str, None] = {}
        found.append(_built(run, some, noted.setdefault))
        for text in noted:
            run.on_note(f"{some.map_name}: {text}")
    steps = {}
    for one in (one for pairs in found for one in pairs):
        for drive in one.drives:
            try:
                step = city_step(drive, cities)
            except InputError as error:
                raise InputError(f"{run.source}: {error}") from None
            if step is not None:
                steps[step.folder] = step
    make_maps([*steps.values()], cities, run.cluster)
    return [[_in_cities(one, cities) for one in pairs] for pairs in found]


def _in_cities(pair: ChangedPair, cities: Path) -> ChangedPair:
    """Returns a pair whose drives go through the cities that were made."""
    dated = [
        one._replace(drive=in_made_city(one.drive, cities))
        for one in pair.dated
    ]
    return replace(pair, dated=tuple(dated))


def _built(
    run: ExperimentRun, some: MapPairs, on_note: Callable[[str], object]
) -> list[ChangedPair]:
    """Returns a map's pairs in each possible condition."""
    experiment, source = run.experiment, run.source
    found = []
    for database, query in some.pairs:
        pair = PairMaker(
            database,
            query,
            experiment.drives == "same-route",
            source,
            on_note,
        )
        known: set[str] = set()
        for condition in experiment.conditions:
            for seed in experiment.seeds:
                try:
                    changed = pair.build(condition, seed)
                except MissingError as error:
                    label = condition.factors.get(CAUSE, "a condition")
                    on_note(f"{label} left out: {error}")
                    break
                # A condition without random numbers is measured once.
                key = f"{condition.factors} {changed.fingerprint()}"
                if key not in known:
                    known.add(key)
                    found.append(changed)
    return found
