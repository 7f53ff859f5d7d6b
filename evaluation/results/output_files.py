"""What the programs write to a folder of results: one list for all commands.

A wall between our files and the user's. A file is of an earlier run only if it
is in the list and the witness of its group was written by a run. Other files
are never removed or overwritten.
"""

from collections.abc import Iterable
import os
from pathlib import Path
import re
from typing import NamedTuple

from evaluation.base import (
    InputError,
    check_writable,
    errors_at,
    make_folder,
    scratch_folder,
    user_errors,
)
from evaluation.results.table import QUERIES, RESULTS, QueryRows, Results


class _Group(NamedTuple):
    """Files that a run writes together.

    Attributes:
        names: pattern of their names.
        witness: name of the file that shows that a run wrote the group.
        mark: pattern in the content of the witness.
    """

    names: re.Pattern[str]
    witness: str
    mark: re.Pattern[bytes]


_GROUPS = {
    "tables": _Group(
        re.compile(f"{re.escape(RESULTS)}|{re.escape(QUERIES)}"),
        RESULTS,
        re.compile(rb"\A[^\n]*\bmethod,[^\n]*\bmetric,value\b"),
    ),
    "page": _Group(
        re.compile(
            r"index\.html|summaries\.csv|(chart_\d+|beside)\.(pdf|png|svg)"
        ),
        "index.html",
        re.compile(rb"Made by cns-drake "),
    ),
    "localise": _Group(
        re.compile(r"localisation\.csv|track\.png"),
        "localisation.csv",
        re.compile(rb"\A[^\n]*\bstamp_ns,[^\n]*\btranslation_error,"),
    ),
    "map-update": _Group(
        re.compile(r"[AB]\.npy"),
        RESULTS,
        re.compile(rb"^map-update,", re.MULTILINE),
    ),
}


def make_output(folder: Path, writes: Iterable[str] = ()) -> None:
    """Makes a folder for results, unless it is there; checks what it contains.

    The arguments are the same as for `check_output`.

    Raises:
        InputError: the folder cannot be made, or is refused by `check_output`.
    """
    check_output(folder, writes)
    make_folder(folder)


def check_output(folder: Path, writes: Iterable[str] = ()) -> None:
    """Checks before a long run what stands in the way of its files.

    Args:
        folder: the folder, which need not exist. Nothing is made.
        writes: groups of files that the run writes besides its tables, such as
            `page`.

    Raises:
        InputError: the folder is no folder, or contains a file that the run
            would overwrite, and that no earlier run wrote; or a folder, link,
            device or pipe has the name of such a file.
    """
    if not os.path.lexists(folder):
        return
    if not folder.is_dir():
        raise InputError(f"{folder}: not a folder")
    is_of_a_run = _is_of_a_run(folder, _GROUPS["tables"])
    for group in (_GROUPS[name] for name in ("tables", *writes)):
        found = _found(folder, group)
        for path in found:
            check_writable(path)
        if is_of_a_run:
            # A run that was interrupted had not written the witness.
            found = [one for one in found if one.name == group.witness]
        if found and not _is_of_a_run(folder, group):
            raise InputError(
                f"{found[0]}: no earlier run wrote it; give another folder for"
                " the results"
            )


def remove_earlier(folder: Path) -> None:
    """Removes what an earlier run wrote, so that it is not beside new results.

    Files of jobs, such as `parts`, stay: new results may need them.

    Raises:
        InputError: a file cannot be read or removed.
    """
    earlier = [
        path
        for group in _GROUPS.values()
        if _is_of_a_run(folder, group)
        for path in _found(folder, group)
        if path.is_file() and not path.is_symlink()
    ]
    for path in earlier:
        with user_errors(path):
            path.unlink()


def write_tables(folder: Path, results: Results, queries: QueryRows) -> None:
    """Writes both tables to a folder, in place of those of an earlier run.

    Raises:
        InputError: a file cannot be written or removed.
    """
    tables: dict[str, Results | QueryRows] = {
        RESULTS: results,
        QUERIES: queries,
    }
    # Both are whole before either gets its name.
    with scratch_folder(folder / RESULTS) as scratch:
        for name, table in tables.items():
            with errors_at(folder / name, f"{scratch / name}: "):
                table.write_csv(scratch / name)
        remove_earlier(folder)
        for name in tables:
            with user_errors(folder / name):
                os.replace(scratch / name, folder / name)


def _found(folder: Path, group: _Group) -> list[Path]:
    with user_errors(folder):
        return sorted(
            path
            for path in folder.iterdir()
            if group.names.fullmatch(path.name)
        )


def _is_of_a_run(folder: Path, group: _Group) -> bool:
    witness = folder / group.witness
    if witness.is_symlink() or not witness.is_file():
        return False
    with user_errors(witness):
        return bool(group.mark.search(witness.read_bytes()))
