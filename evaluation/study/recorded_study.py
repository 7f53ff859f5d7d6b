"""The experiment `stages` on recordings, which need not exist yet."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from evaluation.alignment import When
from evaluation.base import Cluster, InputError, Space
from evaluation.paper import paper, paper_section
from evaluation.recognition import (
    PAPER_PROTOCOL,
    PROTOCOLS,
    DescribingTime,
    Descriptors,
    MethodChoice,
    RetrievalProtocol,
    asked_key,
)
from evaluation.results import (
    LAST,
    OWN,
    PROTOCOL_BASE,
    STAGE,
    PageDrive,
    PageSection,
    PrintStyle,
    QueryRows,
    Results,
    browser_section,
    change_section,
    cities_section,
    in_table_order,
    lacks_baseline,
    page_section,
    routes_section,
)
from evaluation.study.experiments.experiment import Experiment
from evaluation.study.experiments.experiment_files import load_experiment
from evaluation.study.pair import Pair
from evaluation.study.recorded_city import RecordedCity, ShownCity, draw_cities
from evaluation.study.recordings.map_drives import (
    RecordingInfo,
    drives_by_map,
    nothing_to_compare,
    unlike_shipped,
)
from evaluation.study.recordings.recorded_pairs import recorded_pairs
from evaluation.study.study import Study
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.place import PlaceTask, PoseTask, search_key
from evaluation.study.tasks.task import Task

# The seed of the experiment.
_SEED = 1
_TASKS: Mapping[str, type[Task]] = {
    task.name: task for task in (PlaceTask, PoseTask, ChangeTask)
}
# The question if nothing was measured without the change.
_ALONE = "Who finds how many places again?"


def study_recordings(
    recordings: Sequence[RecordingInfo],
    output: Path,
    cluster: Cluster,
    methods: Sequence[MethodChoice],
    protocols: Mapping[str, RetrievalProtocol],
    *,
    source: str,
    with_costs: bool = False,
    space: Space | None = None,
    pages: Mapping[str, str] | None = None,
    printed: PrintStyle | None = None,
    on_note: Callable[[str], None] = lambda text: None,
    align: When = "auto",
) -> Path:
    """Measures the experiment `stages` on recordings; returns its page.

    The folder `output` then contains the page `index.html`, the tables
    `results.csv` and `queries.csv`, and pictures. Finished work is not
    repeated.

    Args:
        recordings: the recordings.
        output: folder of the results.
        cluster: runs the jobs.
        methods: the methods.
        protocols: name -> protocol of place recognition; the first is the main
            one, and the only one with the control. As a further protocol,
            `paper` measures the paper's methods alone.
        source: where the recordings come from, for errors.
        with_costs: whether the page shows the times and memory of methods.
        space: space on the disk that is needed, if known.
        pages: name of a recording -> address of its 3-D page, relative to
            `output`. Pages that do not exist are left out.
        printed: style of the charts for print; None for the default.
        on_note: is called with notes on what is left out, and on how long the
            study takes.
        align: when recordings are aligned, see `open_pair`.

    Raises:
        InputError: two recordings have the same map and stage, there is nothing
            to compare, a step failed, or a file cannot be written.
    """
    experiment = _experiment(protocols, methods)
    study = Study(experiment, output.absolute(), source, cluster, on_note)
    study.choose(_TASKS, methods)
    main, *_ = protocols
    with_itself = protocols[main].exclude_recent is not None
    cities = drives_by_map(recordings, on_note, align)
    # Only the main protocol has the control, which would double the cost of a
    # further protocol.
    conditions = [
        (one, protocols[name])
        for one in experiment.conditions
        if (name := one.factors.get(PROTOCOL_BASE, main)) == main
        or one.factors[STAGE] != LAST
    ]
    measured: list[RecordedCity] = []
    for city in cities:
        pairs = recorded_pairs(
            city,
            conditions,
            _SEED,
            source,
            on_note,
            both_ways=True,
            with_itself=with_itself,
        )
        of_city = tuple(
            replace(one, methods=_further_methods(name))
            if (name := one.factors.get(PROTOCOL_BASE, main)) != main
            else one
            for one in pairs
        )
        if of_city:
            measured.append(RecordedCity(city, of_city))
    alone = [] if with_itself else nothing_to_compare(cities)
    if not measured:
        raise InputError(f"{source}: {alone[0]}")
    for text in alone:
        on_note(text)
    every = [pair for one in measured for pair in one.pairs]
    shown = [asked for one in measured for asked in one.shown()]
    results, queries = study.measure(every, shown, space)
    drawn = draw_cities(study, measured)
    _note_missed_routes(results, on_note)
    own = [one.name for one in methods if one.file is not None]
    if own and (changed := unlike_shipped(recordings)):
        alone.append(f"Shipped results are not shown: {changed}.")
        own = []
    page = study.write_page(
        results,
        queries,
        every,
        [
            *(f"{name}: {one.to_text()}" for name, one in protocols.items()),
            *_without_control(protocols),
            *alone,
        ],
        [
            *recorded_sections(drawn, results, queries, output, pages or {}),
            *([_costs_section(study, every[0])] if with_costs else []),
        ],
        about=_ALONE if lacks_baseline(results) else None,
        own_methods=own,
        printed=printed,
    )
    return output / page.name


def recorded_sections(
    cities: Sequence[ShownCity],
    results: Results,
    queries: QueryRows,
    output: Path,
    pages: Mapping[str, str],
) -> list[PageSection]:
    """Returns the sections of a page that only recordings have.

    Args:
        cities: what the page shows of each city.
        results, queries: the tables of the study.
        output: folder of the study.
        pages: see `study_recordings`.
    """
    there = {
        name: address
        for name, address in pages.items()
        if (output / address).is_file()
    }
    drives_of = {one.city.name: one.drives for one in cities}
    drives: dict[str, PageDrive] = {}
    for of_city in drives_of.values():
        drives |= of_city
    outcomes = [of_pair for one in cities for of_pair in one.outcomes]
    stages = {
        drive.name: drive.stage
        for one in cities
        for drive in one.city.recordings
    }
    among_cities = cities_section(results)
    beside_paper = paper_section(results, queries, stages)
    return [
        *([among_cities] if among_cities is not None else []),
        *([browser_section(outcomes, drives, there)] if outcomes else []),
        routes_section(
            {name: found.values() for name, found in drives_of.items()}, there
        ),
        change_section(
            results, [change for one in cities for change in one.changes]
        ),
        *([beside_paper] if beside_paper is not None else []),
    ]


def _further_methods(protocol: str) -> Collection[str] | None:
    """Returns the methods that a further protocol measures; None for all.

    The protocol `paper` serves to compare results with the paper's tables.
    """
    if protocol != PAPER_PROTOCOL.name:
        return None
    return frozenset(paper().modes)


def _without_control(protocols: Iterable[str]) -> list[str]:
    """Returns notes on what further protocols leave out, if there are any."""
    main, *further = protocols
    if not further:
        return []
    return [
        f"The control ({STAGE}: {LAST}) is measured by the protocol {main}"
        " only.",
        *(
            f"By the protocol {name}, only the paper's methods are measured."
            for name in further
            if _further_methods(name) is not None
        ),
    ]


def _experiment(
    protocols: Mapping[str, RetrievalProtocol],
    methods: Iterable[MethodChoice],
) -> Experiment:
    """Returns the experiment `stages` with its methods and protocols.

    All protocols have the same options.
    """
    options = {
        option: value
        for name, protocol in protocols.items()
        for option, value in protocol.to_json().items()
        if value != PROTOCOLS[name].to_json()[option]
    }
    names: Any = [*protocols] if len(protocols) > 1 else next(iter(protocols))
    fields = {
        "protocol": {"base": names, **options},
        "methods": {
            one.file.name if one.file else one.name: {
                name: value if isinstance(value, str) else ",".join(value)
                for name, value in one.settings
            }
            for one in methods
        },
        "quick": {},
    }
    return load_experiment("stages", list(fields.items()))


def _note_missed_routes(
    results: Results, on_note: Callable[[str], None]
) -> None:
    """Notes the pairs of drives of which no query has a match."""
    rows = results.where({STAGE: OWN}, metric="with_match", value=0.0).rows
    for database, query in dict.fromkeys((r.database, r.query) for r in rows):
        on_note(f"{query}: no query has a match in {database}")


def _costs_section(study: Study, pair: Pair) -> PageSection:
    """Returns the section with the costs of the methods on a pair."""
    store = study.store
    costs = {}
    for choice, _ in study.methods.values():
        described = Descriptors(choice, "queries", pair.protocol)
        time = asked_key(pair.query.digest, DescribingTime(described))
        costs[choice.name] = (
            store.read(time),
            store.read(search_key(pair, choice)),
        )
    return page_section(
        "costs",
        "Costs",
        "the first pair of drives, on one core; in no table",
        costs=[(name, *costs[name]) for name in in_table_order(costs)],
    )
