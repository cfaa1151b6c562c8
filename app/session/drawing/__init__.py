"""The 3-D view: what a StepRecord looks like in viser, for a live trial and a replay alike."""

from app.session.drawing.layers import Layers, LayersError
from app.session.drawing.subject import Subject, subject_of
from app.session.drawing.viewer import Viewer

__all__ = ["Layers", "LayersError", "Subject", "Viewer", "subject_of"]
