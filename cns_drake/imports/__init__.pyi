from cns_drake.imports.cityjson.city import import_cityjson as import_cityjson
from cns_drake.imports.drives.search import find_drives as find_drives
from cns_drake.imports.faults import ImportFaults as ImportFaults
from cns_drake.imports.import_map import import_city as import_city
from cns_drake.imports.map_files import YEAR_COLUMN as YEAR_COLUMN
from cns_drake.imports.named_randomness import (
    random_generator as random_generator,
)
from cns_drake.imports.named_randomness import random_share as random_share
from cns_drake.imports.opendrive.band_graph import BandGraph as BandGraph
from cns_drake.imports.opendrive.imported_streets import (
    ImportedStreets as ImportedStreets,
)
from cns_drake.imports.opendrive.lanes import lane_bands as lane_bands
from cns_drake.imports.opendrive.road_reader import read_roads as read_roads
from cns_drake.imports.opendrive.things import (
    thing_structures as thing_structures,
)
from cns_drake.imports.opendrive.town import split_levels as split_levels
from cns_drake.imports.openstreetmap.city import (
    import_openstreetmap as import_openstreetmap,
)
from cns_drake.imports.options import DriveOn as DriveOn
from cns_drake.imports.options import ImportOptions as ImportOptions
from cns_drake.imports.options import Undated as Undated
from cns_drake.imports.report import REPORT_NAME as REPORT_NAME
from cns_drake.imports.report import ImportReport as ImportReport
