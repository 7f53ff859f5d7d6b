"""Exports one drive into a folder of drives.

The folder can contain several drives of one format. The file `export.yaml` in
this folder lists the exported files, and shows that an export wrote the folder.
The subfolder of a drive is written under a temporary name, and gets its final
name when it is complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import contextlib
import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from cns_drake.export.formats import ENDING, export_formats
from cns_drake.export.layout import Layout, structure_files
from cns_drake.recording import to_yaml
from evaluation.base import (
    InputError,
    check_folder_writable,
    draft_folder,
    make_folder,
    read_yaml,
    track,
    user_errors,
    value_errors,
    write_text,
)
from evaluation.drives import Drive, deskewed_notes, deskewed_scan

if TYPE_CHECKING:
    from cns_drake.export.absence import Absence

# File that shows that an export wrote a folder, and its field with the writer.
_MARKER = "export.yaml"
_WRITER = {"writer": "cns-drake export"}


def _layout(format_name: str) -> Layout:
    module = importlib.import_module(f"{__package__}.{format_name}{ENDING}")
    return module.LAYOUT


def _formats_with(name: str) -> str:
    """Returns the formats whose layout has something, for error messages."""
    return " or ".join(n for n in export_formats() if getattr(_layout(n), name))


def export_drive(
    drive: Drive,
    format_name: str,
    output: Path,
    *,
    absent_in: str | None = None,
    sequence: int | None = None,
    on_note: Callable[[str], None] = lambda note: None,
) -> Path:
    """Exports a drive, and returns its folder.

    Args:
        drive: the drive.
        format_name: name of the format, see `export_formats`.
        output: the folder of drives: a new or empty folder, or a folder to
            which this function has already written drives of the same format.
        absent_in: another stage of the drive's map. Points on structures that
            are absent in this other stage get SemanticKITTI's labels of moving
            objects (see `cns_drake.export.absence.Absence`). None keeps the
            recorded labels.
        sequence: number of the drive in KITTI's layout; by default the digits
            at the end of the drive's name.
        on_note: called with notes about how the drive was read and written.

    Raises:
        InputError: if the drive cannot be read; if the folder contains
            anything but exports of this format, or already contains this drive;
            if the files cannot be written; or if `absent_in` is given and
            labels are not possible.
    """
    layout = _layout(format_name)
    if absent_in is not None and not layout.has_labels:
        raise InputError(
            f"--absent-in: {format_name} has no labels; use"
            f" {_formats_with('has_labels')}"
        )
    if sequence is not None:
        if layout.numbered is None:
            raise InputError(
                f"--sequence: {format_name} has no numbers; use"
                f" {_formats_with('numbered')}"
            )
        layout = layout.numbered(f"{sequence:02d}")
    if not len(drive):
        raise InputError(f"{drive.name}: has no scans")
    absence = None
    if absent_in is not None:
        # Loading Drake takes a while, and only marks need it.
        from cns_drake.export.absence import Absence

        absence = Absence(drive, absent_in)
    folder = output / layout.drive_folder(drive)
    outer = {
        output / name: text for name, text in layout.outer_files(drive).items()
    }
    claim_folder(output, format_name, layout.explained)
    if folder.exists():
        another = "folder or --sequence" if layout.numbered else "folder"
        raise InputError(
            f"{folder}: a drive is there already; remove it or give another"
            f" {another}"
        )
    if layout.shared_outer_files:
        _check_shared_files(outer)
    with contextlib.ExitStack() as stack:
        stack.callback(_remove_empty, folder.parent, output)
        draft = stack.enter_context(draft_folder(folder))
        for note in _notes(drive, layout):
            on_note(note)
        with user_errors(folder):
            _write_drive(drive, layout, draft, absence)
        for path, text in outer.items():
            make_folder(path.parent)
            write_text(path, text)
    return folder


def _remove_empty(folder: Path, output: Path) -> None:
    """Removes the folders of an export that has written nothing.

    Args:
        folder: the folder of the drive's folder, in `output` or equal to it.
        output: the folder of drives. Only its marker is no drive.
    """
    with contextlib.suppress(OSError):
        while folder != output:
            folder.rmdir()
            folder = folder.parent
        if [path.name for path in output.iterdir()] == [_MARKER]:
            (output / _MARKER).unlink()
            output.rmdir()


def _check_shared_files(texts: Mapping[Path, str]) -> None:
    """Checks that existing files of all drives have the given texts."""
    for path, text in texts.items():
        with user_errors(path):
            is_other = path.is_file() and path.read_bytes() != text.encode()
        if is_other:
            raise InputError(
                f"{path}: differs: the drives there have another sensor mount;"
                " give another folder"
            )


def _notes(drive: Drive, layout: Layout) -> Iterator[str]:
    """Yields notes about how a drive is read and written."""
    yield from layout.notes(drive)
    if layout.scan_files is None:
        return
    yield from deskewed_notes(drive)
    if "intensity" not in (drive.scan(0).dtype.names or ()):
        yield f"{drive.name}: points have no intensity; it is written as 0"


def claim_folder(
    output: Path, format_name: str, explained: Mapping[str, str]
) -> None:
    """Makes a folder of exports, or checks that an export has written it.

    Args:
        output: the folder.
        format_name: name of the format. All exports in a folder have the same
            format.
        explained: path -> content of each file, for readers of `export.yaml`.

    Raises:
        InputError: the folder contains anything but exports of this format, or
            cannot be written.
    """
    marker = output / _MARKER
    with user_errors(output):
        if marker.is_file():
            values = read_yaml(marker)
            if not isinstance(values, dict) or not _WRITER.items() <= (
                values.items()
            ):
                raise InputError(
                    f"{marker}: not written by an export of cns-drake; give "
                    "another folder"
                )
            found = values.get("format")
            if found != format_name:
                raise InputError(
                    f"{marker}: format: the folder holds exports of the format"
                    f" {found}; give another folder"
                )
            check_folder_writable(output)
            return
        if output.exists() and not output.is_dir():
            raise InputError(f"{output}: not a folder")
        if output.exists() and any(output.iterdir()):
            raise InputError(
                f"{output}: the folder holds other files; give a new or an "
                "empty one"
            )
    make_folder(output)
    values = {**_WRITER, "format": format_name, "files": dict(explained)}
    write_text(marker, to_yaml(values))


def _write_drive(
    drive: Drive, layout: Layout, folder: Path, absence: Absence | None
) -> None:
    files = layout.inner_files(drive)
    if layout.has_labels:
        files |= structure_files((absence or drive).instances)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    if layout.scan_files is None:
        return
    stamps_ns = drive.stamps_ns.tolist()
    for frame, stamp_ns in enumerate(
        track(stamps_ns, "writing scans", len(stamps_ns), "scans")
    ):
        scan = deskewed_scan(drive, frame)
        if absence is not None:
            scan = absence.marked(scan, frame)
        with value_errors(f"{drive.name}: scan {frame}"):
            made = layout.scan_files(drive, frame, stamp_ns, scan)
        for name, content in made.items():
            path = folder / name
            if frame == 0:
                path.parent.mkdir()
            path.write_bytes(content)
