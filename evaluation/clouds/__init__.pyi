from evaluation.clouds.cloud_files import SCAN_LIMIT_BYTES as SCAN_LIMIT_BYTES
from evaluation.clouds.cloud_files import bin_dtype as bin_dtype
from evaluation.clouds.cloud_files import is_cloud as is_cloud
from evaluation.clouds.cloud_files import read_blocks as read_blocks
from evaluation.clouds.cloud_files import read_cloud as read_cloud
from evaluation.clouds.notes import OnNote as OnNote
from evaluation.clouds.notes import no_note as no_note
from evaluation.clouds.npy_files import read_npy as read_npy
