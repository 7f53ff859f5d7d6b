"""Studies whose jobs run in the process of a test, one after the other.

Tests of `cns_drake.base.jobs` cover other processes, which would only slow
these tests.
"""

from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from cns_drake.base.jobs.processes import nothing_left
from cns_drake.base.jobs.step import Reporter
from cns_drake.pictures.stage_scene import StageScene
from evaluation.paper import reference_for
from evaluation.recognition.protocol import FAIR_PROTOCOL
from evaluation.study.chosen_methods import choose_methods
from evaluation.study.recordings.recording_search import find_recordings
from evaluation.study.report_jobs.stages_report import StagesReport


def do(jobs):
    """Runs unfinished jobs, sorted so that none needs a later one.

    Returns:
        The names of the jobs that ran.
    """
    done = []
    for job in jobs:
        if not nothing_left(job.step):
            job.step.run(Reporter())
            done.append(job.name)
    return done


def run_here(patch, *modules):
    """Has modules run their jobs in this process."""
    for module in modules:
        patch.setattr(
            module, "run_jobs", lambda jobs, cluster, unit="": do(jobs)
        )


def report(recordings, output, methods=None, protocol=FAIR_PROTOCOL):
    """Returns the path of the report on a folder of recordings."""
    found = find_recordings(recordings)
    reference = reference_for({one.map_name for one in found})
    chosen = choose_methods() if methods is None else tuple(methods)
    study = StagesReport(found, output, chosen, protocol, reference=reference)
    do(study.jobs())
    return study.assemble(with_tables=True)


def leave_figures_unrendered(patch):
    """Has figures made but not rendered, which takes half of a study's time.

    Drives are drawn on a blank picture of their stage.

    For tests of other results than what figures show.
    """

    def write(figure, file, **options):
        Path(file).write_text("<svg>a figure</svg>")

    def blank(scene, view, width, height, **options):
        return np.zeros((height, width, 3), dtype=np.uint8)

    patch.setattr(Figure, "draw_without_rendering", lambda figure: None)
    patch.setattr(Figure, "savefig", write)
    patch.setattr(StageScene, "photograph", blank)


def report_files(output):
    """Returns name -> bytes of all files of a report."""
    return {
        path.relative_to(output).as_posix(): path.read_bytes()
        for path in sorted(output.rglob("*"))
        if path.is_file() and output / "parts" not in path.parents
    }
