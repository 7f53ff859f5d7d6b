"""Jobs of a study that read each drive only once."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from cns_drake.base.jobs.running import Job
from evaluation.recognition.describing import Role
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.study.feature_extraction import FeatureExtraction, Further
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
        beside: list[tuple[NamedDrive, Role]]
        beside = [(drive, "places") for drive in pair.beside]
        for drive, role in (*pair.roles, *beside):
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
