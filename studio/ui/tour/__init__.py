"""The tour: the whole job through the real window, every step verified by its effect.

driver  Uses controls as a person does, listens as an avatar would, and knows what was made so far
steps   The steps of the tour, in the order of the work
tour    Opens the real window, runs the steps in order, and says how each went
"""

from studio.ui.tour.tour import Tour, TourStep

__all__ = ["Tour", "TourStep"]
