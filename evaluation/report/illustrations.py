"""A figure of a report, and where the page shows it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from evaluation.results.styles import Legend, MethodStyle

Section = Literal["survival", "change", "recognition", "figures", "print"]


@dataclass(frozen=True)
class Illustration:
    """A figure of the report.

    Attributes:
        stem: path of the figure without ending.
        title: title of the figure.
        page_kind: format of the figure on the page, "svg" or "webp".
        section: section of the page that shows the figure; "print" for a figure
            that the page does not show.
        num_panels: number of panels side by side; a phone shows one at a time.
        legend: colours, each as values of red, green and blue, with their
            meanings. The page shows these colours below the figure.
        methods: name of a method -> its style in the figure. The page shows the
            methods' markers below the figure.
    """

    stem: Path
    title: str
    page_kind: str
    section: Section = "figures"
    num_panels: int = 1
    legend: Legend = ()
    methods: Mapping[str, MethodStyle] = field(default_factory=dict)
