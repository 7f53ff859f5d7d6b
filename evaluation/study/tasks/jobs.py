"""The jobs of a study's tasks, and what several of them share."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from evaluation.base import Job, MakePart, Part, Reporter, fingerprint
from evaluation.change import DriveMap
from evaluation.drives import DriveSource, sample_frames
from evaluation.maps import CELL_SIZE, map_drive
from evaluation.recognition import (
    DescribedSource,
    FeatureExtraction,
    MethodChoice,
    RetrievalProtocol,
    Role,
)
from evaluation.study.study_files import StudyFiles
from evaluation.study.tasks.pair import NamedDrive, Pair, Result

# Expected time to start a job [s].
STARTING_COST = 0.2
# Expected time to start a job and to open a drive [s].
OPENING_COST = 4.0
# Expected time to read a scan [s].
SCAN_COST = 0.006
# Expected time to map an open drive with each of its scans [s].
_MAP_COST = 14.0
# Expected time of other work [s].
_OTHER_COST = 5.0


@dataclass
class Jobs:
    """The jobs of a study, and the data from which they are made.

    If several pairs of drives need the descriptors of the same drive, one job
    writes these descriptors to files.

    Attributes:
        files: paths of the study's files.
        methods: the methods that are run.
        distractors: drives through other cities, whose places are added to
            each database in this order.
        jobs: name -> job.
        notes: note -> None, for each note on what is left out. A dictionary
            keeps the order and omits repetitions.
        radii: key of a pair -> radii of a match that are used for this pair
            [m].
    """

    files: StudyFiles
    methods: tuple[MethodChoice, ...]
    distractors: Sequence[NamedDrive] = ()
    jobs: dict[str, Job] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)
    radii: dict[str, set[float]] = field(default_factory=dict)
    # Descriptor -> keys of the pairs that need it.
    _uses: dict[str, set[str]] = field(default_factory=dict)

    def expect(self, pair: Pair) -> None:
        """Registers a pair of drives.

        Register all pairs before you call `described`, which must know how many
        pairs need the descriptors of a drive.
        """
        self.radii.setdefault(pair.key, set()).add(pair.protocol.radius)
        for drive, role in pair.roles:
            name = _description_name(drive, role, pair.protocol)
            self._uses.setdefault(name, set()).add(pair.key)

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        """Returns the source from which a job gets a drive's descriptors.

        If several pairs need the descriptors, this function adds a job that
        writes the descriptors, and returns the files: first the file with the
        scans, then a file for each method. If only one pair needs the
        descriptors, the function returns the source of the drive, and the job
        of this pair computes the descriptors itself.

        Args:
            drive: the drive.
            role: role of its scans, `places` or `queries`.
            protocol: protocol of the pair.
            needs: list to which the name of the added job is appended.
            kept: whether to write the files even if only one pair needs them.
        """
        name = _description_name(drive, role, protocol)
        if not (kept or len(self._uses.get(name, ())) > 1):
            needs += drive.needs
            return drive.source
        files = self.files.features(name)
        step = FeatureExtraction(
            drive.source,
            frozenset({role}),
            self.methods,
            protocol,
            files,
            with_scans=True,
            with_map=False,
        )
        job = f"describe {name}"
        cost = self.reading_cost(drive, role, protocol)
        cost += self.description_cost(drive, role, protocol)
        title = f"{drive.title or drive.name}, {role}"
        self.jobs[job] = Job(job, step, drive.needs, cost, title)
        needs.append(job)
        return (
            files.scans,
            *(files.described(one.key) for one in self.methods),
        )

    def description_cost(
        self, drive: NamedDrive, role: Role, protocol: RetrievalProtocol
    ) -> float:
        """Returns the expected time to describe a drive by all methods [s].

        The time does not include opening the drive and reading its scans.
        """
        each = sum(one.make().describe_time for one in self.methods)
        return each * num_described(drive, role, protocol)

    def reading_cost(
        self, drive: NamedDrive, role: Role, protocol: RetrievalProtocol
    ) -> float:
        """Returns the expected time to open a drive and to read its scans [s].

        Only the scans that are described are read.
        """
        made = [one.make() for one in self.methods]
        scans = max(map(protocol.scans, made), default=1)
        number = num_described(drive, role, protocol)
        return OPENING_COST + SCAN_COST * scans * number

    def mapped(
        self, drive: NamedDrive, spacing: float | None, needs: list[str]
    ) -> Result:
        """Returns the file with a drive's map, and adds the job that makes it.

        Args:
            drive: the drive.
            spacing: distance along the path between two scans in the map [m];
                None for all scans.
            needs: list to which the name of the job is appended.
        """
        name = drive.name if spacing is None else f"{drive.name} {spacing:g}"
        part = self.files.part("mapped", name)
        needs.append(job_name(part))
        cost = OPENING_COST
        cost += _MAP_COST * drive.share if spacing is None else 2.5
        arguments = (drive.source, spacing)
        title = f"{drive.title or drive.name}, map"
        return self.add(
            part, map_source, arguments, drive.needs, cost, title=title
        )

    def further_places(
        self,
        drives: Iterable[NamedDrive],
        protocol: RetrievalProtocol,
        needs: list[str],
    ) -> tuple[tuple[Part, ...], ...]:
        """Returns the files of places of further drives in a database.

        Args:
            drives: the drives.
            protocol: protocol of the pair.
            needs: list to which the names of the jobs that write the files are
                appended.

        Returns:
            For each drive, the file with the scans of its places, and one file
            per method with the descriptors of these places.
        """
        found = (
            self.described(one, "places", protocol, needs, kept=True)
            for one in drives
        )
        return tuple(parts for parts in found if isinstance(parts, tuple))

    def add(
        self,
        part: Part,
        function: Callable[..., object],
        arguments: tuple[object, ...],
        needs: Iterable[str] = (),
        cost: float = _OTHER_COST,
        version: int = 1,
        title: str = "",
    ) -> Result:
        """Adds a job that writes a file of results; returns the file.

        The job is named by the file's folder and name.

        Args:
            part: the file.
            function: function whose result is written. The first argument of
                this function is a `Reporter`.
            arguments: further arguments of the function.
            needs: names of jobs that must be finished before.
            cost: approximate cost of the job [s].
            version: see `MakePart`; tasks give their own.
            title: what the job works on, in words.
        """
        name = job_name(part)
        step = MakePart(part, function, arguments, version)
        self.jobs[name] = Job(name, step, tuple(needs), cost, title)
        return part


def map_source(
    reporter: Reporter, source: DriveSource, spacing: float | None
) -> DriveMap:
    """Returns the voxel map of a drive, to compute the change ratio (TCR).

    Args:
        reporter: reports progress.
        source: function that opens the drive.
        spacing: distance along the path between two scans in the map [m]; None
            for all scans.
    """
    drive = source()
    positions = drive.X_WS[:, :3, 3]
    frames = None
    if spacing is not None:
        frames = sample_frames(positions, spacing).tolist()
    voxels = map_drive(drive, CELL_SIZE, frames)
    return DriveMap(drive.name, voxels, positions)


def num_described(
    drive: NamedDrive, role: Role, protocol: RetrievalProtocol
) -> float:
    """Returns about how many places or queries a drive has."""
    spacing = protocol.place_spacing
    if role == "queries":
        spacing = protocol.query_spacing
    return min(drive.num_scans, drive.length / spacing)


def job_name(part: Part) -> str:
    """Returns the name of the job that `Jobs.add` adds for a file."""
    return f"{part.path.parent.name} {part.path.stem}"


def _description_name(
    drive: NamedDrive, role: Role, protocol: RetrievalProtocol
) -> str:
    options = protocol.descriptor_options(queries=role == "queries")
    return f"{drive.name} {role} {fingerprint(options)[:6]}"
