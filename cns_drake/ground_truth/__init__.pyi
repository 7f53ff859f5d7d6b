from .exact_labels import is_there as is_there
from .exact_labels import label_points as label_points
from .exact_overlap import VisibleSurfaces as VisibleSurfaces
from .exact_overlap import sights_of as sights_of
from .exact_overlap import write_overlap_table as write_overlap_table
from .labelled import LabelledDrive as LabelledDrive
from .labelled import labelled_drive as labelled_drive
from .map_truth import write_truth as write_truth
