"""Pairs of recordings, which a study compares as they were recorded.

Each recording is read only once for a study.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from cns_drake.base.drives.same_world import check_same_world
from cns_drake.base.errors import InputError, did_you_mean, errors_at
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.jobs.running import Job
from cns_drake.base.listing import natural_key
from cns_drake.base.repetitions import repeated
from evaluation.recognition.describing import Role
from evaluation.recognition.kept_places import KEEP_ALL
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.results.table import OWN
from evaluation.study.collection import MapDrives, RecordingInfo
from evaluation.study.feature_extraction import (
    FeatureExtraction,
    Further,
)
from evaluation.study.measurements import DescribedSource
from evaluation.study.study_files import FeatureFiles
from evaluation.study.tasks.task import Jobs, NamedDrive, Pair, Result

# Expected seconds: for the maps of a drive of 3000 scans, and for its places or
# queries.
_MAP_COST = 19.0
_ROLE_COST = 10.0
# Clocks of recordings that begin at 0 say nothing about their order: the first
# stamps of others are years after 1970 [ns].
_DATED_NS = 10**17


class RecordedCondition(NamedTuple):
    """A condition that recordings allow.

    Attributes:
        factors: name -> value of each factor of the condition.
        stage: `own`: each drive through its own stage; `last`: the control, in
            which both drives lead through the stage of the query.
        is_baseline: whether other conditions are compared with this one.
        protocol: protocol of place recognition.
        sessions: the recordings of the database, if there are several.
        keep: which places of these recordings are kept, see
            `evaluation.recognition.kept_places.kept_places`.
    """

    factors: Mapping[str, Any]
    stage: str
    is_baseline: bool
    protocol: RetrievalProtocol
    sessions: tuple[RecordingInfo, ...] = ()
    keep: str | int = KEEP_ALL


def recorded_comparisons(
    city: MapDrives,
    conditions: Iterable[RecordedCondition],
    seed: int,
    on_note: Callable[[str], None],
    *,
    both_ways: bool = False,
    with_itself: bool = False,
) -> Iterator[Pair]:
    """Yields the comparisons of a map's recordings in all conditions.

    Args:
        city: the recordings.
        conditions: the conditions.
        seed: seed of the experiment.
        on_note: is called with a note on each pair without a control.
        both_ways: whether the two drives of a map are compared both ways.
        with_itself: whether each drive is compared with itself, too.
    """
    conditions = list(conditions)
    pairs = city.recognition_pairs() if both_ways else city.change_pairs()
    if with_itself:
        pairs += [(one, one) for one in city.stages.values()]
    composed = [one for one in conditions if one.sessions]
    if composed:
        conditions = [one for one in conditions if not one.sessions]
        yield from _of_sessions(city, composed, seed)
    for pair in pairs if conditions else ():
        control = city.unchanged_pair(*pair)
        for condition in conditions:
            drives = pair if condition.stage == OWN else control
            if drives is None:
                if pair[0] is pair[1]:
                    continue
                on_note(
                    f"{city.name}: no drive on the route of {pair[0].name} in"
                    f" the stage of {pair[1].name}"
                )
                continue
            database, query = (one.named for one in drives)
            # Queries are scored once for all radii.
            asked = condition.protocol.to_json() | {"radius": None}
            yield Pair(
                map_name=city.name,
                names=(pair[0].name, pair[1].name),
                factors=condition.factors,
                seed=seed,
                is_baseline=condition.is_baseline,
                stated=condition.protocol,
                key=f"{database.name} {query.name} {fingerprint(asked)[:8]}",
                database=database,
                query=query,
                way=database,
                protocol=condition.protocol,
            )


def chosen_sessions(
    city: MapDrives, names: Sequence[str], where: str
) -> tuple[RecordingInfo, ...]:
    """Returns the recordings of a database, from older to newer.

    Args:
        city: all recordings of the map; the query is the recording of the last
            stage.
        names: names of the recordings.
        where: file and field of the names, for errors.

    Raises:
        InputError: a recording is unknown, is named twice, is in another world,
            is the query, or is later than the query.
    """
    known = {one.name: one for one in (*city.stages.values(), *city.others)}
    for name in repeated(names):
        raise InputError(f"{where}: {name}: the same drive twice")
    query = city.last
    placed = query.source()
    for name in names:
        if name not in known:
            raise InputError(
                f"{where}: {city.name} has no recording {name!r} (there are:"
                f" {', '.join(sorted(known))}){did_you_mean(name, known)}"
            )
        if name == query.name:
            raise InputError(f"{where}: {name}: this drive is the query")
        drive = known[name].source()
        with errors_at(where):
            check_same_world(drive, placed)
        is_dated = drive.stamps_ns[0] > _DATED_NS < placed.stamps_ns[0]
        if is_dated and drive.stamps_ns[0] > placed.stamps_ns[0]:
            raise InputError(
                f"{where}: {name}: this drive is later than the query"
                f" {query.name}"
            )
    return tuple(
        sorted(
            (known[name] for name in names),
            key=lambda one: natural_key(one.stage),
        )
    )


def _of_sessions(
    city: MapDrives, conditions: Iterable[RecordedCondition], seed: int
) -> Iterator[Pair]:
    """Yields the pairs of databases of several recordings and the query."""
    query = city.last
    for one in conditions:
        drives = [session.named for session in one.sessions]
        digest = fingerprint(
            {
                **one.protocol.to_json(),
                "radius": None,
                "drives": [drive.name for drive in drives],
                "keep": one.keep,
            }
        )[:8]
        yield Pair(
            map_name=city.name,
            names=(city.name, query.name),
            factors=one.factors,
            seed=seed,
            is_baseline=one.is_baseline,
            stated=one.protocol,
            key=f"{drives[0].name} {query.name} {digest}",
            database=drives[0],
            query=query.named,
            way=drives[0],
            protocol=one.protocol,
            beside=tuple(drives[1:]),
            keep=one.keep,
        )


@dataclass
class ExtractionJobs(Jobs):
    """Jobs of a study that read each drive once.

    One job extracts the features of a drive: it maps the drive, describes its
    places and its queries by all methods, and keeps their scans. If pairs use
    several protocols, this job serves only the first protocol.

    Attributes:
        with_map: whether a map is made.
        further: drive -> descriptors by a second protocol.
    """

    with_map: bool = True
    further: Mapping[str, tuple[Further, ...]] = field(default_factory=dict)
    # Drive -> its roles. They are known before the first job is added.
    _roles: dict[str, set[Role]] = field(default_factory=dict)
    _protocol: RetrievalProtocol | None = None

    def expect(self, pair: Pair) -> None:
        super().expect(pair)
        if self._protocol is None:
            self._protocol = pair.protocol
        further: list[tuple[NamedDrive, Role]]
        further = [(drive, "places") for drive in pair.beside]
        for drive, role in (*pair.roles, *further):
            if self._is_extracted(pair.protocol):
                self._roles.setdefault(drive.name, set()).add(role)

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        if not self._is_extracted(protocol):
            return super().described(drive, role, protocol, needs, kept=kept)
        files = self.features(drive, needs)
        return (
            files.scans,
            *(files.described(one.key) for one in self.methods),
        )

    def mapped(
        self, drive: NamedDrive, spacing: float | None, needs: list[str]
    ) -> Result:
        if spacing is not None:
            return super().mapped(drive, spacing, needs)
        return self.features(drive, needs).drive

    def features(self, drive: NamedDrive, needs: list[str]) -> FeatureFiles:
        """Returns the files of a drive's features, and adds their job.

        Args:
            drive: the drive.
            needs: list to which the name of the job is appended.
        """
        name = f"features of {drive.name}"
        needs.append(name)
        files = self.files.features(drive.name)
        if name not in self.jobs:
            roles = frozenset(self._roles.get(drive.name, ()))
            step = FeatureExtraction(
                drive.source,
                roles,
                self.methods,
                self._protocol or FAIR_PROTOCOL,
                files,
                with_scans=bool(roles),
                with_map=self.with_map,
                further=self.further.get(drive.name, ()),
                removes_descriptors=True,
            )
            cost = self.with_map * _MAP_COST + _ROLE_COST * len(roles)
            self.jobs[name] = Job(name, step, drive.needs, cost)
        return files

    def _is_extracted(self, protocol: RetrievalProtocol) -> bool:
        """Returns whether these jobs describe drives by a protocol."""
        assert self._protocol is not None
        return (
            protocol.descriptor_options() == self._protocol.descriptor_options()
        )
