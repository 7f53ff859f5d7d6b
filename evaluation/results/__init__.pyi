from .cells import as_factor as as_factor
from .charts.chart import PrintStyle as PrintStyle
from .charts.comparison import draw_comparison as draw_comparison
from .charts.kinds import chart_factors as chart_factors
from .charts.kinds import check_factors as check_factors
from .charts.kinds import draw_chart as draw_chart
from .figure_files import save_figure as save_figure
from .keys import CAUSE as CAUSE
from .keys import FROZEN_REDRAW as FROZEN_REDRAW
from .keys import LAST as LAST
from .keys import LEVEL as LEVEL
from .keys import NO_CAUSE as NO_CAUSE
from .keys import OWN as OWN
from .keys import PROTOCOL_BASE as PROTOCOL_BASE
from .keys import SETTINGS as SETTINGS
from .keys import STAGE as STAGE
from .keys import Key as Key
from .keys import check_metric_names as check_metric_names
from .keys import made_by as made_by
from .method_names import in_table_order as in_table_order
from .method_names import title as title
from .output_files import check_output as check_output
from .output_files import make_output as make_output
from .output_files import write_tables as write_tables
from .page import write_page as write_page
from .page_frame import PageSection as PageSection
from .page_frame import page_section as page_section
from .ranking import rank_methods as rank_methods
from .sections.browser import (
    browser_section as browser_section,
)
from .sections.camera_images import (
    nearest_images as nearest_images,
)
from .sections.change_pictures import (
    ChangePicture as ChangePicture,
)
from .sections.change_pictures import (
    DrivenMap as DrivenMap,
)
from .sections.change_pictures import (
    change_section as change_section,
)
from .sections.cities import cities_section as cities_section
from .sections.found import found_lines as found_lines
from .sections.found import lacks_baseline as lacks_baseline
from .sections.point_rendering import (
    OrthographicView as OrthographicView,
)
from .sections.point_rendering import render as render
from .sections.routes import PageDrive as PageDrive
from .sections.routes import (
    make_page_drive as make_page_drive,
)
from .sections.routes import routes_section as routes_section
from .styles import FIGURE_STYLE as FIGURE_STYLE
from .styles import INK as INK
from .styles import PALE as PALE
from .styles import method_style as method_style
from .styles import unit_rgb as unit_rgb
from .summaries import excesses as excesses
from .summaries import means as means
from .summary_tables import summary_lines as summary_lines
from .survival import Survival as Survival
from .survival import judge_survival as judge_survival
from .survival import largest_loss_shown as largest_loss_shown
from .table import QUERIES as QUERIES
from .table import RESULTS as RESULTS
from .table import Answers as Answers
from .table import QueryRows as QueryRows
from .table import Results as Results
from .table import Row as Row
from .table_comparison import compare_tables as compare_tables
from .track_figure import draw_track as draw_track
