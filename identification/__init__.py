"""System identification from records: local models, LPV models, readers and writers; independent of the plant.

The schema that virtual and measured data share, readers and writers of files, a check of what a record is fit for;
then the thesis' method, one step a file: prefilter, frequency responses, start values, grey-box and black-box fits,
confidence, residual tests, surfaces over the operating point and their refinement.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
