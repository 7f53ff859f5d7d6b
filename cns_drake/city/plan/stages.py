"""Stages of a city: which structures each one still lacks."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from evaluation.support.errors import InputError, describe_validation_error
from evaluation.support.yaml_files import read_yaml

StageName = Annotated[str, Field(pattern=r"^\d\d$")]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Stage(_Model):
    """One stage, told in words and by what it lacks.

    Attributes:
        story: what a visitor of this stage would notice.
        absent: story item -> names of the structures that the next stage
            adds. What later stages add is absent as well.
    """

    story: str
    absent: dict[str, list[str]] = Field(default_factory=dict)


class Stages(_Model):
    """The stages of a city, from `stages.yaml`.

    Every stage has all structures of the stage before it, because each one
    lists only what the next stage adds; the last stage is the whole city.

    Attributes:
        stages: stage name -> stage, earliest first.
        candidates: further structures that the stories would allow to be
            absent from the first stage, the next one to take away first.
    """

    stages: dict[StageName, Stage]
    candidates: list[str] = Field(default_factory=list)

    def absent(self, stage: str) -> set[str]:
        """Returns the names of all structures that a stage lacks.

        Raises:
            KeyError: if there is no such stage.
        """
        names = list(self.stages)
        if stage not in self.stages:
            raise KeyError(stage)
        return {
            name
            for later in names[names.index(stage) :]
            for group in self.stages[later].absent.values()
            for name in group
        }


def load_stages(path: Path, structures: Collection[str]) -> Stages:
    """Reads `stages.yaml` and checks it against the city.

    Args:
        path: the file.
        structures: the names of all structures of the city.

    Raises:
        InputError: if the file cannot be read, has a wrong key or type, its
            stages are out of order, the last one lacks something, or a name
            is unknown or listed twice.
    """
    content = read_yaml(path)
    try:
        stages = Stages.model_validate(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from error
    _check(stages, path, set(structures))
    return stages


def _check(stages: Stages, path: Path, structures: set[str]) -> None:
    names = list(stages.stages)
    if not names:
        raise InputError(f"{path}: stages: at least one stage is needed")
    if names != sorted(names):
        raise InputError(f"{path}: stages: must be in rising order")
    if stages.stages[names[-1]].absent:
        raise InputError(
            f"{path}: stages.{names[-1]}.absent: the last stage is the whole "
            "city and lacks nothing"
        )
    seen: dict[str, str] = {}
    lists = [
        (f"stages.{stage}.absent.{item}", group)
        for stage in names
        for item, group in stages.stages[stage].absent.items()
    ]
    for field, group in [*lists, ("candidates", stages.candidates)]:
        for name in group:
            if name not in structures:
                raise InputError(f"{path}: {field}: unknown structure {name}")
            if name in seen:
                raise InputError(
                    f"{path}: {field}: {name} is already in {seen[name]}"
                )
            seen[name] = field
