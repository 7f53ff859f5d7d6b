from cns_drake.export.exporting import claim_folder as claim_folder
from cns_drake.export.exporting import export_drive as export_drive
from cns_drake.export.formats import export_formats as export_formats
from cns_drake.export.marked_drive import MarkedDrive as MarkedDrive
