"""Pairs of simulated drives, changed as the conditions of an experiment say."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.jobs.running import Job
from cns_drake.scenarios.scenario import Scenario
from cns_drake.simulation.simulated_drive import SimulationSource
from cns_drake.studies.drives.named_stages import MissingError
from cns_drake.studies.experiments.conditions import Condition
from cns_drake.studies.experiments.experiment import Experiment
from cns_drake.studies.experiments.protocol_fields import condition_protocol
from cns_drake.studies.maps.experiment_maps import MapPairs
from cns_drake.studies.maps.made_maps import MadeMaps
from cns_drake.studies.pairs.comparisons import ComparedDrives, PairMaker
from cns_drake.studies.pairs.map_upkeep import UpkeptSource, update_maps
from cns_drake.studies.recordings.recording import is_recorded
from evaluation.map_update.upkeep import NOT_MAINTAINED
from evaluation.results.keys import CAUSE
from evaluation.study.sources import RecordingSource
from evaluation.study.storage.parts import MakePart
from evaluation.study.storage.study_files import StudyFiles
from evaluation.study.tasks.jobs import OPENING_COST, job_name
from evaluation.study.tasks.pair import NamedDrive, Pair

# Expected time to update a map by a usual drive, once it is open [s].
_UPKEEP_COST = 60.0


class ChangedPair(NamedTuple):
    """A pair of drives as a condition changes it.

    Attributes:
        names: names of the database drive and the query drive before the
            change.
        query: the query drive before the change.
        compared: the changed drives.
        condition: the condition.
        seed: seed of the condition's random choices.
    """

    names: tuple[str, str]
    query: Scenario
    compared: ComparedDrives
    condition: Condition
    seed: int


class SimulatedPairs:
    """Makes the pairs of simulated drives of an experiment.

    Attributes:
        upkeep: name -> job, for the jobs that update the maps of the pairs made
            so far.
    """

    def __init__(
        self,
        experiment: Experiment,
        conditions: Sequence[Condition],
        output: Path,
        source: str,
        made: MadeMaps,
        on_note: Callable[[str], None],
    ) -> None:
        """Makes nothing yet.

        Args:
            experiment: the experiment.
            conditions: its conditions.
            output: folder of the study's results.
            source: file of the experiment, for errors.
            made: the maps that conditions need.
            on_note: is called with notes on what is left out.
        """
        self.upkeep: dict[str, Job] = {}
        self._experiment = experiment
        self._conditions = conditions
        self._output = output
        self._source = source
        self._made = made
        self._on_note = on_note

    def request_maps(self, some: MapPairs) -> None:
        """Requests the maps that conditions need, which `MadeMaps.make` makes.

        Raises:
            InputError: a field of a condition cannot be used.
        """
        for one in self.changed(some, made=False):
            condition_protocol(one.condition, self._source)

    def pairs(self, some: MapPairs) -> Iterator[tuple[Pair, ComparedDrives]]:
        """Yields the pairs of a map in all conditions possible on the map.

        Each item is a pair to measure, and the changed drives of the pair.
        """
        for one in self.changed(some, made=True):
            yield (
                self._pair(
                    one.compared,
                    one.query,
                    map_name=some.map_name,
                    names=one.names,
                    factors={**some.factors, **one.condition.factors},
                    seed=one.seed,
                    is_baseline=one.condition.is_baseline,
                    stated=condition_protocol(one.condition, self._source),
                ),
                one.compared,
            )

    def changed(self, some: MapPairs, *, made: bool) -> Iterator[ChangedPair]:
        """Yields a map's pairs, changed as each possible condition says.

        Args:
            some: the pairs of the map.
            made: whether the maps that conditions need exist; if not, they are
                requested.
        """
        noted: dict[str, None] = {}
        age, redraw = self._made.want_age, self._made.want_redrawn
        if made:
            age, redraw = self._made.aged, self._made.redrawn
        for database, query in some.pairs:
            pair = PairMaker(
                database,
                query,
                self._experiment.drives == "same-route",
                self._source,
                age,
                redraw,
                noted.setdefault,
            )
            names = _base_name(database), query.name
            known: set[str] = set()
            for condition in self._conditions:
                for seed in self._experiment.seeds:
                    try:
                        compared = pair.build(condition, seed)
                    except MissingError as error:
                        label = condition.factors.get(CAUSE, "a condition")
                        noted.setdefault(f"{label} left out: {error}")
                        break
                    # A condition without random numbers is measured once.
                    key = f"{condition.factors} {compared.fingerprint()}"
                    if key not in known:
                        known.add(key)
                        yield ChangedPair(
                            names, query, compared, condition, seed
                        )
        for text in noted if made else ():
            self._on_note(f"{some.map_name}: {text}")

    def _pair(
        self, compared: ComparedDrives, query: Scenario, **shown: Any
    ) -> Pair:
        """Returns a pair of drives, which tables show with given fields."""
        *drives, asked = (
            replace(self.named_drive(drive), length=length)
            for drive, length in zip(
                compared.drives, compared.lengths, strict=True
            )
        )
        database, *beside = self._with_upkept_maps(drives, compared.maintain)
        way = database
        if self._experiment.drives == "same-route":
            city = {
                name: getattr(compared.database, name)
                for name in ("map", "stage", "without", "transient")
            }
            drive = compared.query.replaced(**city, name=query.name)
            if drive.replaced(name=asked.name) == compared.query:
                drive = compared.query
            elif drive != query:
                content = fingerprint(drive.model_dump(mode="json"))[:8]
                drive = drive.replaced(name=f"{query.name}_way_{content}")
            way = replace(self.named_drive(drive), length=asked.length)
        asked_how = {
            "compared": compared.fingerprint(),
            **compared.protocol.to_json(),
            "radius": None,  # Queries are scored once for all radii.
        }
        digest = fingerprint(asked_how)[:8]
        return Pair(
            **shown,
            key=f"{database.name} {asked.name} {digest}",
            database=database,
            query=asked,
            way=way,
            protocol=compared.protocol,
            distractors=compared.distractors,
            beside=tuple(beside),
            keep=compared.keep,
            ages=compared.ages,
            may_repeat=bool(compared.asked or compared.distractors),
        )

    def _with_upkept_maps(
        self, drives: Sequence[NamedDrive], maintain: str
    ) -> Sequence[NamedDrive]:
        """Returns drives in maps that later drives update; adds the job."""
        if maintain == NOT_MAINTAINED:
            return drives
        sources = tuple(one.source for one in drives)
        content = fingerprint({"drives": [one.name for one in drives]})[:8]
        part = StudyFiles(self._output).part(
            "upkeep", drives[0].name, f"{content} {maintain}"
        )
        job = Job(
            job_name(part),
            MakePart(part, update_maps, (sources, maintain)),
            tuple(need for one in drives for need in one.needs),
            sum(OPENING_COST + _UPKEEP_COST * one.share for one in drives),
        )
        self.upkeep[job.name] = job
        return [
            NamedDrive(
                f"{one.name}_{maintain}_{content}",
                UpkeptSource(sources, number, maintain, part),
                (job.name,),
                one.length,
            )
            for number, one in enumerate(drives)
        ]

    def named_drive(self, drive: Scenario) -> NamedDrive:
        """Returns a drive that is simulated, or read if it is recorded."""
        if is_recorded(drive, self._output):
            return NamedDrive(
                drive.name, RecordingSource(self._output / drive.name)
            )
        return NamedDrive(drive.name, SimulationSource(drive))


def _base_name(database: Scenario) -> str:
    return database.name.removesuffix("_database")
