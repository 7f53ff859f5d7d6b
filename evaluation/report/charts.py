"""The charts of a report: AUC over TCR_sym, and AUC with and without change."""

from pathlib import Path

from cns_drake.base.errors import InputError
from evaluation.report.contents import Report
from evaluation.report.illustrations import Illustration, Section
from evaluation.results.charts.kinds import draw_chart
from evaluation.results.figure_files import save_figure
from evaluation.results.keys import OWN, STAGE
from evaluation.results.table import Results

_SCATTER = {"kind": "scatter", "x": "tcr_sym", "y": "auc"}
# Controls, in which nothing changes, show no trend.
_SCATTER_OF_CHANGES: dict[str, str] = {**_SCATTER, STAGE: OWN}
_DUMBBELL = {"kind": "dumbbell", "over": STAGE, "metric": "auc"}
_DUMBBELL_TITLE = (
    "AUC without and with the change, and the share that is retained"
)
# Width of charts [px].
_WIDTH = 480


def draw_charts(report: Report, folder: Path) -> list[Illustration]:
    """Draws the charts with the results of all maps.

    Charts of published numbers stand next to the charts of the report. A chart
    without data is left out, with a note in the report.

    Args:
        report: the report.
        folder: folder for the files.

    Returns:
        The figures that were drawn.
    """
    name = "AUC against TCR_sym"
    charts: list[tuple[str, str, Section, dict[str, str], Results]] = [
        ("auc_over_tcr", name, "figures", _SCATTER_OF_CHANGES, report.results)
    ]
    if report.compared:
        published = report.reference.to_results()
        name = f"{name}, of {report.reference.title}"
        stem = "auc_over_tcr_published"
        charts.insert(0, (stem, name, "figures", _SCATTER, published))
    if any(control for _, control in report.pairs):
        charts.append(
            ("survival", _DUMBBELL_TITLE, "survival", _DUMBBELL, report.results)
        )
    shown = []
    for stem, words, section, chart, results in charts if report.pairs else ():
        gates = {"gate": tuple(results.distinct("gate"))}
        try:
            drawn = draw_chart({**chart, **gates}, results, _WIDTH, alone=True)
            save_figure(drawn.figure, folder / stem)
        except InputError as error:
            report.notes = [*report.notes, f"{words}: left out: {error}"]
            continue
        shown.append(
            Illustration(
                folder / stem,
                words,
                "svg",
                section=section,
                methods=drawn.legend,
            )
        )
    return shown
