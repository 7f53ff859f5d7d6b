from cns_drake.pictures.aerial_pictures import draw_drives as draw_drives
from cns_drake.pictures.camera_views import View as View
from cns_drake.pictures.camera_views import load_views as load_views
from cns_drake.pictures.drive_page import read_drive_page as read_drive_page
from cns_drake.pictures.drive_page import save_meshcat_page as save_meshcat_page
from cns_drake.pictures.meshcat_drawing import height_rgb as height_rgb
from cns_drake.pictures.meshcat_recorder import (
    MeshcatRecorder as MeshcatRecorder,
)
from cns_drake.pictures.page_panel import ShownStages as ShownStages
from cns_drake.pictures.stage_comparison import other_stage as other_stage
from cns_drake.pictures.stage_pictures import draw_stages as draw_stages
from cns_drake.pictures.stage_scene import StageScene as StageScene
