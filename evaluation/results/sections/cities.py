"""The section of a page that says which shipped city was measured."""

from evaluation.results.charts.chart import NARROW, WIDE
from evaluation.results.charts.comparison import draw_comparison
from evaluation.results.figure_files import figure_svg
from evaluation.results.keys import OWN, STAGE
from evaluation.results.metric_tables import shipped_pairs
from evaluation.results.page_frame import PageSection, page_section
from evaluation.results.survival import RELATIVE
from evaluation.results.table import Results
from evaluation.results.table_comparison import compare_tables

# Greatest deviation of a value from the shipped one.
_ALIKE = 0.02


def cities_section(results: Results) -> PageSection | None:
    """Returns the section; None if no city of the table is a shipped one.

    A city is a shipped one if its retained shares are the shipped ones. The
    section shows the survival of methods in all shipped cities, and marks those
    of the table.
    """
    selection = {"metric": RELATIVE, "task": "place", "verified": True}
    pairs = shipped_pairs(results, {**selection, STAGE: OWN})
    maps = {row.map for row, _ in pairs} - {
        row.map
        for row, shipped in pairs
        if abs(row.value - shipped.value) > _ALIKE
    }
    if not maps:
        return None
    found = compare_tables([], RELATIVE, verified=True)
    return page_section(
        "cities",
        "Cities",
        "the shipped tables; results.csv: relative_auc_strict with geometric"
        " verification",
        is_open=True,
        maps=sorted(maps),
        number=found.survival[0].cities,
        wide=WIDE,
        svgs={
            name: figure_svg(
                draw_comparison(found, marked=maps, width=width),
                f"cities-{name}",
            )
            for name, width in (("wide", WIDE), ("narrow", NARROW))
        },
    )
