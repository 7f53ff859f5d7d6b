"""Maps that an experiment makes: aged or imported."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import hashlib
from pathlib import Path

from cns_drake.scenarios import AgeCity, MakeMap, digest_file
from evaluation.base import InputError, Reporter, read_bytes
from evaluation.study import Experiment, MadeMap
from worlds.ageing import DEFAULT_RATES
from worlds.imports import ImportOptions, import_city, map_sources
from worlds.maps import MapFolder


@dataclass(frozen=True)
class ImportCity(MakeMap):
    """A job step that makes a map from the file of a real city.

    Attributes:
        source: the file.
        options: options of the import.
    """

    source: Path
    options: ImportOptions

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        import_city(
            self.source,
            self.folder,
            self.options,
            lambda draft, _: finish(draft),
        )

    def sources(self) -> dict[str, object]:
        return {
            "file": digest_file(self.source),
            "options": repr(self.options),
        }


def made_map_step(
    made: MadeMap, experiment: Experiment, folder: Path, shipped: Mapping
) -> MakeMap:
    """Returns the job step that makes a map described by an experiment.

    Args:
        made: description of the map.
        experiment: the experiment.
        folder: folder of the map to make.
        shipped: name -> folder of the shipped maps.

    Raises:
        InputError: the file to import is missing or has another digest, or the
            map to age does not exist.
    """
    if made.age is not None:
        assert made.years is not None
        path = Path(shipped.get(made.age, made.age))
        if not MapFolder(path).recordable_drives():
            raise InputError(f"{made.name}: no map {made.age!r} with drives")
        rates = tuple(sorted(DEFAULT_RATES.items()))
        return AgeCity(folder, path.resolve(), (made.years,), made.seed, rates)
    assert made.import_file is not None
    path = Path(experiment.files or ".") / made.import_file
    if not path.is_file():
        raise InputError(
            f"{path}: no such file; --set files=FOLDER names the folder of the"
            " cities to import (docs/map_update.md says where they are from)"
        )
    if made.sha256 is not None:
        digest = hashlib.sha256(read_bytes(path)).hexdigest()
        if digest != made.sha256:
            raise InputError(f"{path}: not the file of {made.name}: its sha256")
    for source in map_sources() if made.grow is not None else ():
        if path.suffix in source.suffixes and source.has_stages:
            raise InputError(
                f"{experiment.name}: maps: {made.name}.grow: a map from"
                f" {source.title} has two stages anyway; leave it out"
            )
    options = ImportOptions(
        seed=made.seed, grow=made.grow, dressed=not made.plain
    )
    return ImportCity(folder, path.resolve(), options)
