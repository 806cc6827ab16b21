"""The exact three-dimensional map of a piecewise-linear capsule system with bidirectional drifts.

Everything that is called stands here, and is imported on first use: importing the package costs
next to nothing. `__init__.pyi` has the same names for type checkers.
"""

_NAMES = {
    "_design.fit": "Fit FitStatus fit",
    "_design.measured": "read_measured",
    "_design.optimise": "optimise",
    "_design.optimum": "Constraint Optimum OptimumStatus Tightest",
    "_design.pareto": "Front pareto",
    "_design.sensitivities": "Sensitivities sensitivities",
    "_design.steering": "Break Steering SteeringStatus steer",
    "_enclosures.certificates": "certify_bifurcation certify_orbit certify_run",
    "_enclosures.checker": "Rejected check_certificate",
    "_errors": "CapsuleError InvalidInput NotInstalled Outcome Status",
    "_figures.animation": "animate",
    "_figures.charts": "plot_chart",
    "_figures.design": "plot_front plot_residuals plot_steering",
    "_figures.diagrams": "plot_diagram",
    "_figures.device": "plot_fig1",
    "_figures.sweeps": "plot_basin plot_pareto",
    "_figures.branches": "plot_bifurcations",
    "_figures.energy": "plot_energies",
    "_figures.events": "plot_events",
    "_figures.evolution": "plot_fig6 plot_itineraries",
    "_figures.guards": "plot_margins",
    "_figures.panels": "plot_fig7",
    "_figures.plots": "plot",
    "_figures.portraits": "plot_displacements plot_motion plot_phase_portrait",
    "_figures.precision": "plot_work_precision",
    "_figures.statespace": "plot_fig2",
    "_figures.style": "figure_style save_figure",
    "_figures.switching": "plot_fig3 plot_fig4 plot_fig5",
    "_map.many": "Trajectories simulate_many",
    "_map.segments": "Instant Segment",
    "_map.simulate": "simulate",
    "_map.steady": "SteadyMotion",
    "_map.trajectory": "Trajectory",
    "_orbits.continuation.bifurcations": "Bifurcation",
    "_orbits.continuation.boxes": "BoxSearch search_box",
    "_orbits.continuation.continuation": "Branch BranchPoint continue_orbit",
    "_orbits.continuation.curves": "CodimensionTwoPoint Curve CurvePoint continue_bifurcation "
    "curves_from",
    "_orbits.continuation.isolas": "continue_both_ways",
    "_orbits.continuation.normal_forms": "NormalForm",
    "_orbits.continuation.parameter_paths": "ParameterPath device_path parameter_path",
    "_orbits.continuation.saved": "labelled_point orbit_from_record read_branch",
    "_orbits.continuation.states": "Ending",
    "_orbits.continuation.switching": "continue_from period_doubling_cascade",
    "_orbits.metrics.many": "Performances performance_many",
    "_orbits.metrics.performance": "Metric Performance performance",
    "_orbits.shooting.admissibility": "Inequality is_admissible tightest",
    "_orbits.shooting.itinerary": "Itinerary ItinerarySegment",
    "_orbits.shooting.orbit": "Orbit OrbitStatus solve_itinerary",
    "_orbits.shooting.search": "solve_admissible solve_orbit search_orbits orbit_at",
    "_orbits.shooting.stability": (
        "floquet_multipliers jacobian lyapunov_exponents monodromy_matrix saltation_matrix"
    ),
    "_orbits.shooting.symmetry": "half_orbit mirror_image whole_orbit",
    "_parameters": "Parameters PhysicalParameters load_parameters",
    "_sweeps.axes": "Axis",
    "_sweeps.basin": "run_basin",
    "_sweeps.execution": "SweepStatus run_sweep",
    "_sweeps.plan": "load_sweep read_plan",
    "_sweeps.refinement": "refine_sweep",
    "_sweeps.results": "open_results",
    "_sweeps.sweep": "Sweep",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
# What an extra brings and a module cannot do without; the others ask for it when they are called.
_NEEDS = {
    "flint": ("_enclosures.certificates", "_enclosures.checker"),
    "zarr": ("_sweeps.basin", "_sweeps.execution", "_sweeps.refinement", "_sweeps.results"),
}


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in _HOME:
        found: object = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    elif name == "__version__":
        from importlib.metadata import version

        found = version("capsule-sym")
    elif name == "__all__":
        # What `from capsule_sym import *` can give here: a name that needs what is absent would
        # take all the others away.
        from importlib.util import find_spec

        absent = {one for need, some in _NEEDS.items() if find_spec(need) is None for one in some}
        found = ["__version__", *sorted(n for n, module in _HOME.items() if module not in absent)]
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return ["__version__", *sorted(_HOME)]
