"""A study that is interrupted again and again, at every file."""

from helpers.internal import studies
from helpers.small_towns import drive
import pytest

from cns_drake.base import InputError
from evaluation.study import Part, choose_methods

pytestmark = pytest.mark.slow


def parts(output):
    return {
        path.relative_to(output): path.read_bytes()
        for path in output.rglob("*")
        if path.is_file()
    }


@pytest.mark.night
@pytest.mark.usefixtures("few_methods", "unrendered_figures")
def test_values_that_no_result_needs_are_removed(tmp_path, monkeypatch):
    """They are made again for new results, which are as of one run."""
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    recordings = tmp_path / "in"
    methods = choose_methods()
    do_jobs = studies.do

    def run(folder, methods):
        done = []
        monkeypatch.setattr(
            studies, "do", lambda jobs: done.extend(do_jobs(jobs)) or done
        )
        studies.report(recordings, tmp_path / folder, methods)
        return done

    whole = run("whole", methods)
    assert set(whole) >= {
        "features of metropolis_01",
        "features of metropolis_04",
    }
    assert run("whole", methods) == []
    features = tmp_path / "whole" / "parts" / "features"
    for path in features.rglob("*.data"):
        if not path.name.startswith("described"):
            Part(path).read()
        else:
            assert path.stat().st_size < 2000
            with pytest.raises(InputError, match="its value was removed"):
                Part(path).read()
    run("later", methods[:1])
    # New results of one method need its descriptions alone.
    shape = features.relative_to(tmp_path / "whole")
    old = tmp_path / "later" / shape / "metropolis_01" / "fine.data"
    before = old.stat().st_mtime_ns
    assert "features of metropolis_01" in run("later", methods)
    assert old.stat().st_mtime_ns == before
    for name in ("queries.csv", "results.csv"):
        expected = (tmp_path / "whole" / name).read_bytes()
        assert (tmp_path / "later" / name).read_bytes() == expected
