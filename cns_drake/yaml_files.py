"""Reading YAML files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cns_drake.errors import InputError
from cns_drake.files import user_errors
from evaluation.yaml_text import parse_yaml


def read_yaml(path: Path) -> Any:
    """Returns what a YAML file holds; None if it is empty.

    Raises:
        InputError: the file cannot be read, is not YAML, stands for more
            than it should or has a key twice.
    """
    with user_errors(path):
        text = path.read_bytes()
    try:
        return parse_yaml(text)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
