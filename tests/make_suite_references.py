"""Rewrites oracle/suite_*.json: each case by two methods at tight tolerances, which must agree.

REFDYN=../build/release/bin/refdyn /usr/bin/python3 make_suite_references.py [CASE...]
"""
import json
import sys

from program import TESTS
from suite import CASES, error, observed, run

AGREEMENT = 1e-10


def reference(case):
    (first, _), (second, _) = [run(case, "--method", *how, timeout=580) for how in case.references]
    columns = {name: first[name] for name in observed(first)}
    between = error(second, columns)
    assert between <= AGREEMENT, f"{case.name}: the methods differ by {between:.1e}"
    return {"about": f"{case.model.name} {case.values}: {case.extreme}", "methods": [" ".join(how) for how in case.references],
            "between": float(f"{between:.1e}"), "t": first["t"].tolist(),
            "columns": {name: values.tolist() for name, values in columns.items()}}


if __name__ == "__main__":
    for case in CASES:
        if len(sys.argv) == 1 or case.name in sys.argv[1:]:
            found = reference(case)
            (TESTS / "oracle" / f"{case.oracle}.json").write_text(json.dumps(found, indent=1) + "\n")
            print(f"{case.name}: methods differ by {found['between']:.1e}", flush=True)
