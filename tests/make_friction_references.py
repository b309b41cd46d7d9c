"""Rewrites oracle/friction.json: the scenes of friction_suite.py, from the equations written there, by SciPy's Radau method.

/usr/bin/python3 make_friction_references.py [SCENE...]
"""
import json
import sys
import time

import numpy
import scipy.integrate

from friction_suite import SAMPLES, SCENES, WIDTHS
from program import TESTS

PLACE = TESTS / "oracle" / "friction.json"
# Relative tolerance; absolute tolerance of positions [m, rad]; that of rates as a fraction of the width.
RELATIVE, POSITION, OF_WIDTH = 1e-13, 1e-14, 1e-5


def solve(scene, width):
    """(SAMPLES, coordinates)"""
    n, w = len(scene.start), float(width)

    def rates(t, y):
        return numpy.concatenate([y[n:], numpy.atleast_1d(scene.accelerations(t, y[:n] if n > 1 else y[0], y[n:] if n > 1 else y[1], w))])

    def jacobian(t, y):
        change = numpy.array([1e-7] * n + [1e-3 * w] * n)
        return numpy.array([(rates(t, y + e) - rates(t, y - e)) / (2 * h) for e, h in zip(numpy.diag(change), change)]).T

    found, y = [], numpy.array([*scene.start, *[0.0] * n], dtype=float)
    for i in range(SAMPLES):
        span = scene.until * i / SAMPLES, scene.until * (i + 1) / SAMPLES
        solution = scipy.integrate.solve_ivp(rates, span, y, method="Radau", jac=jacobian, rtol=RELATIVE,
                                             atol=[POSITION] * n + [OF_WIDTH * min(w, 1e-9)] * n, t_eval=[span[1]])
        assert solution.success, solution.message
        y = solution.y[:, -1]
        found.append(y[:n].tolist())
    return found


if __name__ == "__main__":
    kept = json.loads(PLACE.read_text()) if PLACE.exists() else {}
    for scene in SCENES:
        if len(sys.argv) > 1 and scene.name not in sys.argv[1:]:
            continue
        for width in WIDTHS:
            begun = time.time()
            kept.setdefault(scene.name, {})[width] = solve(scene, width)
            print(f"{scene.name} {width}: {time.time() - begun:.0f} s, {kept[scene.name][width][-1]}", flush=True)
            PLACE.write_text(json.dumps(kept, indent=1) + "\n")
