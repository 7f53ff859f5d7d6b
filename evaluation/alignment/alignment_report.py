"""The report on an alignment."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class AlignmentReport:
    """The alignment of two drives.

    Attributes:
        held: name of the drive that gives the world.
        moved: name of the other.
        frames: names of the original worlds of both.
        guess: source of the first guess.
        candidates: pairs of places that look alike; None if not needed.
        attempts: registrations tried.
        loops: registrations that fit.
        inliers: loops that agree with the result.
        distance_median: between inliers and result [m].
        distance_95: 95 % of the inliers are nearer [m].
        angle_median_deg: between inliers and result.
        model: "anchor" for one rigid pose, "pose graph" for a bent drive.
        move: of the source's middle frame, along x, y, z [m].
        turn_deg: of that frame about the vertical.
        bend: greatest difference of another frame's move from the middle one's
            [m].
        straightened: disagreement of the drives with themselves before they
            were straightened: upper quartile over their loops [m]; 0 if not
            needed.
        ground: height that was subtracted from both [m].
    """

    held: str
    moved: str
    frames: tuple[str, str]
    guess: str
    candidates: int | None
    attempts: int
    loops: int
    inliers: int
    distance_median: float
    distance_95: float
    angle_median_deg: float
    model: str
    move: tuple[float, float, float]
    turn_deg: float
    bend: float
    straightened: tuple[float, float]
    ground: float

    def to_json(self) -> dict:
        """Returns all numbers."""
        return asdict(self)

    def to_text(self) -> str:
        """Returns one line for the user."""
        return (
            f"{self.moved} (poses in {self.frames[1]!r}) aligned to"
            f" {self.held} (in {self.frames[0]!r}): {self.inliers} of"
            f" {self.loops} loops agree ({self.attempts} tried), median"
            f" {self.distance_median:.2f} m and"
            f" {self.angle_median_deg:.2f} deg off; {self.model}, first guess"
            f" from {self.guess}"
        )
