"""Charts of a study whose tasks are others than those of its file."""

from types import SimpleNamespace

from cns_drake.studies.experiment import load_experiment
from cns_drake.studies.study import Study
from evaluation.results.table import Results, Row


def test_charts_that_the_results_lack_are_left_out_with_a_note():
    results = Results.of(
        Row(
            *("stages", "town", "town_01", "town_02", 1),
            *({"both.stage": stage}, "place", "solid", False, "fair"),
            *("auc", 0.5),
        )
        for stage in ("last", "own")
    )
    notes = []
    study = SimpleNamespace(
        experiment=load_experiment("stages"),
        source="stages",
        on_note=notes.append,
    )
    # Nothing measured the structural change.
    (kept,) = Study._charts(study, results)
    assert kept["kind"] == "dumbbell"
    assert notes == ["stages: charts: scatter: no auc has a tcr_sym: left out"]
