"""The compiled part of the package."""

from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Columns = List[Tuple[str, Union[_Floats, List[str]]]]
_Records = List[Tuple[str, Optional[_Columns]]]
_Plant = Union[str, Tuple[str, str]]

PAGE_STYLE: str

class BadInput(ValueError):
    """Invalid input, as one line that names what was given and what was expected."""

def identify(records: _Records, options: Dict[str, Any]) -> Dict[str, Any]: ...
def diagnose(
    records: _Records, options: Dict[str, Any], plant: _Plant, effort: str, within: Optional[float]
) -> Dict[str, Any]: ...
def plan(
    diagnosis: str,
    name: str,
    minutes: Optional[float],
    limit_v: Optional[float],
    slew_v_per_s: Optional[float],
) -> Tuple[str, Dict[str, _Floats]]: ...
def simulate(plant: _Plant, time_s: _Floats, voltage_v: _Floats, rate_hz: float) -> Tuple[_Floats, List[str]]: ...
def predict(plant: _Plant, time_s: _Floats, voltage_v: _Floats, input: str) -> _Floats: ...

class Controller:
    not_simulated: List[str]
    def __new__(cls, plant: _Plant, options: Dict[str, Any]) -> "Controller": ...
    @property
    def range_v(self) -> Tuple[float, float]: ...
    def reset(self) -> None: ...
    def run(
        self, targets: _Floats, readings: Optional[_Floats] = None
    ) -> Tuple[NDArray[np.uint16], _Floats, _Floats, NDArray[np.uint8]]: ...
