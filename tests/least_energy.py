"""Least energy under equations, for formulas written in a test: the reference for equilibria."""
import numpy

STEP = 1e-30  # step of complex differences, which have no cancellation


def gradient(function, x):
    """Gradient of a function of an array by complex differences: one row for each of its values."""
    return numpy.array([numpy.imag(function(x + 1j * STEP * unit)) / STEP for unit in numpy.eye(len(x))]).T


def curvature(energy, rows, force, x, h=1e-5):
    """Curvature of energy + force . rows."""
    slope = lambda y: gradient(energy, y) + force @ gradient(rows, y)
    return numpy.array([(slope(x + h * unit) - slope(x - h * unit)) / (2 * h) for unit in numpy.eye(len(x))])


def look(energy, rows, x):
    """Correction onto the rows, a basis of the directions that they leave free, the multipliers, and the curvature in that basis."""
    slope, J = gradient(energy, x), gradient(rows, x)
    onto = -numpy.linalg.pinv(J, rcond=1e-6) @ rows(x)
    _, sizes, basis = numpy.linalg.svd(J)
    Z = basis[(sizes > 1e-6 * sizes[0]).sum():].T
    force = -numpy.linalg.lstsq(J.T, slope, rcond=1e-6)[0]
    H = curvature(energy, rows, force, x)
    values, vectors = numpy.linalg.eigh(Z.T @ (H + H.T) @ Z / 2)
    return onto, Z @ vectors, force, values, vectors.T @ Z.T @ (slope + H @ onto)


def meet(rows, x):
    """Moves x onto the rows."""
    for _ in range(30):
        x = x - numpy.linalg.pinv(gradient(rows, x), rcond=1e-3) @ rows(x)
    return x


def least_energy(energy, rows, x, reach=0.3):
    """x and the multipliers where the energy downhill from x is least and rows(x) = 0. Rows may be redundant."""
    x = numpy.array(x, float)
    for _ in range(500):
        onto, free, force, values, downhill = look(energy, rows, x)
        step = onto - free @ (downhill / numpy.maximum(abs(values), 1e-9))
        size = abs(step).max()
        x = meet(rows, x + step * min(1, reach / size))
        if size < 1e-13:
            break
    assert size < 1e-11 and (values > 0).all(), (size, values)
    return x, force


def negative_directions(energy, rows, x):
    """Number of directions in which the energy decreases from an equilibrium, and its largest slope along the rows."""
    onto, _, _, values, downhill = look(energy, rows, numpy.array(x, float))
    return int((values < 0).sum()), max(abs(onto).max(), abs(downhill).max())
