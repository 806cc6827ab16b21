"""Arguments of functions: plans, sweeps, series, paths, and base classes of parameters."""

from capsule_sym._check.switch_file import read_switches as read_switches
from capsule_sym._design.measured import read_measured as read_measured
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath as ParameterPath
from capsule_sym._orbits.continuation.parameter_paths import device_path as device_path
from capsule_sym._orbits.continuation.parameter_paths import parameter_path as parameter_path
from capsule_sym._parameters import SceneDevice as SceneDevice
from capsule_sym._parameters import SceneParameters as SceneParameters
from capsule_sym._sweeps.axes import Axis as Axis
from capsule_sym._sweeps.plan import read_plan as read_plan
from capsule_sym._sweeps.sweep import Sweep as Sweep
