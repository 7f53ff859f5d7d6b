"""The stages of a city: how each one differs from the whole city."""

from collections.abc import Collection, Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from evaluation.base import (
    InputError,
    InputModel,
    parse_yaml,
    read_yaml,
    validated,
)

LotUse = Literal["car_park", "market", "garden", "yard", "empty"]
StageName = Annotated[str, Field(pattern=r"^\d\d$")]


class _Model(InputModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Growth(_Model):
    """Structures that are not yet as high as in the next stage.

    Attributes:
        height: height of these structures at this stage, measured from the
            ground below them [m].
        structures: names of the structures, as in `structures.csv`. `*` stands
            for any text and `?` for any one character.
        but: names of exceptions to `structures`.
    """

    height: float = Field(gt=2.0, allow_inf_nan=False)
    structures: list[str] = Field(min_length=1)
    but: list[str] = Field(default_factory=list)


class Stage(_Model):
    """One stage: its story, and how it differs from the next stage.

    Attributes:
        story: text that says which changes a visitor would see until the next
            stage.
        absent: structures that the next stage has and this one lacks: lists of
            names, under headings of your choice. Not in the last stage.
        lower: groups of buildings and plants that are lower than in the next
            stage, in the same way.
        sites: groups of buildings that are under construction in this stage
            only, in the same way: a frame of the given height, with scaffolds
            and a crane. The lot must measure at least 16 m by 16 m.
    """

    story: str
    absent: dict[str, list[str]] = Field(default_factory=dict)
    lower: dict[str, Growth] = Field(default_factory=dict)
    sites: dict[str, Growth] = Field(default_factory=dict)


class Stages(_Model):
    """The file `stages.yaml`: how the city looked in each stage.

    The last stage is the whole city, and each earlier one lists how it differs
    from the next. Temporary objects, such as a market on an empty lot, are
    removed when the lot is built on; all other structures stay.

    Attributes:
        stages: stages by number, in ascending order. A number has two digits in
            quotes, such as `"01"`.
        lots: how lots are used before their buildings exist. For each use
            (`car_park`, `market`, `garden`, `yard` or `empty`), list the
            buildings whose lots have this use. By default the use of a lot
            depends on the lot's size.
    """

    stages: dict[StageName, Stage]
    lots: dict[LotUse, list[str]] = Field(default_factory=dict)

    def absent(self, stage: str) -> set[str]:
        """Returns the names of all structures that do not exist in a stage.

        Raises:
            KeyError: if there is no such stage.
        """
        return {
            name
            for later in self._onwards(stage)
            for group in later.absent.values()
            for name in group
        }

    def heights(self, stage: str) -> dict[str, float]:
        """Returns the height [m] of each structure that still has to grow.

        The result maps names to heights in the stage `stage`. It can contain
        structures that do not exist yet in this stage; see `absent`.

        Raises:
            KeyError: if there is no such stage.
        """
        heights: dict[str, float] = {}
        for later in self._onwards(stage):
            for group in later.lower.values():
                for name in group.structures:
                    known = heights.get(name, group.height)
                    heights[name] = min(known, group.height)
        return heights

    def sites(self, stage: str) -> dict[str, float]:
        """Returns the height [m] of each building under construction, by name.

        Raises:
            KeyError: if there is no such stage.
        """
        return {
            name: group.height
            for group in self.stages[stage].sites.values()
            for name in group.structures
        }

    def _onwards(self, stage: str) -> list[Stage]:
        """Returns a stage and all later stages."""
        names = list(self.stages)
        if stage not in self.stages:
            raise KeyError(stage)
        return [self.stages[name] for name in names[names.index(stage) :]]


def load_stages(
    path: Path, structures: Collection[str], text: str | None = None
) -> Stages:
    """Reads `stages.yaml`, and checks it against the city's structures.

    In the result, each pattern is replaced by the names that it matches.

    Args:
        path: the file.
        structures: names of all structures of the city.
        text: text to read instead of the content of the file; None to read the
            file.

    Raises:
        InputError: if the file cannot be read or has a wrong key or type; if
            the stages are out of order; if the last stage is not the whole
            city; if a name is unknown, or listed as absent more than once; or
            if a pattern matches nothing.
    """
    content = read_yaml(path) if text is None else parse_yaml(text)
    stages = validated(Stages, content, path)
    _check_order_and_last(stages, path)
    stages = _resolved(stages, _Names(path, structures))
    _check_absent_once(stages, path)
    return stages


class _Names:
    """The names of a city's structures, to which patterns are resolved."""

    def __init__(self, path: Path, structures: Iterable[str]):
        self._path = path
        self._all = list(structures)
        self._known = set(self._all)

    def of(self, field: str, patterns: Iterable[str]) -> list[str]:
        """Returns the names of the structures that patterns match.

        Names are in the order of the patterns and, for one pattern, in the
        order of the city's structures. A pattern can be a name. `field` is the
        field of `stages.yaml` with the patterns, for error messages.
        """
        found: list[str] = []
        for pattern in patterns:
            names = [pattern]
            if "*" in pattern or "?" in pattern:
                names = [n for n in self._all if fnmatchcase(n, pattern)]
            if not names or not self._known.issuperset(names):
                raise InputError(
                    f"{self._path}: {field}: unknown structure {pattern}"
                )
            found += names
        return found


def _resolved(stages: Stages, names: _Names) -> Stages:
    def growth(field: str, groups: Mapping[str, Growth]) -> dict[str, Growth]:
        result = {}
        for item, group in groups.items():
            where = f"{field}.{item}"
            but = set(names.of(f"{where}.but", group.but))
            meant = names.of(f"{where}.structures", group.structures)
            kept = [name for name in meant if name not in but]
            result[item] = Growth(height=group.height, structures=kept)
        return result

    resolved = {
        stage: Stage(
            story=plan.story,
            absent={
                item: names.of(f"stages.{stage}.absent.{item}", group)
                for item, group in plan.absent.items()
            },
            lower=growth(f"stages.{stage}.lower", plan.lower),
            sites=growth(f"stages.{stage}.sites", plan.sites),
        )
        for stage, plan in stages.stages.items()
    }
    return Stages(
        stages=resolved,
        lots={u: names.of(f"lots.{u}", p) for u, p in stages.lots.items()},
    )


def _check_order_and_last(stages: Stages, path: Path) -> None:
    names = list(stages.stages)
    if not names:
        raise InputError(f"{path}: stages: at least one stage is needed")
    if names != sorted(names):
        raise InputError(f"{path}: stages: must be in rising order")
    last = stages.stages[names[-1]]
    for field in ("absent", "lower", "sites"):
        if getattr(last, field):
            raise InputError(
                f"{path}: stages.{names[-1]}.{field}: the last stage is the "
                "whole city and lacks nothing"
            )


def _check_absent_once(stages: Stages, path: Path) -> None:
    seen: dict[str, str] = {}
    lists = [
        (f"stages.{stage}.absent.{item}", group)
        for stage, plan in stages.stages.items()
        for item, group in plan.absent.items()
    ]
    for field, group in lists:
        for name in group:
            if name in seen:
                raise InputError(
                    f"{path}: {field}: {name} is already in {seen[name]}"
                )
            seen[name] = field
