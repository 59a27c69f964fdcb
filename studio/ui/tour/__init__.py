"""The tour: the whole job through the real window, every step verified by its effect.

capture_steps  Steps of the tour in Record and Curate: takes are made, played, trimmed, labelled and divided
driver         Hands and eyes for the tour: uses controls as a person does; a UDP socket stands for the
               avatar
guide          What all steps of the tour share: the window, the hands, and what was made so far
result_steps   Steps of the tour in Train, Review and Live: a run is trained, reviewed, sent, exported,
               performed
steps          The steps of the tour, in the order of the work
tour           The tour's frame: opens the real window, takes the steps in order, and says how each went
"""

from studio.ui.tour.tour import Tour, TourStep

__all__ = ["Tour", "TourStep"]
