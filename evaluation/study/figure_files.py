"""The figures of a study: their file names, and what they show."""

from __future__ import annotations

from pathlib import Path

from cns_drake.base.files import file_name
from evaluation.report.figures import CHANGE_LEGEND, SETS_LEGEND
from evaluation.report.page_data import Illustration
from evaluation.study.collection import City, RecordingInfo
from evaluation.study.views import PAGE_KIND


def routes_stem(city: City) -> str:
    """Returns the name of the figure of a city's routes, without ending."""
    return file_name(f"routes_{city.name}")


def change_stems(
    city: City, pair: tuple[RecordingInfo, RecordingInfo]
) -> tuple[str, str]:
    """Returns the names of the figures of a change: points, and sets."""
    # Underscores join the parts. They are escaped in all but the first, so that
    # two pairs of stages never share a name.
    earlier, later = (
        one.stage.replace("%", "%p").replace("_", "%u") for one in pair
    )
    change, sets = (
        file_name(f"{kind}_{city.name}_{earlier}_{later}")
        for kind in ("change", "sets")
    )
    return change, sets


def curves_stem(city: City) -> str:
    """Returns the name of the figure of a city's precision and recall."""
    return file_name(f"pr_{city.name}")


def illustrations(city: City, folder: Path) -> list[Illustration]:
    """Returns the figures of a city, in the order of the report."""
    shown = [
        Illustration(
            folder / routes_stem(city),
            f"Routes in {city.name}, from red to blue",
            PAGE_KIND,
            # The page shows each drive's map in a figure of its own.
            section="print",
        )
    ]
    for pair in city.change_pairs():
        first, last = (one.stage for one in pair)
        change, sets = change_stems(city, pair)
        shown.append(
            Illustration(
                folder / change,
                f"What changed in {city.name} between {first} and {last}",
                PAGE_KIND,
                section="change",
                num_panels=2,
                legend=CHANGE_LEGEND,
            )
        )
        shown.append(
            Illustration(
                folder / sets,
                f"Sets H and O of {city.name} {first} and {last}: both orders"
                " and their union",
                PAGE_KIND,
                section="change",
                num_panels=3,
                legend=SETS_LEGEND,
            )
        )
    num_pairs = len(city.recognition_pairs())
    if num_pairs:
        shown.append(
            Illustration(
                folder / curves_stem(city),
                f"Precision over recall in {city.name}; numbers are AUC",
                "svg",
                num_panels=num_pairs,
            )
        )
    return shown


def auc_illustration(folder: Path, beside: str = "") -> Illustration:
    """Returns the figure of all cities together.

    Args:
        folder: of figures.
        beside: title of the reference in the figure; empty for none.
    """
    others = f", and of {beside}" if beside else ""
    return Illustration(
        folder / "auc_over_tcr",
        f"AUC against TCR_sym with 95 % intervals{others}",
        "svg",
        num_panels=3 if beside else 2,
    )


def survival_illustration(folder: Path) -> Illustration:
    """Returns the figure of the AUC that each method keeps."""
    return Illustration(
        folder / "survival",
        "AUC without the change (hollow) and with it (full), and the share"
        " that is kept",
        "svg",
        section="survival",
    )
