"""Studies of many drives: experiments, the drives they compare, and labels.

- Experiments: `experiment` has the fields, `experiment_files` reads them;
  `nested_fields`, `spread_values`, `factors`, `method_variants`,
  `protocol_fields`. `conditions` combines the factors.
- Drives of a condition: `comparisons` changes two drives by means of
  `changed_drives` and `lost_structures`; fields of a database of several
  drives (`session_fields`, `sampled_drives`, `side_fields`), `named_stages`,
  `viewpoints`, `control_drives`, `unique_names`.
- Maps: `experiment_maps` finds them, `made_maps` requests them, `map_step`
  makes them as jobs; `redrawing`, `frozen_redraws`, `turned_inputs`,
  `distractors`, `map_pictures`.
- Measuring: `study` from `simulated_pairs` and `recorded_conditions`, with the
  methods of `method_choices`; `frozen_drives`; the tasks `map_task` and
  `seen_task`; `map_upkeep`.
- Exact labels by rays: `labelled_drive`, `exact_labels`, `map_truth`,
  `map_truth_page`; `exact_overlap`.
- Recordings and exports: `recording`, `reproduction`; `pair_export`,
  `pointnetvlad_files`.
- `training` of the method `learned`.
"""

from cns_drake.base.own_packages import check_evaluation

# Checked before a module in here imports `evaluation`.
check_evaluation()
