from .drives.changed_drives import Losses as Losses
from .drives.sampled_drives import DrawnRoute as DrawnRoute
from .drives.sampled_drives import Fleet as Fleet
from .experiments.cause_files import Cause as Cause
from .experiments.cause_files import causes as causes
from .experiments.cause_files import (
    register_cause as register_cause,
)
from .experiments.experiment import Experiment as Experiment
from .experiments.experiment import MadeMap as MadeMap
from .experiments.experiment import (
    named_programs as named_programs,
)
from .experiments.experiment_files import (
    experiment_text as experiment_text,
)
from .experiments.experiment_files import (
    load_experiment as load_experiment,
)
from .experiments.experiment_files import (
    shipped_experiments as shipped_experiments,
)
from .ground_truth.labelled_drive import (
    open_labelled as open_labelled,
)
from .ground_truth.map_truth import write_truth as write_truth
from .maps.experiment_maps import (
    ExperimentRun as ExperimentRun,
)
from .pair_export import ExportOptions as ExportOptions
from .pair_export import claim_pairs as claim_pairs
from .pair_export import export_pairs as export_pairs
from .pair_export import (
    write_overlap_table as write_overlap_table,
)
from .recording import is_recorded as is_recorded
from .recording import record_all as record_all
from .reproduction import (
    reproduce_maps as reproduce_maps,
)
from .study import TASKS as TASKS
from .study import run_study as run_study
from .study import study_drives as study_drives
from .training.weights import TrainingPlan as TrainingPlan
from .training.weights import make_weights as make_weights
