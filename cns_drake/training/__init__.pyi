from .pair_export import ExportOptions as ExportOptions
from .pair_export import write_pairs as write_pairs
from .weights import TrainingPlan as TrainingPlan
from .weights import make_weights as make_weights
