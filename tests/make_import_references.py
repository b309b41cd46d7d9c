"""Rewrites oracle/import.json: M, h and gravity of the robots in robots/, computed by Pinocchio (`pip install pin`).

python3 make_import_references.py
"""
import json

from program import TESTS, some
from urdf_by_pinocchio import Reference

if __name__ == "__main__":
    kept = {}
    for path in some((TESTS / "robots").glob("*.urdf")):
        reference = Reference(path.read_text())
        kept[path.stem] = {"coordinates": reference.coordinates, "states": list(reference.states(3, path.stem))}
    (TESTS / "oracle" / "import.json").write_text(json.dumps(kept, indent=1) + "\n")
