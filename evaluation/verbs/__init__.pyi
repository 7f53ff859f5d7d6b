from .change import change_between as change_between
from .localisation import Localisation as Localisation
from .localisation import localise as localise
from .map_update import update_map as update_map
from .measured import Measured as Measured
from .recognition import Recognition as Recognition
from .recognition import recognise as recognise
from .reporting import report as report
