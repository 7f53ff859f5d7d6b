from cns_drake.imports.cityjson.city import import_cityjson as import_cityjson
from cns_drake.imports.import_map import import_city as import_city
from cns_drake.imports.import_map import with_usual_growth as with_usual_growth
from cns_drake.imports.map_files import YEAR_COLUMN as YEAR_COLUMN
from cns_drake.imports.map_source import map_sources as map_sources
from cns_drake.imports.named_randomness import (
    random_generator as random_generator,
)
from cns_drake.imports.named_randomness import random_share as random_share
from cns_drake.imports.openstreetmap.city import (
    import_openstreetmap as import_openstreetmap,
)
from cns_drake.imports.options import DriveOn as DriveOn
from cns_drake.imports.options import ImportOptions as ImportOptions
from cns_drake.imports.options import Undated as Undated
from cns_drake.imports.report import REPORT_NAME as REPORT_NAME
from cns_drake.imports.report import ImportReport as ImportReport
