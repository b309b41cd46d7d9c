"""Refdyn: equations of motion of robots with flexible links, evaluated on NumPy arrays by compiled C.

    import refdyn
    arm = refdyn.Model("models/manipulator.lua", n_rfe=4)
    arm.qdd(arm.q0, arm.qd0)
"""
TYPE_CHECKING = False  # type checkers know the name; `typing` takes longer to import than this package
if TYPE_CHECKING:
    from .model import Model
    from .motion import Motion
    from .program import ModelError, ModelWarning, NumericalError, prefix
    from .quantity import Quantity

    __version__: str

__all__ = ["Model", "ModelError", "ModelWarning", "Motion", "NumericalError", "Quantity", "prefix"]

# Modules are imported when their names are first used, since the command `refdyn` needs none of them.
_MODULES = {"Model": "model", "ModelError": "program", "ModelWarning": "program", "Motion": "motion", "NumericalError": "program", "Quantity": "quantity", "prefix": "program"}

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
        return sorted({*globals(), *__all__, "__version__"})
