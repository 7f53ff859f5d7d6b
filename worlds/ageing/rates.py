"""The yearly rates of events in a city, and counts of the events."""

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from scipy.stats import poisson

from evaluation.base import InputError, parse_yaml, read_yaml

# Not a rate, but the greatest distance that street furniture moves.
MOVED = "moved"
# Upper limit of this distance [m].
_FARTHEST = 20.0
# Events that are sampled at random -> their rate per year, see rates.yaml.
DEFAULT_RATES: Mapping[str, float] = {
    event: values["metres" if event == MOVED else "rate"]
    for event, values in parse_yaml(
        Path(__file__).with_name("rates.yaml").read_bytes()
    ).items()
}


def read_rates(path: Path | None, factor: float = 1.0) -> dict[str, float]:
    """Returns the rate per year of each event, by the event's name.

    The key `moved` has a distance instead: the greatest distance between a
    piece of furniture and the piece that replaces it [m].

    Args:
        path: a YAML file that maps events to rates from 0 to 1, and `moved` to
            a distance [m]. Values that are not in the file keep their defaults.
            None for all default values.
        factor: factor by which all rates, but not the distance, are multiplied.

    Raises:
        InputError: the file cannot be read or names an unknown event, or a rate
            or the factor is out of range.
    """
    found = check_rates({} if path is None else read_yaml(path), path)
    rates = {
        e: r if e == MOVED else factor * r
        for e, r in {**DEFAULT_RATES, **found}.items()
    }
    for event, rate in rates.items():
        if not 0.0 <= rate <= 1.0 and event != MOVED:
            raise InputError(
                f"--rate: {factor:g} times the rate of {event} is {rate:g}, "
                "not from 0 to 1"
            )
    return rates


def check_rates(found: object, source: object) -> dict[str, float]:
    """Checks that events and their rates are valid; returns the rates.

    Args:
        found: event -> rate per year from 0 to 1, and `moved` -> distance [m],
            as read from a file.
        source: the file, for error messages.

    Raises:
        InputError: an event is unknown, or a rate is out of range.
    """
    if not isinstance(found, dict):
        raise InputError(f"{source}: not a mapping of event: rate")
    for event, rate in found.items():
        if event not in DEFAULT_RATES:
            raise InputError(
                f"{source}: {event}: unknown event (there are: "
                f"{', '.join(DEFAULT_RATES)})"
            )
        is_number = isinstance(rate, int | float) and not isinstance(rate, bool)
        kind, most = ("rate", 1.0) if event != MOVED else ("length", _FARTHEST)
        if not (is_number and 0.0 <= rate <= most):
            raise InputError(
                f"{source}: {event}: {rate!r} is no {kind}, 0 to {most:g}"
            )
    return found


@dataclass
class Tally:
    """Counts how often events happened to the objects of a city.

    Attributes:
        rates: event -> rate per year.
        expected: event -> expected number of events.
        exposure: event -> number of objects at risk, summed over the years.
        number: event -> number of events that happened.
    """

    rates: Mapping[str, float]
    expected: defaultdict[str, float] = field(
        default_factory=lambda: defaultdict(float)
    )
    exposure: Counter[str] = field(default_factory=Counter)
    number: Counter[str] = field(default_factory=Counter)

    def count(
        self, event: str, probability: float, hit: bool, num_at_risk: int
    ) -> None:
        """Counts one random trial of an event.

        Args:
            event: name of the event.
            probability: probability of the event in this trial.
            hit: whether the event happened.
            num_at_risk: number of objects at risk that this trial adds to
                `exposure`. Use 0 if an earlier trial has already added these
                objects.
        """
        self.expected[event] += probability
        self.exposure[event] += num_at_risk
        self.number[event] += hit

    def to_csv(self) -> str:
        """Returns a CSV table of the specified and the observed rates.

        The column `p` is the two-sided p-value of the observed number of
        events, see `poisson_p`.
        """
        lines = ["event,rate,exposure,expected,events,rate_came_about,p\n"]
        for event, rate in self.rates.items():
            if event == MOVED:
                continue
            exposure, number = self.exposure[event], self.number[event]
            expected = self.expected[event]
            share = number / exposure if exposure else float("nan")
            lines.append(
                f"{event},{rate:.6g},{exposure},{expected:.3f},{number},"
                f"{share:.6f},{poisson_p(number, expected):.4f}\n"
            )
        return "".join(lines)


def poisson_p(number: int, expected: float) -> float:
    """Returns the two-sided p-value of an observed number of events.

    The number is compared with a Poisson distribution.
    """
    tails = poisson.cdf(number, expected), poisson.sf(number - 1, expected)
    return min(1.0, 2.0 * float(min(tails)))
