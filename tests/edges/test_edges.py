"""What the programs do at their edges is what the pins say.

`python tests/edges/refresh.py NAME` writes the pins of an edge anew.
"""

from helpers.processors import processors
import pytest

from edges.measured import BY_NIGHT, EDGES, PINS, differences

pytestmark = pytest.mark.slow

PROCESSORS = processors()
# They print texts alone.
HELPS = ("cns-drake-help", "cns-eval-help")


def cases():
    for name in (*EDGES, *BY_NIGHT):
        for processor in ("own", *PROCESSORS):
            if processor == "own" or name not in HELPS:
                by_day = name in EDGES and processor in ("own", "oldest")
                marks = () if by_day else pytest.mark.night
                yield pytest.param(name, processor, marks=marks)


@pytest.mark.parametrize(("name", "processor"), list(cases()))
def test_an_edge_is_as_pinned(name, processor, tmp_path, monkeypatch):
    for variable, value in PROCESSORS.get(processor, {}).items():
        monkeypatch.setenv(variable, value)
    found = {**EDGES, **BY_NIGHT}[name](tmp_path)
    changed = {
        file: differences(file, (PINS / file).read_text(), text)
        for file, text in found.items()
    }
    assert not {file: lines for file, lines in changed.items() if lines}
