from .exporting import claim_folder as claim_folder
from .exporting import export_drive as export_drive
from .formats import export_formats as export_formats
