"""Pictures: public nouns, `StageScene` and `MeshcatRecorder`, show cities."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
