"""The job that measures what methods cost, on one core."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from cns_drake.base.jobs.running import Tell
from evaluation.recognition.costs import measure_cost
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.sequences.sampling import gather
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.code_digest import measuring_code
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import (
    is_current,
    part_digest,
    read_part,
    write_part,
)
from evaluation.study.study_layout import SurveyFiles

# Clouds that are described, and queries that are asked; the first warms up.
_NUM_TRIALS = 12


def measure_costs(
    source: DriveSource,
    surveys: tuple[SurveyFiles, SurveyFiles],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    result: Path,
    tell: Tell,
) -> None:
    """Writes a list of `Cost`, one a method.

    Args:
        source: opens the drive that asks.
        surveys: of a database, and of the drive that asks.
        methods: to measure.
        protocol: that both were described by.
        result: to write.
        tell: is told how far it is.

    Raises:
        InputError: if the drive cannot be read, a method fails, or a file
            cannot be read or written.
    """
    inputs = _inputs(source, surveys, methods, protocol)
    sequence = source()
    costs = []
    with threadpool_limits(limits=1):
        for done, choice in enumerate(methods):
            tell.progress(done, len(methods))
            method = choice.make()
            number = protocol.scans(method)
            last = max(len(sequence) - number, 0)
            frames = np.linspace(0, last, _NUM_TRIALS).astype(int).tolist()
            clouds = [
                gather(
                    sequence,
                    frame,
                    number,
                    protocol.max_range,
                    method.point_fields,
                )
                for frame in frames
            ]
            _, database = read_part(surveys[0].described(choice))
            _, query = read_part(surveys[1].described(choice))
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
    write_part(result, inputs, costs)


def are_costs_measured(
    source: DriveSource,
    surveys: tuple[SurveyFiles, SurveyFiles],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    result: Path,
) -> bool:
    """Tells whether there is nothing to do; see `measure_costs`."""
    return is_current(result, _inputs(source, surveys, methods, protocol))


def _inputs(
    source: DriveSource,
    surveys: tuple[SurveyFiles, SurveyFiles],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> dict:
    return {
        "drive": source.identity(),
        "described": [
            part_digest(survey.described(method))
            for survey in surveys
            for method in methods
        ],
        "methods": [method.inputs() for method in methods],
        "protocol": protocol.to_json(),
        "code": measuring_code(),
    }
