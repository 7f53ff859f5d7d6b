"""The step that records a drive, and the check whether it is done."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
from pathlib import Path
import shutil

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError
from cns_drake.base.files import user_errors
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.base.yaml_files import read_yaml
from cns_drake.recording.recording_folder import RecordingFolder
from cns_drake.scenarios.planning import shown_beside
from cns_drake.scenarios.provenance import (
    digest_file,
    digest_inputs,
    recording_fingerprint,
)
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import world_file
from evaluation.study.parts import is_current, write_part
from evaluation.study.recording_survey import RecordingSurvey
from evaluation.study.surveys import Survey


@dataclass(frozen=True)
class Record(Step):
    """Records a scenario, and saves a web page of the drive.

    Attributes:
        scenario: to record.
        folder: the folder of recordings.
        overwrite: replace another recording of that name.
        page: file of the page, if any.
        survey: of the recording, made during the simulation. After an
            interruption, the step that needs the survey makes it.
    """

    scenario: Scenario
    folder: Path
    overwrite: bool = True
    page: Path | None = None
    survey: Survey | None = None

    @property
    def output(self) -> Path:
        return self.folder / self.scenario.name

    def is_done(self) -> bool:
        return is_recorded(self.scenario, self.folder) and self._is_shown()

    def run(self, reporter: Reporter) -> None:
        with uninterrupted():
            from cns_drake.simulation.simulation import simulate

        shown = None if self.page is None else self._shown()
        is_new = not is_recorded(self.scenario, self.folder)
        survey = self.survey if is_new and self._is_first_read() else None
        found: list[RecordingSurvey] = []

        def read(drive: Drive) -> None:
            assert survey is not None
            methods = survey.methods if survey.roles else ()
            # The survey's own job reports the error again.
            with contextlib.suppress(Exception):
                found.append(survey.find(drive, methods, Reporter()))

        with self._place(is_new) as (folder, overwrite):
            simulate(
                self.scenario,
                folder,
                page_file=self.page,
                overwrite=overwrite,
                reader=None if survey is None else read,
                on_frame=reporter.progress,
                on_note=reporter.note,
            )
        for one in found:
            assert survey is not None
            survey.write(one)
        if shown is not None:
            write_part(self._page_part, shown, None)

    def _is_first_read(self) -> bool:
        """Returns whether the first LiDAR's scans are surveyed."""
        first, *others = self.scenario.lidars
        return first == "lidar" or not others

    @contextlib.contextmanager
    def _place(self, is_new: bool) -> Iterator[tuple[Path, bool]]:
        """Yields the folder for the recording, and whether to overwrite there.

        A recording that is up to date stays as it is when its page is made
        anew.
        """
        if is_new:
            yield self.folder, self.overwrite
            return
        spare = self.output.with_name(f"{self.output.name}.page.part")
        try:
            yield spare, True
        finally:
            with user_errors(spare):
                shutil.rmtree(spare)

    @property
    def _page_part(self) -> Path:
        """Writes the fingerprint of the page."""
        assert self.page is not None
        return self.page.parent / "parts" / f"{self.page.stem}.data"

    def _is_shown(self) -> bool:
        return self.page is None or (
            self.page.is_file() and is_current(self._page_part, self._shown())
        )

    def _shown(self) -> dict[str, object]:
        """Returns all inputs of the page."""
        beside, _ = shown_beside(self.scenario)
        return self.made_of(
            {
                "drive": recording_fingerprint(
                    self.scenario, digest_inputs(self.scenario)
                ),
                "beside": beside and digest_file(world_file(beside)),
            }
        )


def is_recorded(scenario: Scenario, folder: Path) -> bool:
    """Returns whether a finished recording of exactly this scenario exists.

    It must be of the present world, roads and program.

    Args:
        scenario: of the recording.
        folder: the folder of recordings.

    Raises:
        InputError: the scenario's files cannot be read.
    """
    files = RecordingFolder(folder / scenario.name)
    if not files.is_finished() or not files.mcap.is_file():
        return False
    try:
        # Recordings that were damaged later do not count.
        read_yaml(files.scenario)
        read_yaml(files.metadata)["rosbag2_bagfile_information"]
        with user_errors(files.fingerprint):
            known = files.fingerprint.read_text("utf-8").split()
    except (InputError, LookupError, TypeError, UnicodeDecodeError):
        return False
    return recording_fingerprint(scenario, digest_inputs(scenario)) in known
