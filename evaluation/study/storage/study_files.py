"""Where the files of a study are in its folder."""

from dataclasses import dataclass
import hashlib
from pathlib import Path

from evaluation.study.storage.parts import Part

# Some file systems allow 255; this leaves room for endings and joined names.
_LONGEST_NAME_BYTES = 120
# Number of characters at the beginning of a longer name that are kept.
_KEPT_CHARACTERS = 20


@dataclass(frozen=True)
class FeatureFiles:
    """The files (`Part`) with all that a study needs of a recording.

    The files contain the drive's poses and map, the scans at places and
    queries, and, in one file for each method, the descriptors of these scans.

    Attributes:
        folder: folder of the files.
    """

    folder: Path

    @property
    def drive(self) -> Part:
        """The file with the drive's poses and map, a `DriveSummary`."""
        return Part(self.folder / "drive.data")

    @property
    def fine(self) -> Part:
        """The file with the cloud for pictures, an array (K, 3)."""
        return Part(self.folder / "fine.data")

    @property
    def scans(self) -> Part:
        """The file with the drive's scans at places and queries.

        For a drive with a map, the file contains a `KeptScans`; otherwise a
        list of scans (N, 3).
        """
        return Part(self.folder / "scans.data")

    def described(self, key: str) -> Part:
        """Returns the file with a method's descriptors of the drive.

        The file contains a `DriveNames` and a `DriveDescriptors`.

        Args:
            key: `MethodChoice.key` of the method; for descriptors by a second
                protocol, the result of
                `evaluation.study.features.described_key`.
        """
        return Part(self.folder / f"described_{file_name(key)}.data")

    def remove_descriptors(self) -> None:
        """Removes all descriptors; call it when the results exist.

        Descriptors take three quarters of the space; see `Part.remove_value`.

        Raises:
            InputError: a file cannot be written.
        """
        for path in sorted(self.folder.glob("described_*.data")):
            Part(path).remove_value()


@dataclass(frozen=True)
class StudyFiles:
    """The paths of all files of a study.

    Attributes:
        output: folder of the study.
    """

    output: Path

    @property
    def figures(self) -> Path:
        """The folder of all figures."""
        return self.output / "figures"

    def features(self, recording: str) -> FeatureFiles:
        """Returns the files with a recording's map and descriptors."""
        folder = self.output / "parts" / "features"
        return FeatureFiles(folder / file_name(recording))

    def part(self, kind: str, *names: str) -> Part:
        """Returns the file of an intermediate result.

        Args:
            kind: kind of result, such as `changes`; the name of a folder.
            names: names of the drives to which the result belongs.
        """
        name = ",".join(map(file_name, names))
        return Part(self.output / "parts" / kind / f"{name}.data")


def file_name(text: str) -> str:
    """Turns a text into a file name that cannot lead to another folder.

    Use this function for the names of the drive, map and stage in a recording
    before these names become parts of paths. Usual names stay unchanged. In
    unusual names, unsafe characters are replaced such that different names stay
    different.
    """
    name = "".join(
        c if c.isalnum() or c in "_-+ " or (c == "." and k) else _escaped(c)
        for k, c in enumerate(text)
    )
    if not name or len(name.encode()) > _LONGEST_NAME_BYTES:
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass"))
        # An escaped character never has a tilde behind its percent sign.
        name = f"{name[:_KEPT_CHARACTERS]}%~{digest.hexdigest()[:32]}"
    return name


def _escaped(character: str) -> str:
    octets = character.encode("utf-8", "surrogatepass")
    return "".join(f"%{octet:02X}" for octet in octets)
