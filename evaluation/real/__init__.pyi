from evaluation.real.image_sequences import write_images as write_images
from evaluation.real.judge import Features as Features
from evaluation.real.judge import common_names as common_names
from evaluation.real.judge import judge_draws as judge_draws
from evaluation.real.judge import places_of as places_of
from evaluation.real.judge import scan_table as scan_table
from evaluation.real.real_study import measure_real as measure_real
