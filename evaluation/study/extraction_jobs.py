"""Jobs of a study that read each drive only once."""

from collections import defaultdict
from dataclasses import dataclass, field

from cns_drake.base import Job
from evaluation.recognition import FAIR_PROTOCOL, RetrievalProtocol, Role
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.feature_extraction import FeatureExtraction, Further
from evaluation.study.features import described_key
from evaluation.study.place_measurements import DescribedSource
from evaluation.study.storage.study_files import FeatureFiles
from evaluation.study.tasks.jobs import Jobs
from evaluation.study.tasks.pair import NamedDrive, Pair, Result

# Expected time to map a drive of 3000 scans [s].
_MAP_COST = 19.0
# Expected time to describe its places or its queries [s].
_ROLE_COST = 10.0


@dataclass
class ExtractionJobs(Jobs):
    """Jobs of a study that read each drive once.

    One job extracts the features of a drive: it maps the drive, describes its
    places and its queries by all methods, and keeps their scans. If pairs use
    several protocols, the first protocol is the main one. The job also serves a
    further protocol that chooses the same scans and changes only how queries
    are seen; see `RetrievalProtocol.with_queries_of`. For any other protocol,
    the drive is read again.

    Attributes:
        with_map: whether a map is made. Without a map, the job serves only the
            main protocol.
    """

    with_map: bool = True
    # Drive -> its roles. They are known before the first job is added.
    _roles: dict[str, set[Role]] = field(default_factory=dict)
    # Drive -> key of descriptors -> the descriptors by a further protocol.
    _further: dict[str, dict[str, Further]] = field(
        default_factory=lambda: defaultdict(dict)
    )
    _protocol: RetrievalProtocol | None = None

    def expect(self, pair: Pair) -> None:
        super().expect(pair)
        if self._protocol is None:
            self._protocol = pair.protocol
        beside: list[tuple[NamedDrive, Role]]
        beside = [(drive, "places") for drive in pair.beside]
        if not self._chooses_same_scans(pair.protocol):
            return
        for drive, role in (*pair.roles, *beside):
            self._roles.setdefault(drive.name, set()).add(role)
            for choice in self.methods:
                key = self._key(choice, role, pair.protocol)
                if key != choice.key:
                    further = self._further[drive.name]
                    _, roles, _ = further.get(key, (None, frozenset(), None))
                    further[key] = choice, roles | {role}, pair.protocol

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        if not self._chooses_same_scans(protocol):
            return super().described(drive, role, protocol, needs, kept=kept)
        files = self.features(drive, needs)
        keys = [self._key(one, role, protocol) for one in self.methods]
        return (files.scans, *map(files.described, keys))

    def mapped(
        self, drive: NamedDrive, spacing: float | None, needs: list[str]
    ) -> Result:
        if spacing is not None:
            return super().mapped(drive, spacing, needs)
        return self.features(drive, needs).drive

    def features(self, drive: NamedDrive, needs: list[str]) -> FeatureFiles:
        """Returns the files of a drive's features.

        The job that makes these files is added.

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
                further=tuple(self._further[drive.name].values()),
                removes_descriptors=True,
            )
            cost = self.with_map * _MAP_COST + _ROLE_COST * len(roles)
            self.jobs[name] = Job(name, step, drive.needs, cost)
        return files

    def _chooses_same_scans(self, protocol: RetrievalProtocol) -> bool:
        """Returns whether a protocol needs no other scans than the main one.

        The kept scans, from which overlaps are computed, are as recorded only
        if there is a map.
        """
        assert self._protocol is not None
        if self.with_map:
            protocol = protocol.with_queries_of(self._protocol)
        return (
            protocol.descriptor_options() == self._protocol.descriptor_options()
        )

    def _key(
        self, choice: MethodChoice, role: Role, protocol: RetrievalProtocol
    ) -> str:
        """Returns the key of a method's descriptors of places or queries."""
        assert self._protocol is not None
        method = choice.make()
        own, main = (
            one.of(method).descriptor_options(queries=role == "queries")
            for one in (protocol, self._protocol)
        )
        return (
            choice.key if own == main else described_key(choice.key, protocol)
        )
