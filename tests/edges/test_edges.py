"""What the programs do at their edges is what the pins say.

`python tests/edges/refresh.py NAME` writes the pins of an edge anew.
"""

import pytest

from edges.measured import BY_NIGHT, EDGES, PINS, differences

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    "name",
    [*EDGES, *(pytest.param(one, marks=pytest.mark.night) for one in BY_NIGHT)],
)
def test_an_edge_is_as_pinned(name, tmp_path):
    found = {**EDGES, **BY_NIGHT}[name](tmp_path)
    changed = {
        file: differences(file, (PINS / file).read_text(), text)
        for file, text in found.items()
    }
    assert not {file: lines for file, lines in changed.items() if lines}
