from .cloud_files import bin_dtype as bin_dtype
from .cloud_files import coarse_note as coarse_note
from .cloud_files import is_cloud as is_cloud
from .cloud_files import read_blocks as read_blocks
from .cloud_files import read_cloud as read_cloud
from .notes import OnNote as OnNote
from .notes import no_note as no_note
from .npy_files import read_npy as read_npy
