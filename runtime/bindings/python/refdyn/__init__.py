"""Refdyn: equations of motion of robots with flexible links, evaluated on NumPy arrays by compiled C.

    import refdyn
    arm = refdyn.Model("models/manipulator.lua", n_rfe=4)
    arm.qdd(arm.q0, arm.qd0)
"""
TYPE_CHECKING = False  # type checkers know the name; `typing` takes longer to import than this package
if TYPE_CHECKING:
    from .casadi_functions import CasadiFunctions
    from .cases import Grid, grid
    from .fitting import Fit
    from .inline import Page
    from .model import Model
    from .motion import Motion
    from .planning import Measure, Plan, at_end, integral, largest
    from .program import ModelError, ModelWarning, NumericalError, prefix
    from .quantity import Quantity
    from .sampling import log_uniform, normal, sample, uniform
    from .urdf import Limits

    __version__: str

__all__ = ["CasadiFunctions", "Fit", "Grid", "Limits", "Measure", "Model", "ModelError", "ModelWarning", "Motion", "NumericalError", "Page", "Plan", "Quantity", "at_end", "grid", "integral", "largest",
           "log_uniform", "normal", "prefix", "sample", "uniform"]

# Modules are imported when their names are first used, since the command `refdyn` needs none of them.
_MODULES = {"Model": "model", "ModelError": "program", "ModelWarning": "program", "Motion": "motion", "NumericalError": "program", "Quantity": "quantity",
            "prefix": "program", "CasadiFunctions": "casadi_functions", "Fit": "fitting", "Grid": "cases", "Limits": "urdf", "Page": "inline", "grid": "cases", "log_uniform": "sampling",
            "Measure": "planning", "Plan": "planning", "at_end": "planning", "integral": "planning", "largest": "planning", "normal": "sampling", "sample": "sampling", "uniform": "sampling"}

if not TYPE_CHECKING:
    def __getattr__(name):
        if name == "__version__":
            from importlib.metadata import version
            value = version("refdyn")
        elif name in _MODULES:
            from importlib import import_module
            value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = value
        return value

    def __dir__():
        return sorted([*__all__, "__version__"])
