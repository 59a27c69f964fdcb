"""The tour: the whole job through the real window, every step verified by its effect."""

from studio.ui.tour.tour import Step, Tour

__all__ = ["Step", "Tour"]
