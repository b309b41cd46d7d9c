"""How the tests open a page: headless Chromium without a network, with WebGL rendered in software."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

from program import LEAN

CHROMIUM = shutil.which("chromium") or "chromium"
OPTIONS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
           "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND", "--window-size=1400,900"]


def run(page, fragment, *options):
    """The finished process; the profile is of this call alone."""
    if LEAN:
        import pytest
        pytest.skip("pages are the same from both builds")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        return subprocess.run([CHROMIUM, *OPTIONS, f"--user-data-dir={profile}", *options, pathlib.Path(page).as_uri() + fragment],
                              capture_output=True, text=True, timeout=60 * float(os.environ.get("REFDYN_SLOWNESS", "1")))


def ask(page, script, fragment=""):
    """Returns the result of `script`, the body of a function that runs when the page is ready, and the messages of the console."""
    text = page.read_text()
    end = text.rindex("</body>")
    probe = ("<script>const probe = document.createElement('pre'); probe.id = 'probe';\n"
             "probe.textContent = JSON.stringify((() => {" + script + "})()); document.body.append(probe);</script>\n")
    asked = page.with_suffix(".asked.html")
    asked.write_text(text[:end] + probe + text[end:])
    done = run(asked, fragment, "--enable-logging=stderr", "--dump-dom")
    found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.S)
    said = re.findall(r"CONSOLE.*", done.stderr)
    assert found, f"the page did not come to its end: {said} {done.stderr[-2000:]}"
    return json.loads(found.group(1).replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")), said


def photograph(page, fragment, picture, *options):
    """Saves a picture of the page as PNG."""
    done = run(page, fragment, "--virtual-time-budget=2000", *options, f"--screenshot={picture}")
    assert pathlib.Path(picture).exists(), done.stderr[-2000:]
