"""The README's example in Python does what it says."""

from pathlib import Path
import re

README = Path(__file__).parent.parent / "README.md"


def test_example(short_recording, capsys):
    blocks = re.findall(
        r"^```python\n(.*?)^```", README.read_text(), re.DOTALL | re.MULTILINE
    )
    (example,) = (block for block in blocks if "sequences.open(" in block)
    assert len(example.strip().splitlines()) <= 6
    assert '"output/metropolis_04"' in example
    code = example.replace("output/metropolis_04", str(short_recording))
    names = {}
    exec(code, names)
    printed = capsys.readouterr().out
    assert str(1_700_000_000_000_000_000 + 30 * 50_000_000) in printed
    assert "'ground'" in printed
    fields = "x y z intensity ring t label instance"
    assert " ".join(names["scan"].dtype.names) == fields
    assert fields in example
