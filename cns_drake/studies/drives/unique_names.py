"""Names of changed drives: each is unique, and says what has changed."""

import re

from cns_drake.base import fingerprint
from cns_drake.scenarios import Scenario
from cns_drake.studies.drives.control_drives import control_drive
from cns_drake.studies.experiments.nested_fields import Changes
from evaluation.results import CAUSE, LEVEL, NO_CAUSE


class UniqueNames:
    """The names of the drives of a database, or of the query drives.

    Equal drives have one name, however they came about.
    """

    def __init__(
        self, side: str, unchanged: Scenario, *, with_controls: bool
    ) -> None:
        """Begins without any changed drive.

        Args:
            side: `database` or `query`.
            unchanged: the drive without any change, which keeps its name.
            with_controls: whether a drive of which only the stage has changed
                is a control drive.
        """
        self._side = side
        self._unchanged = unchanged
        self._with_controls = with_controls
        # Content of a drive -> the drive with its name.
        self._known: dict[str, Scenario] = {}

    def named(self, drive: Scenario, factors: Changes, seed: int) -> Scenario:
        """Returns a drive with a name that no other drive of this side has.

        Args:
            drive: the changed drive, with the name of the unchanged drive.
            factors: name of each factor that concerns the drive -> its value.
            seed: seed of the changes.
        """
        content = fingerprint(drive.replaced(name="").model_dump(mode="json"))
        if content not in self._known:
            if drive != self._unchanged:
                drive = self._renamed(drive, factors, seed)
            if drive.name in {one.name for one in self._known.values()}:
                drive = drive.replaced(name=f"{drive.name}_{content[:6]}")
            self._known[content] = drive
        return self._known[content]

    def _renamed(
        self, drive: Scenario, factors: Changes, seed: int
    ) -> Scenario:
        """Returns a drive with a name for its changes."""
        plain = self._unchanged
        if self._with_controls and drive == plain.replaced(stage=drive.stage):
            return control_drive(plain, str(drive.stage))
        suffix = _name_suffix(self._side, factors, seed)
        return drive.replaced(name=f"{drive.name}_{suffix}")


def _name_suffix(side: str, given: Changes, seed: int) -> str:
    factors = dict(given)
    labels = []
    cause, level = factors.pop(CAUSE, NO_CAUSE), factors.pop(LEVEL, 0)
    for path, value in factors.items():
        name = path.rpartition(".")[2]
        is_own = path.partition(".")[0] in (side, "both")
        # The years of a drive age the city of the other side.
        if is_own != (name in ("years", "rates")) or path.startswith("both."):
            text = str(value).replace(".", "p").replace("-", "m")
            labels.append(f"{name}_{re.sub(r'[^A-Za-z0-9]+', '_', text)}")
    if cause != NO_CAUSE:
        labels.append(f"{cause}_{level}")
    return "_".join([*labels, str(seed)])
