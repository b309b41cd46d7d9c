"""Refdyn: equations of motion of robots with flexible links, evaluated on NumPy arrays by compiled C.

    import refdyn
    arm = refdyn.Model("models/manipulator.lua", n_rfe=4)
    arm.qdd(arm.q0, arm.qd0)
"""
from importlib.metadata import version as _version

from .model import Model
from .program import ModelError, ModelWarning, NumericalError, prefix
from .quantity import Quantity

__version__ = _version("refdyn")
__all__ = ["Model", "ModelError", "ModelWarning", "NumericalError", "Quantity", "prefix"]
