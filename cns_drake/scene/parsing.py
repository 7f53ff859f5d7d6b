"""Parses worlds and models with Drake, and reports faults in one line."""

from collections.abc import Collection, Iterator
import contextlib
from pathlib import Path
import re

from pydrake.multibody.parsing import Parser
from pydrake.multibody.tree import ModelInstanceIndex

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.base.progress import doing
from cns_drake.scene.drake_errors import PARSER_ERRORS, collected_errors
from cns_drake.scene.gazebo_worlds import is_gazebo_world, simplify_world
from cns_drake.scene.model_check import check_model, read_model


def parse_world(
    parser: Parser, path: Path, model_paths: Collection[Path]
) -> tuple[str, ...]:
    """Parses a world, which may have been made for Gazebo.

    Args:
        parser: parser to which the models of the world are added.
        path: SDF or URDF file of the world.
        model_paths: folders in which `model://` is searched first.

    Returns:
        Notes about omitted parts.

    Raises:
        InputError: the file is missing, cannot be parsed, or has no models.
    """
    if path.suffix.lower() == ".urdf":
        parse_models(parser, path)
        return ()
    _check_text(path)
    root = read_model(path)
    if not is_gazebo_world(path, root):
        _add_checked_models(parser, path)
        return ()
    text, notes = simplify_world(path, root, model_paths)
    doing(f"parsing {path.name}")
    with _drake_errors(path):
        parser.AddModelsFromString(text, "sdf")
    return notes


def parse_models(parser: Parser, path: Path) -> list[ModelInstanceIndex]:
    """Checks and parses a file, and returns its models.

    Raises:
        InputError: the file is missing, cannot be parsed, or has no models.
    """
    _check_text(path)
    check_model(path)
    return _add_checked_models(parser, path)


def _add_checked_models(parser: Parser, path: Path) -> list[ModelInstanceIndex]:
    """Parses a file that was checked, and returns its models."""
    doing(f"parsing {path.name}")
    with _drake_errors(path):
        models = parser.AddModels(str(path))
    if not models:
        raise InputError(f"{path}: holds no model")
    return models


@contextlib.contextmanager
def _drake_errors(path: Path) -> Iterator[None]:
    """Raises Drake's errors about a file as an InputError."""
    with collected_errors() as errors:
        try:
            yield
        except PARSER_ERRORS as error:
            raise _parse_error(path, str(error), *errors) from error
        if errors:
            raise _parse_error(path, *errors)


def _check_text(path: Path) -> None:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    # Drake would fail when it quotes other text.
    content = read_bytes(path)
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: not UTF-8 text") from None


def _parse_error(path: Path, *texts: str) -> InputError:
    """Returns an error that contains the first two of Drake's messages."""
    # Messages of Drake and libsdformat begin with the path, which Drake makes
    # absolute, a severity and a code.
    names = "|".join(re.escape(str(p)) for p in (path.absolute(), path))
    faults = [" ".join(text.split()) for text in texts[:2]]
    faults = [re.sub(r"^SDFormat Error .*?Msg: ", "", f) for f in faults]
    faults = [
        re.sub(
            rf"/*(?:{names}):(?:(\d+):)? (?:error|ERROR): (?:ERROR: )?",
            lambda match: f"line {match[1]}: " if match[1] else "",
            fault,
        )
        for fault in faults
    ]
    return InputError(f"{path}: cannot be parsed: {': '.join(faults)}")
