"""The costs of methods, measured on one core."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from cns_drake.base.jobs.step import Reporter
from evaluation.drives.sampling import gather
from evaluation.recognition.costs import Cost, measure_cost
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import PartStep, part_digest, read_part
from evaluation.study.study_layout import SurveyFiles
from evaluation.study.surveys import open_surveyed

# Number of clouds and of queries; the time of the first does not count.
_NUM_TRIALS = 12


@dataclass(frozen=True)
class MeasureCosts(PartStep):
    """Writes a list of `Cost`, one for each method.

    Attributes:
        source: opens the query drive.
        surveys: of a database, and of the query drive.
        methods: to measure.
        protocol: of the descriptions.
        part: to write.
    """

    source: DriveSource
    surveys: tuple[SurveyFiles, SurveyFiles]
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    part: Path

    def inputs(self) -> dict[str, object]:
        return {
            "drive": self.source.identity(),
            "described": [
                part_digest(survey.described(method))
                for survey in self.surveys
                for method in self.methods
            ],
            "methods": [method.inputs() for method in self.methods],
            "protocol": self.protocol.to_json(),
        }

    def make(self, reporter: Reporter) -> list[Cost]:
        drive = open_surveyed(self.source, self.surveys[1])
        protocol = self.protocol
        costs = []
        with threadpool_limits(limits=1):
            for choice in reporter.track(self.methods, "", len(self.methods)):
                method = choice.make()
                number = protocol.scans(method)
                last = max(len(drive) - number, 0)
                frames = np.linspace(0, last, _NUM_TRIALS).astype(int).tolist()
                clouds = [
                    gather(
                        drive,
                        frame,
                        number,
                        protocol.max_range,
                        method.point_fields,
                        protocol.scans_before(method),
                    )
                    for frame in frames
                ]
                _, database = read_part(self.surveys[0].described(choice))
                _, query = read_part(self.surveys[1].described(choice))
                costs.append(
                    measure_cost(
                        method,
                        clouds,
                        number,
                        database,
                        query,
                        protocol.gate_radius,
                    )
                )
        return costs
