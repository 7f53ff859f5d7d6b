from .changing import change_world as change_world
