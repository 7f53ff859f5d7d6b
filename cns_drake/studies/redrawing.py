"""Redraws a map's city: the same streets, another draw of all the rest.

Roads and plan stay, and only the plan's seed changes: buildings, plants, cars
and furniture are drawn anew. Each such city is a map folder.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import os
from pathlib import Path

import yaml

from cns_drake.base import files
from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.fingerprint import code_digest
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.base.map_folder import STAGES_NAME, MapFolder
from cns_drake.base.version import __version__
from cns_drake.base.yaml_files import read_yaml
from cns_drake.city.generation.generate import generate_city
from cns_drake.city.plan.city_plan import load_plan
from evaluation.study.parts import Part

# The first line of each input that is written here.
_MARK = b"# Of a city drawn anew by cns-drake"
# The file in its folder with the fingerprint of a city.
_PART = "drawn.data"


def redraw_cities(
    map_folder: Path,
    stage: str,
    seeds: Sequence[int],
    output: Path,
    cluster: Cluster,
) -> dict[int, Path]:
    """Draws the city of a map anew, with progress on stderr.

    An existing city of the same inputs and program is kept.

    Args:
        map_folder: the map, with `roads.yaml` and `city.yaml`.

    Returns:
        Seed -> map folder of that city, `<output>/<map>_c<seed>`, absolute.

    Raises:
        InputError: the map cannot be used, another file or folder has the name
            of a city, or some could not be drawn; all are named.
    """
    map_folder, output = map_folder.resolve(), output.resolve()
    folders = {seed: output / f"{map_folder.name}_c{seed}" for seed in seeds}
    # Quick checks come before all slow work.
    load_plan(MapFolder(map_folder).plan)
    for folder in folders.values():
        _is_replaced(folder)
    files.make_folder(output)
    jobs = [
        Job(
            name=f"city {folder.name}",
            step=RedrawCity(map_folder, stage, seed, folder),
        )
        for seed, folder in folders.items()
    ]
    run_jobs(jobs, cluster)
    return folders


@dataclass(frozen=True)
class RedrawCity(Step):
    """Draws the city of a map anew.

    Attributes:
        stage: name of the only stage, the whole city.
        folder: the map folder to write; an older redrawn city of this name is
            replaced, anything else is refused.
    """

    map_folder: Path
    stage: str
    seed: int
    folder: Path

    @property
    def output(self) -> Path:
        return self.folder

    def is_done(self) -> bool:
        # A folder that has its final name is complete.
        return Part(self.folder / _PART).is_current(self.sources())

    def run(self, reporter: Reporter) -> None:
        folder, made_of = self.folder, self.sources()
        with files.draft_folder(folder, replaces=True) as draft:
            for name, content in self.inputs().items():
                (draft / name).write_bytes(content)
            try:
                self.finish_inputs(draft)
                generate_city(draft)
            except InputError as error:
                fault = str(error).removeprefix(f"{draft}{os.sep}")
                raise InputError(
                    f"{self.map_folder}: seed {self.seed}: {fault}"
                ) from error
            Part(draft / _PART).write(made_of, None)
            if _is_replaced(folder):
                reporter.note(
                    f"{folder}: replaced, since its inputs have changed"
                )

    def inputs(self) -> dict[str, bytes]:
        """Returns name -> content of the inputs of the city."""
        return redrawn_inputs(self.map_folder, self.stage, self.seed)

    def finish_inputs(self, draft: Path) -> None:
        """Writes inputs that depend on the city itself."""

    def sources(self) -> dict[str, object]:
        """Returns all that the city depends on, ready for JSON."""
        return {
            **{
                name: content.decode()
                for name, content in self.inputs().items()
            },
            "code": code_digest("cns_drake.city.*"),
        }


def redrawn_inputs(map_folder: Path, stage: str, seed: int) -> dict[str, bytes]:
    """Returns the inputs of a map's city drawn anew.

    Args:
        stage: name of the only stage, the whole city. The map's own
            stages name structures that another draw need not have.

    Returns:
        Name -> content of `roads.yaml`, which is the map's own, `city.yaml`
        and `stages.yaml`.

    Raises:
        InputError: a file of the map cannot be read, or is no plan.
    """
    source = MapFolder(map_folder)
    roads, plan = source.roads, source.plan
    load_plan(plan)
    with files.user_errors(roads):
        network = roads.read_bytes()
    stages = {stage: {"story": f"The whole city, as seed {seed} draws it."}}
    return {
        roads.name: network,
        plan.name: to_yaml(
            "the map's plan with another seed", read_yaml(plan) | {"seed": seed}
        ),
        STAGES_NAME: to_yaml("its only stage", {"stages": stages}),
    }


def to_yaml(title: str, values: dict) -> bytes:
    """Returns an input of a redrawn city, with its mark and a title."""
    comment = (
        f"{_MARK.decode()} {__version__}: {title}.\n"
        "# `cns-drake generate --vary` writes it anew when the map changes.\n"
    )
    text = yaml.safe_dump(
        values, sort_keys=False, default_flow_style=None, width=79
    )
    return f"{comment}\n{text}".encode()


def _is_replaced(folder: Path) -> bool:
    """Returns whether an older redrawn city has this name."""
    plan = MapFolder(folder).plan
    with files.user_errors(folder):
        if not os.path.lexists(folder):
            return False
        if not (plan.is_file() and plan.read_bytes().startswith(_MARK)):
            raise InputError(
                f"{folder}: this folder is there already and is not a redrawn "
                "city; remove it or give another output"
            )
    return True
