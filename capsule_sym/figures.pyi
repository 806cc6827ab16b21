"""Pictures of results; `capsule_sym.plot` chooses one."""

from capsule_sym._figures.design import plot_front as plot_front
from capsule_sym._figures.design import plot_residuals as plot_residuals
from capsule_sym._figures.diagrams import plot_diagram as plot_diagram
from capsule_sym._figures.portraits import plot_displacements as plot_displacements
from capsule_sym._figures.portraits import plot_motion as plot_motion
from capsule_sym._figures.portraits import plot_phase_portrait as plot_phase_portrait
from capsule_sym._figures.style import figure_style as figure_style
from capsule_sym._figures.style import save_figure as save_figure
from capsule_sym._figures.sweeps import plot_basin as plot_basin
from capsule_sym._figures.sweeps import plot_chart as plot_chart
from capsule_sym._figures.sweeps import plot_metric as plot_metric
from capsule_sym._figures.tolerances import plot_tolerances as plot_tolerances
