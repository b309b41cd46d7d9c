"""Minimax polynomials in any precision."""
import mpmath


def minimax(f, weight, low, high, degree):
    """Coefficients, lowest first, of the polynomial p that minimises the largest |weight(x) (p(x) - f(x))| on [low, high], by Remez'
    exchange."""
    count = degree + 2
    points = [(low + high) / 2 - (high - low) / 2 * mpmath.cos(mpmath.pi * (2 * i + 1) / (2 * count)) for i in range(count)]
    grid = [low + (high - low) * mpmath.mpf(i + 1) / 2000 for i in range(2000)]
    values = [(f(x), weight(x)) for x in grid]
    for _ in range(12):
        rows = [[x**k for k in range(degree + 1)] + [(-1)**i / weight(x)] for i, x in enumerate(points)]
        *p, level = mpmath.lu_solve(mpmath.matrix(rows), mpmath.matrix([f(x) for x in points]))
        error = [w * (mpmath.polyval(p[::-1], x) - y) for x, (y, w) in zip(grid, values)]
        points, best = [], None
        for i, e in enumerate(error):     # the largest error in each interval of one sign
            if best is not None and (e > 0) != (error[best] > 0):
                points.append(grid[best])
                best = None
            if best is None or abs(e) > abs(error[best]):
                best = i
        points.append(grid[best])
        assert len(points) == count, len(points)
        if max(map(abs, error)) < 1.0001 * abs(level):
            break
    return p, abs(level)
