"""Files damaged at random: each is read, or refused in one line.

Files of sound parts that contradict each other (lies) are refused, or give
what the parts agree on.

`pytest tests/fuzzing --night --fuzz 100000` damages files of all readers, that
many times in place of the few times that fit beside the other tests, and
`--fuzz-seed` does it in other ways. A failure names the folder with the files
that caused it.
"""

from concurrent.futures import ThreadPoolExecutor

from helpers import fuzz_targets
from helpers.fuzz_targets import TARGETS
from helpers.fuzzing import Worker
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def faults(tmp_path_factory, request):
    """Target's name -> faults, if many are wanted by two processes."""
    options = request.config.option
    asked = {
        item.callspec.params["name"]
        for item in request.session.items
        if item.path == request.path
    }
    chosen = [target for target in TARGETS if target.name in asked]
    shares = sum(target.share for target in chosen)

    def feed(targets):
        worker = Worker(
            tmp_path_factory.mktemp("fuzz"),
            fuzz_targets.find_target,
            fuzz_targets.REFUSALS,
        )
        try:
            return {
                target.name: worker.run(
                    target.name,
                    options.fuzz_seed,
                    round(options.fuzz * target.share / shares),
                )
                for target in targets
            }
        finally:
            worker.close()

    # A process imports for seconds what damages a thousand files.
    processes = 1 + (options.fuzz > 1000)
    with ThreadPoolExecutor(processes) as pool:
        parts = pool.map(feed, [chosen[k::processes] for k in range(processes)])
        return {name: found for part in parts for name, found in part.items()}


# A target takes longer to build than to damage a hundred times.
@pytest.mark.sampled(12)
@pytest.mark.parametrize("name", [target.name for target in TARGETS])
def test_damaged_files_are_read_or_refused_in_a_line(faults, name):
    found = faults[name]
    assert not found, f"{len(found)} faults:\n" + "\n\n".join(found[:5])
