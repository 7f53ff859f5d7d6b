"""Second runs of methods, by the protocol of published numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from evaluation.recognition.describing import Role
from evaluation.recognition.protocol import PROTOCOLS, RetrievalProtocol
from evaluation.report.reference import Reference
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.features import described_key
from evaluation.study.place_measurements import DescribedSource
from evaluation.study.storage.study_files import StudyFiles
from evaluation.study.tasks.jobs import Jobs
from evaluation.study.tasks.pair import NamedDrive, Pair


@dataclass(frozen=True)
class Repeat:
    """A second run of a method on a pair of drives.

    The first run is by the study's protocol. The second run is by the protocol
    of published numbers, for a comparison with them.

    Attributes:
        method: the method.
        protocol: the protocol of the published numbers.
        stated: the protocol that tables name: the shipped protocol that equals
            `protocol` with this method, if there is one.
        shares_places: whether the run uses the descriptors of the places that
            the first run computed, instead of computing its own.
    """

    method: MethodChoice
    protocol: RetrievalProtocol
    stated: RetrievalProtocol
    shares_places: bool

    def described(self, role: Role) -> str:
        """Returns the key of the method's descriptors of places or queries."""
        if role == "places" and self.shares_places:
            return self.method.key
        return described_key(self.method.key, self.protocol)

    def of(self, pair: Pair) -> Pair:
        """Returns a pair of drives as the second run measures it."""
        return replace(
            pair,
            stated=self.stated,
            protocol=self.protocol,
            key=f"{pair.key} published {self.method.key}",
            parts={},
        )

    def jobs(
        self,
        files: StudyFiles,
        methods: tuple[MethodChoice, ...],
        distractors: Iterable[NamedDrive],
    ) -> Jobs:
        """Returns the jobs of the second run, see `Engine.add`."""
        return _RepeatJobs(files, (self.method,), repeat=self)


@dataclass
class _RepeatJobs(Jobs):
    """Jobs that read the descriptors that jobs of the first runs make.

    The overlaps of queries with their matches stay unknown.
    """

    repeat: Repeat | None = None
    shows_overlaps = False

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        assert self.repeat is not None
        needs.append(f"features of {drive.name}")
        files = self.files.features(drive.name)
        return files.scans, files.described(self.repeat.described(role))


def repeats_of(
    stages: tuple[str, str, str],
    methods: Iterable[MethodChoice],
    protocol: RetrievalProtocol,
    reference: Reference,
) -> list[Repeat]:
    """Returns the second runs of methods on a pair of drives.

    A method runs a second time if the reference has published numbers of the
    method on this pair, and the protocol of these numbers is not the study's
    protocol. The second run is by the protocol of the published numbers.

    Args:
        stages: names of the map, and of the stages of database and query.
        methods: the methods.
        protocol: the study's protocol.
        reference: the published numbers.
    """
    found = []
    for choice in methods:
        published = reference.protocol_of(*stages, choice.name)
        if published is None:
            continue
        method = choice.make()
        ours = replace(protocol.of(method), exclude_recent=None)
        if (
            published != ours
            and ours.with_queries_of(published).of(method) == published
        ):
            places = ours.descriptor_options(queries=False)
            shares_places = places == published.descriptor_options(
                queries=False
            )
            stated = PROTOCOLS.get(published.name_with(method), published)
            found.append(Repeat(choice, published, stated, shares_places))
    return found
