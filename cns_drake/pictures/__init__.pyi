from .aerial_pictures import draw_drives as draw_drives
from .camera_views import View as View
from .camera_views import load_views as load_views
from .drive_page import read_drive_page as read_drive_page
from .drive_page import save_meshcat_page as save_meshcat_page
from .meshcat_drawing import height_rgb as height_rgb
from .meshcat_recorder import (
    MeshcatRecorder as MeshcatRecorder,
)
from .page_panel import ShownStages as ShownStages
from .stage_comparison import other_stage as other_stage
from .stage_pictures import draw_stages as draw_stages
from .stage_scene import StageScene as StageScene
