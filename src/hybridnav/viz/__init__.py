"""Pictures of maps, places, graphs and plans, and charts of methods.

Drawn on matplotlib figures without pyplot or display. Functions return the axes that they drew on;
`axes.figure` is the figure.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
