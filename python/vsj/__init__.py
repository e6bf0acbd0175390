"""Identification, diagnosis and control of piezo variable-stiffness springs.

What the command ``vsj`` computes, on pandas and polars frames, NumPy arrays and CSV files:

- :func:`identify`: the smallest linear spring that a record shows.
- :func:`diagnose`: what a simulation gets wrong on a record, and the cause.
- :func:`plan`: the experiment that decides what a diagnosis leaves open.
- :func:`simulate`: the stiffness of a spring under a voltage, as the microcontroller computes it.
- :class:`Controller`: the controller's tick on arrays, bit for bit.
- :class:`Link`: a running microcontroller over its serial link.
- :class:`Spring`: an estimator with ``fit``, ``predict`` and ``score``.

Times are in s, voltages in V, and a stiffness is expressed as the equivalent static voltage in V, unless a name says otherwise.
Invalid input raises :class:`BadInput` with the text of the command's error.
"""

from ._vsj import BadInput, LinkError
from .analysis import diagnose, identify, plan
from .answers import Diagnosis, Finding, Identified, Parameter, Plan, Quantity, Suspect
from .control import Controller, Feedback, Limit, Run, simulate
from .link import Isolation, Link, Sample
from .records import RecordWarning
from .spring import Spring

__version__ = "0.1.0"

__all__ = [
    "BadInput",
    "Controller",
    "Diagnosis",
    "Feedback",
    "Finding",
    "Identified",
    "Isolation",
    "Limit",
    "Link",
    "LinkError",
    "Parameter",
    "Plan",
    "Quantity",
    "RecordWarning",
    "Run",
    "Sample",
    "Spring",
    "Suspect",
    "diagnose",
    "identify",
    "plan",
    "simulate",
]
