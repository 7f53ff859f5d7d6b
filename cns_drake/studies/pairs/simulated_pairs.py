"""Pairs of simulated drives, as a study measures them."""

from collections.abc import Sequence
from dataclasses import replace

from cns_drake.scenarios import Scenario, in_made_city
from cns_drake.simulation import SimulationSource
from cns_drake.studies.maps.experiment_maps import MapPairs
from cns_drake.studies.pairs.comparisons import ChangedPair
from cns_drake.studies.pairs.map_upkeep import (
    UPKEEP_VERSION,
    UpkeptSource,
    update_maps,
)
from cns_drake.studies.recording import is_recorded
from evaluation.base import Job, MakePart, fingerprint
from evaluation.drives import RecordingSource
from evaluation.map_update import NOT_MAINTAINED
from evaluation.study import (
    OPENING_COST,
    ChangeTask,
    NamedDrive,
    Pair,
    Study,
    StudyFiles,
    condition_protocol,
    job_name,
)

# Expected time to update a map by a usual drive, once it is open [s].
_UPKEEP_COST = 20.0


def simulated_pair(study: Study, some: MapPairs, one: ChangedPair) -> Pair:
    """Returns a pair of a map as it is measured.

    If later drives update the maps of older ones, the job is added to `study`.
    """
    *drives, asked = (
        replace(
            simulated_drive(study, dated.drive),
            length=dated.length,
            title=dated.title,
            # Without a later year, the city of the query has not aged.
            years=dated.years if one.dated[-1].years else None,
        )
        for dated in one.dated
    )
    database, *beside = with_upkept_maps(study, drives, one.maintain)
    asked_how = {
        "compared": one.fingerprint(),
        **one.protocol.to_json(),
        "radius": None,  # Queries are scored once for all radii.
    }
    digest = fingerprint(asked_how)[:8]
    pair = Pair(
        map_name=some.map_name,
        names=one.names,
        factors={**some.factors, **one.condition.factors},
        seed=one.seed,
        baseline={**some.factors, **one.condition.baseline},
        stated=condition_protocol(one.condition, study.source),
        key=f"{database.name} {asked.name} {digest}",
        database=database,
        query=asked,
        protocol=one.protocol,
        distractors=one.distractors,
        beside=tuple(beside),
        keep=one.keep,
        may_repeat=bool(one.asked or one.distractors),
    )
    task = study.tasks.get(ChangeTask.name)
    if isinstance(task, ChangeTask) and study.experiment.drives == "same-route":
        way = simulated_drive(
            study,
            in_made_city(_way_through_older_city(one), study.output / "cities"),
        )
        way = replace(way, length=asked.length)
        task.ways = {**task.ways, pair: way}
    return pair


def _way_through_older_city(pair: ChangedPair) -> Scenario:
    """Returns the query's drive, but through the city of the database."""
    first, *_, last = pair.drives
    query = pair.unchanged
    city = ("map", "stage", "without", "city", "transient")
    drive = last.replaced(
        **{name: getattr(first, name) for name in city}, name=query.name
    )
    if drive.replaced(name=last.name) == last:
        return last
    if drive == query:
        return query
    content = fingerprint(drive.model_dump(mode="json"))[:8]
    return drive.replaced(name=f"{query.name}_way_{content}")


def with_upkept_maps(
    study: Study, drives: Sequence[NamedDrive], maintain: str
) -> Sequence[NamedDrive]:
    """Returns drives in maps that later drives update; adds the job."""
    if maintain == NOT_MAINTAINED:
        return drives
    sources = tuple(one.source for one in drives)
    content = fingerprint({"drives": [one.name for one in drives]})[:8]
    part = StudyFiles(study.output).part(
        "upkeep", drives[0].name, f"{content} {maintain}"
    )
    job = Job(
        job_name(part),
        MakePart(part, update_maps, (sources, maintain), UPKEEP_VERSION),
        tuple(need for one in drives for need in one.needs),
        sum(OPENING_COST + _UPKEEP_COST * one.share for one in drives),
    )
    study.jobs[job.name] = job
    return [
        replace(
            one,
            name=f"{one.name}_{maintain}_{content}",
            source=UpkeptSource(sources, number, maintain, part),
            needs=(job.name,),
        )
        for number, one in enumerate(drives)
    ]


def simulated_drive(study: Study, drive: Scenario) -> NamedDrive:
    """Returns a drive that is simulated, or read if it is recorded."""
    if is_recorded(drive, study.output):
        return NamedDrive(
            drive.name, RecordingSource(study.output / drive.name)
        )
    return NamedDrive(drive.name, SimulationSource(drive))
