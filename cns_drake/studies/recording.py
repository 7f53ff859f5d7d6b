"""Records drives as parallel jobs, each in its own process."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass
from pathlib import Path
import sys

from cns_drake.pictures import other_stage
from cns_drake.recording import RecordingFolder
from cns_drake.scenarios import (
    Scenario,
    digest_file,
    digest_inputs,
    in_made_city,
    recording_fingerprint,
)
from cns_drake.simulation import simulate
from evaluation.base import (
    Cluster,
    InputError,
    Job,
    Part,
    Reporter,
    Step,
    make_folder,
    read_bytes,
    read_yaml,
    run_jobs,
    scratch_folder,
)

# Assumed number of frames of a drive that states none.
_USUAL_FRAMES = 3000


def record_all(
    scenarios: Sequence[Scenario],
    output: Path,
    cluster: Cluster,
    *,
    overwrite: bool = True,
) -> list[Path]:
    """Records scenarios as `<output>/<name>/`; returns these folders.

    A finished recording of the same scenario and world is kept.

    Args:
        scenarios: the scenarios to record.
        output: folder of the recordings.
        cluster: runs the jobs.
        overwrite: whether other recordings of these names may be replaced.

    Raises:
        InputError: scenarios could not be recorded (the error names all of
            these scenarios), or the folder cannot be made.
    """
    jobs = plan_recordings(scenarios, output, overwrite=overwrite)
    make_folder(output)
    run_jobs(jobs, cluster, "drives")
    return [output / one.name for one in scenarios]


def plan_recordings(
    scenarios: Sequence[Scenario],
    output: Path,
    *,
    overwrite: bool = True,
    pages: Mapping[str, Path] | None = None,
) -> list[Job]:
    """Returns a job for each recording that is not finished yet.

    Each job has the name of its recording. The names of the finished recordings
    are printed on stderr.

    Args:
        scenarios: the scenarios to record.
        output: folder of the recordings.
        overwrite: whether a job may replace another recording of the same name.
        pages: name of a recording -> file of its web page. If given, a
            recording counts as finished only if its page exists.

    Raises:
        InputError: two scenarios have the same name, or a folder must not be
            used.
    """
    for name, count in Counter(s.name for s in scenarios).items():
        if count > 1:
            raise InputError(f"{name}: {count} drives have this name")
    output = output.absolute()
    waiting = []
    for one in scenarios:
        scenario = in_made_city(one, output / "cities")
        page = (pages or {}).get(scenario.name)
        if page is not None:
            page = page.absolute()
        step = Record(scenario, output, overwrite, page)
        if step.is_done():
            print(f"{scenario.name}: already finished", file=sys.stderr)
        else:
            waiting.append(step)
    # Quick checks come before all slow work.
    folders = [RecordingFolder(step.output) for step in waiting]
    others = [files.path.name for files in folders if files.is_finished()]
    if others and not overwrite:
        raise InputError(
            f"{output}: finished recordings of another scenario, world, "
            f"length or program: {', '.join(others)} "
            "(--overwrite replaces them)"
        )
    for files in folders:
        files.check(overwrite)
    return [
        Job(step.scenario.name, step)
        # Long drives first, so that no core waits for one at the end.
        for step in sorted(
            waiting, key=lambda one: -usual_frames([one.scenario])
        )
    ]


def usual_frames(scenarios: Sequence[Scenario]) -> int:
    """Returns the total number of frames of drives, estimated if not set."""
    return sum(one.frames or _USUAL_FRAMES for one in scenarios)


@dataclass(frozen=True)
class Record(Step):
    """A job step that records a drive.

    Attributes:
        scenario: the drive.
        folder: folder of the recording.
        overwrite: whether another recording in this folder may be replaced.
        page: file for a web page of the drive, if any.
    """

    scenario: Scenario
    folder: Path
    overwrite: bool = True
    page: Path | None = None

    @property
    def output(self) -> Path:
        return self.folder / self.scenario.name

    def is_done(self) -> bool:
        return (
            is_recorded(self.scenario, self.folder) and self._is_page_current()
        )

    def run(self, reporter: Reporter) -> None:
        shown = None if self.page is None else self._page_inputs()
        is_new = not is_recorded(self.scenario, self.folder)
        with self._recording_folder(is_new) as (folder, overwrite):
            simulate(
                self.scenario,
                folder,
                page_file=self.page,
                overwrite=overwrite,
                on_note=reporter.note,
            )
        if shown is not None:
            self._page_part.write(shown, None)

    @contextlib.contextmanager
    def _recording_folder(self, is_new: bool) -> Iterator[tuple[Path, bool]]:
        """Yields the folder for the recording, and whether to overwrite there.

        If only the page must be made, an existing recording is not changed.
        """
        if is_new:
            yield self.folder, self.overwrite
            return
        with scratch_folder(self.output) as scratch:
            yield scratch / self.output.name, True

    @property
    def _page_part(self) -> Part:
        """The fingerprint of the page."""
        assert self.page is not None
        return Part(self.page.parent / "parts" / f"{self.page.stem}.data")

    def _is_page_current(self) -> bool:
        return self.page is None or (
            self.page.is_file()
            and self._page_part.is_current(self._page_inputs())
        )

    def _page_inputs(self) -> dict[str, object]:
        beside, *_ = other_stage(self.scenario)
        return self.made_of(
            {
                "drive": recording_fingerprint(
                    self.scenario, digest_inputs(self.scenario)
                ),
                "beside": beside and digest_file(beside.world_file),
            }
        )


def is_recorded(scenario: Scenario, folder: Path) -> bool:
    """Returns whether a finished recording of this exact scenario exists.

    The result is false if the world, the roads or the program have changed
    since the recording was made.

    Args:
        scenario: the scenario.
        folder: folder of the recording.

    Raises:
        InputError: the scenario's files cannot be read.
    """
    files = RecordingFolder(folder / scenario.name)
    if not files.is_finished() or not files.mcap.is_file():
        return False
    scenario = in_made_city(scenario, folder / "cities")
    if scenario.city.is_made and not scenario.world_file.is_file():
        return False
    try:
        # A recording that was damaged later does not count as finished.
        read_yaml(files.scenario)
        read_yaml(files.metadata)["rosbag2_bagfile_information"]
        known = read_bytes(files.fingerprint).decode().split()
    except (InputError, LookupError, TypeError, UnicodeDecodeError):
        return False
    return recording_fingerprint(scenario, digest_inputs(scenario)) in known
