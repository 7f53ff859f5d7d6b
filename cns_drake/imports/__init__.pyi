from .cityjson.city import import_cityjson as import_cityjson
from .import_map import import_city as import_city
from .import_map import with_usual_growth as with_usual_growth
from .map_files import YEAR_COLUMN as YEAR_COLUMN
from .map_source import map_sources as map_sources
from .named_randomness import (
    random_generator as random_generator,
)
from .named_randomness import random_share as random_share
from .openstreetmap.city import (
    import_openstreetmap as import_openstreetmap,
)
from .options import DriveOn as DriveOn
from .options import ImportOptions as ImportOptions
from .options import Undated as Undated
from .report import REPORT_NAME as REPORT_NAME
from .report import ImportReport as ImportReport
