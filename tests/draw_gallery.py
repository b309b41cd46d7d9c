#!/usr/bin/python3
"""Redraws the pictures of docs/gallery.md, all of them or the named ones: `draw_gallery.py [NAME ...]`.

The commands come from that page. The view of the camera is set here by a fragment of `refdyn view`'s page (docs/view.md). Each picture is
drawn at twice its size, then reduced with its own palette. Needs a build, Chromium and Pillow (`.ci/install build draw test`).
"""
import pathlib
import re
import shlex
import sys
import tempfile

from PIL import Image

import browser
from program import SOURCE, refdyn

PAGE = SOURCE / "docs" / "gallery.md"
PICTURES = SOURCE / "docs" / "gallery"
SIZE, SHARPNESS, COLOURS = (480, 360), 2, 128

SEEN = {
    "branched": "t=1.2&nearer=1.4&azimuth=-60",
    "bricard": "t=0.7&nearer=1.35",
    "chain": "t=0.5&nearer=1.25&azimuth=-70&height=15&up=0.02&right=-0.15",
    "crane": "t=2.5&nearer=1.35",
    "fivebar": "t=1.2&nearer=1.3&height=55",
    "fourbar": "t=0.4&nearer=1.3&azimuth=-70&up=-0.05",
    "gantry": "t=1.2&nearer=1.3",
    "jib": "t=3&nearer=1.25&right=-0.03&up=-0.03",
    "manipulator": "t=6&nearer=1.05&up=-0.02&right=0.22",
    "midspan": "t=0.5&nearer=1.25",
    "pendulum": "t=1&nearer=1.3&azimuth=-75",
    "planar": "t=2&nearer=1.3&right=0.12&height=40",
    "puma": "t=1.2&nearer=1.25&azimuth=110&up=-0.06",
    "scara": "t=0.5&nearer=1.35&azimuth=-40&up=-0.05",
    "slidercrank": "t=0.6&nearer=1.35&height=45",
    "spacearm": "t=6&nearer=1.45",
    "spinup": "t=2.4&nearer=1.3&height=60",
    "stepped": "t=0.01&nearer=1.25",
    "stewart": "t=1.3&nearer=1.2&up=-0.05",
    "writer": "t=6.8&nearer=1.15&azimuth=-25&height=40&up=0.07",
}


def commands():
    """The arguments of `refdyn sim`, without the output, by the model's name."""
    found = re.findall(r"`refdyn (sim models/(\w+)\.lua [^`]*) -o build/\2\.h5`", PAGE.read_text())
    return {name: shlex.split(command) for command, name in found}


def draw(name, command, folder):
    run, page, large = folder / f"{name}.h5", folder / f"{name}.html", folder / f"{name}.png"
    refdyn(*command, "-o", run, cwd=SOURCE)
    refdyn("view", run, "-o", page)
    browser.photograph(page, f"#alone=1&theme=light&{SEEN[name]}", large, f"--window-size={SIZE[0]},{SIZE[1]}",
                       f"--force-device-scale-factor={SHARPNESS}")
    with Image.open(large) as picture:
        small = picture.convert("RGB").resize(SIZE, Image.LANCZOS)
    small.quantize(COLOURS, method=Image.MEDIANCUT, dither=Image.Dither.NONE).save(PICTURES / f"{name}.png", optimize=True)


def main(names):
    known = commands()
    with tempfile.TemporaryDirectory() as folder:
        for name in names or sorted(known):
            if name not in known:
                sys.exit(f"draw_gallery.py: {PAGE.name} has no model '{name}', it has {', '.join(sorted(known))}")
            draw(name, known[name], pathlib.Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])
