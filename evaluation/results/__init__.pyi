from evaluation.results.cells import as_factor as as_factor
from evaluation.results.charts.kinds import chart_factors as chart_factors
from evaluation.results.charts.kinds import check_factors as check_factors
from evaluation.results.charts.kinds import draw_chart as draw_chart
from evaluation.results.figure_files import save_figure as save_figure
from evaluation.results.keys import CAUSE as CAUSE
from evaluation.results.keys import FROZEN_REDRAW as FROZEN_REDRAW
from evaluation.results.keys import LAST as LAST
from evaluation.results.keys import LEVEL as LEVEL
from evaluation.results.keys import NO_CAUSE as NO_CAUSE
from evaluation.results.keys import OWN as OWN
from evaluation.results.keys import PROTOCOL_BASE as PROTOCOL_BASE
from evaluation.results.keys import SETTINGS as SETTINGS
from evaluation.results.keys import STAGE as STAGE
from evaluation.results.keys import Key as Key
from evaluation.results.keys import check_metric_names as check_metric_names
from evaluation.results.keys import made_by as made_by
from evaluation.results.method_names import in_table_order as in_table_order
from evaluation.results.method_names import title as title
from evaluation.results.output_files import check_output as check_output
from evaluation.results.output_files import make_output as make_output
from evaluation.results.output_files import remove_earlier as remove_earlier
from evaluation.results.output_files import write_tables as write_tables
from evaluation.results.page import write_page as write_page
from evaluation.results.page_frame import PageSection as PageSection
from evaluation.results.page_frame import page_section as page_section
from evaluation.results.ranking import rank_methods as rank_methods
from evaluation.results.sections.browser import (
    browser_section as browser_section,
)
from evaluation.results.sections.camera_images import (
    nearest_images as nearest_images,
)
from evaluation.results.sections.change_pictures import (
    ChangePicture as ChangePicture,
)
from evaluation.results.sections.change_pictures import (
    DrivenMap as DrivenMap,
)
from evaluation.results.sections.change_pictures import (
    change_section as change_section,
)
from evaluation.results.sections.point_rendering import (
    OrthographicView as OrthographicView,
)
from evaluation.results.sections.point_rendering import render as render
from evaluation.results.sections.routes import PageDrive as PageDrive
from evaluation.results.sections.routes import (
    make_page_drive as make_page_drive,
)
from evaluation.results.sections.routes import routes_section as routes_section
from evaluation.results.styles import INK as INK
from evaluation.results.styles import PALE as PALE
from evaluation.results.styles import method_style as method_style
from evaluation.results.styles import method_styles as method_styles
from evaluation.results.styles import unit_rgb as unit_rgb
from evaluation.results.summaries import excesses as excesses
from evaluation.results.summaries import means as means
from evaluation.results.summary_tables import summary_lines as summary_lines
from evaluation.results.survival import MARGIN as MARGIN
from evaluation.results.survival import Survival as Survival
from evaluation.results.survival import judge_survival as judge_survival
from evaluation.results.survival import largest_loss_shown as largest_loss_shown
from evaluation.results.table import QUERIES as QUERIES
from evaluation.results.table import RESULTS as RESULTS
from evaluation.results.table import Answers as Answers
from evaluation.results.table import QueryRows as QueryRows
from evaluation.results.table import Results as Results
from evaluation.results.table import Row as Row
from evaluation.results.table_comparison import compare_tables as compare_tables
from evaluation.results.track_figure import draw_track as draw_track
