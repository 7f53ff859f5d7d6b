from cns_drake.studies.drives.changed_drives import Losses as Losses
from cns_drake.studies.drives.sampled_drives import DrawnRoute as DrawnRoute
from cns_drake.studies.drives.sampled_drives import Fleet as Fleet
from cns_drake.studies.experiments.cause_files import Cause as Cause
from cns_drake.studies.experiments.cause_files import causes as causes
from cns_drake.studies.experiments.cause_files import (
    register_cause as register_cause,
)
from cns_drake.studies.experiments.experiment import Experiment as Experiment
from cns_drake.studies.experiments.experiment import MadeMap as MadeMap
from cns_drake.studies.experiments.experiment import (
    named_programs as named_programs,
)
from cns_drake.studies.experiments.experiment_files import (
    experiment_text as experiment_text,
)
from cns_drake.studies.experiments.experiment_files import (
    load_experiment as load_experiment,
)
from cns_drake.studies.experiments.experiment_files import (
    shipped_experiments as shipped_experiments,
)
from cns_drake.studies.ground_truth.labelled_drive import (
    open_labelled as open_labelled,
)
from cns_drake.studies.ground_truth.map_truth import write_truth as write_truth
from cns_drake.studies.maps.experiment_maps import (
    ExperimentRun as ExperimentRun,
)
from cns_drake.studies.pair_export import ExportOptions as ExportOptions
from cns_drake.studies.pair_export import claim_pairs as claim_pairs
from cns_drake.studies.pair_export import export_pairs as export_pairs
from cns_drake.studies.pair_export import (
    write_overlap_table as write_overlap_table,
)
from cns_drake.studies.recording import is_recorded as is_recorded
from cns_drake.studies.recording import record_all as record_all
from cns_drake.studies.reproduction import (
    reproduce_maps as reproduce_maps,
)
from cns_drake.studies.study import TASKS as TASKS
from cns_drake.studies.study import run_study as run_study
from cns_drake.studies.study import study_drives as study_drives
from cns_drake.studies.training.weights import TrainingPlan as TrainingPlan
from cns_drake.studies.training.weights import make_weights as make_weights
