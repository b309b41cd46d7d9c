"""How the tests of `tests/long` open a page in Firefox: headless, driven by WebDriver BiDi (https://w3c.github.io/webdriver-bidi) through a
WebSocket (RFC 6455), of which this file has as much as it needs."""
import base64
import json
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import tempfile

from browser import Page

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
# No first page and no network at the start.
PREFERENCES = {"browser.startup.page": 0, "datareporting.policy.dataSubmissionEnabled": False, "app.update.enabled": False, "network.dns.disabled": True,
               "browser.shell.checkDefaultBrowser": False}


class WebSocket:
    """Texts from and to a server, each in one message."""

    def __init__(self, port, path):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60 * float(os.environ.get("REFDYN_SLOWNESS", "1")))
        self.file = self.socket.makefile("rb")
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
                            "Sec-WebSocket-Version: 13\r\n\r\n".encode())
        status = self.file.readline()
        assert b" 101 " in status, status
        while self.file.readline().strip():
            pass

    def send(self, text):
        """A text of at most 65535 bytes."""
        data, mask = text.encode(), os.urandom(4)
        masked = bytes(byte ^ mask[i % 4] for i, byte in enumerate(data))
        length = struct.pack("!B", 0x80 | len(data)) if len(data) < 126 else struct.pack("!BH", 0x80 | 126, len(data))
        self.socket.sendall(b"\x81" + length + mask + masked)

    def receive(self):
        """The next text; frames of one message are joined, and pings are left unanswered."""
        parts, is_last = [], False
        while not is_last:
            first, length = self.file.read(2)
            if length >= 126:
                (length,) = struct.unpack("!H" if length == 126 else "!Q", self.file.read(2 if length == 126 else 8))
            data = self.file.read(length)
            if first & 0x0F in (0, 1):
                parts.append(data)
                is_last = bool(first & 0x80)
        return b"".join(parts).decode()

    def close(self):
        self.file.close()
        self.socket.close()


class Firefox(Page):
    """A page that stays open. Use it in a `with` statement."""

    def __init__(self, page, fragment=""):
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        preferences = "".join(f'user_pref("{name}", {json.dumps(value)});\n' for name, value in PREFERENCES.items())
        (pathlib.Path(self.profile.name) / "user.js").write_text(preferences)
        self.process = subprocess.Popen([FIREFOX, "--headless", "--no-remote", "--profile", self.profile.name, "--remote-debugging-port", "0", "about:blank"],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env={**os.environ, "HOME": self.profile.name})
        try:
            self._connect()
            self.call("browsingContext.navigate", context=self.context, url=pathlib.Path(page).as_uri() + fragment, wait="complete")
        except BaseException:
            self.__exit__()
            raise

    def _connect(self):
        port, self.socket, self.count, self.console = None, None, 0, []
        while port is None:
            line = self.process.stderr.readline()
            assert line, "Firefox has ended"
            port = re.search(r"listening on ws://127\.0\.0\.1:(\d+)", line)
        self.socket = WebSocket(int(port[1]), "/session")
        self.call("session.new", capabilities={})
        self.call("session.subscribe", events=["log.entryAdded"])
        self.context = self.call("browsingContext.getTree")["contexts"][0]["context"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.socket:
            self.socket.close()
        self.process.terminate()
        self.process.stderr.close()
        self.process.wait(timeout=20)
        self.profile.cleanup()

    def call(self, method, **parameters):
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.receive())
            if message.get("method") == "log.entryAdded":
                self.console.append(json.dumps(message["params"])[:2000])
            if message.get("id") == self.count:
                assert message["type"] == "success", message
                return message["result"]

    def ask(self, script):
        """The result of `script`, the body of an asynchronous function."""
        done = self.call("script.evaluate", expression="(async () => JSON.stringify(await (async () => {" + script + "})()))()",
                         target={"context": self.context}, awaitPromise=True)
        assert done["type"] == "success", done
        return json.loads(done["result"].get("value", "null"))
