"""How the tests open a page: headless Chromium without a network, with WebGL rendered in software."""
import base64
import fcntl
import json
import os
import pathlib
import re
import shutil
import select
import subprocess
import tempfile
import time
import zlib

from program import LEAN

CHROMIUM = shutil.which("chromium") or "chromium"
OPTIONS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
           "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND", "--window-size=1400,900"]

SHOWN = "document.documentElement.dataset.state === 'shown'"


def program_of(text):
    """The bytes of the script that a page unpacks and runs."""
    packed = re.search(r'<script type="application/json" id="program">(.*?)</script>', text, re.S)[1]
    return zlib.decompress(base64.b64decode(json.loads(packed)))


def run(page, fragment, *options):
    """The finished process; the profile is of this call alone."""
    if LEAN:
        import pytest
        pytest.skip("pages are the same from both builds")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        return subprocess.run([CHROMIUM, *OPTIONS, f"--user-data-dir={profile}", *options, pathlib.Path(page).as_uri() + fragment],
                              capture_output=True, text=True, timeout=60 * float(os.environ.get("REFDYN_SLOWNESS", "1")))


def ask(page, script, fragment=""):
    """Returns the result of `script`, the body of a function that runs when the page is shown, and the messages of the console."""
    with Session(page, fragment) as session:
        session.wait(SHOWN)
        return session.ask(script), session.console


def photograph(page, fragment, picture, *options):
    """Saves a picture of the page as PNG."""
    done = run(page, fragment, "--virtual-time-budget=2000", *options, f"--screenshot={picture}")
    assert pathlib.Path(picture).exists(), done.stderr[-2000:]


LEFT = ("Inspected target navigated or closed", "Execution context was destroyed.")


class Left(AssertionError):
    """The browser went to another page while a question was open."""


class Page:
    """A page that stays open, in some browser: ask(script) returns what the body of an asynchronous function returns."""

    def wait(self, condition, seconds=30):
        """Until an expression is true; returns its value."""
        deadline = time.monotonic() + seconds * float(os.environ.get("REFDYN_SLOWNESS", "1"))
        while time.monotonic() < deadline:
            try:
                value = self.ask(f"try {{ return {condition}; }} catch (error) {{ return false; }}")
            except Left:
                value = None
            if value:
                return value
            time.sleep(0.02)
        raise AssertionError(f"never true: {condition}; {self.console}")


class Session(Page):
    """A page that stays open in Chromium, driven by the DevTools protocol through two pipes. Use it in a `with` statement."""

    def __init__(self, page, fragment="", window="1400,900"):
        if LEAN:
            import pytest
            pytest.skip("pages are the same from both builds")
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        ours, theirs = self._pipes()
        self.process = subprocess.Popen(
            [CHROMIUM, *OPTIONS, f"--window-size={window}", f"--user-data-dir={self.profile.name}", "--remote-debugging-pipe", "about:blank"],
            pass_fds=(3, 4), preexec_fn=lambda: (os.dup2(theirs[0], 3), os.dup2(theirs[1], 4)), stderr=subprocess.DEVNULL)
        for file in theirs:
            os.close(file)
        self.file_in, self.file_out = ours
        self.left, self.count, self.session, self.console = b"", 0, None, []
        (target,) = [one for one in self.call("Target.getTargets")["targetInfos"] if one["type"] == "page"]
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Page.navigate", url=pathlib.Path(page).as_uri() + fragment)

    @staticmethod
    def _pipes():
        """File descriptors above those that the browser reads (3) and writes (4)."""
        high = lambda file: fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, 20)  # noqa: E731
        (read_in, write_in), (read_out, write_out) = os.pipe(), os.pipe()
        files = [high(file) for file in (read_in, write_in, read_out, write_out)]
        for file in (read_in, write_in, read_out, write_out):
            os.close(file)
        return (files[2], files[1]), (files[0], files[3])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.file_out)
        self.process.terminate()
        self.process.wait(timeout=20)
        os.close(self.file_in)
        self.profile.cleanup()

    def _message(self, deadline):
        while b"\0" not in self.left:
            assert select.select([self.file_in], [], [], max(0, deadline - time.monotonic()))[0], "the browser does not answer"
            part = os.read(self.file_in, 1 << 20)
            assert part, "the browser has ended"
            self.left += part
        text, _, self.left = self.left.partition(b"\0")
        message = json.loads(text)
        if message.get("method") in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"):
            self.console.append(json.dumps(message["params"])[:2000])
        return message

    def call(self, method, **parameters):
        self.count += 1
        asked = {"id": self.count, "method": method, "params": parameters, **({"sessionId": self.session} if self.session else {})}
        os.write(self.file_out, json.dumps(asked).encode() + b"\0")
        deadline = time.monotonic() + 60 * float(os.environ.get("REFDYN_SLOWNESS", "1"))
        while True:
            message = self._message(deadline)
            if message.get("id") == self.count:
                if "error" in message:
                    raise (Left if message["error"]["message"] in LEFT else AssertionError)(message)
                return message["result"]

    def ask(self, script):
        """The result of `script`, the body of an asynchronous function."""
        done = self.call("Runtime.evaluate", expression="(async () => {" + script + "})()", awaitPromise=True, returnByValue=True,
                         allowUnsafeEvalBlockedByCSP=False)
        assert "exceptionDetails" not in done, done["exceptionDetails"].get("exception", done["exceptionDetails"])
        return done["result"].get("value")

    def press(self, key):
        code = {"ArrowRight": 39, "ArrowLeft": 37}[key]
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)
