"""A headless Chromium that tests drive through its DevTools protocol, over a pipe: no driver, no port, no network."""

from __future__ import annotations

import base64
import contextlib
import json
import shutil
import subprocess
from pathlib import Path

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
QUIET = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking"
    " --disable-component-update --disable-sync --disable-dev-shm-usage --hide-scrollbars --mute-audio"
    " --remote-debugging-pipe"
).split()
PIPED = 'exec "$@" 3<&0 4>&1 0</dev/null 1>/dev/null'  # Chromium reads the protocol from 3 and answers at 4


class Browser:
    """One page of one Chromium with a profile of its own; for use in a `with`.

    ``said`` collects what the page writes to its console and the errors that it throws.
    """

    def __init__(self, profile: Path):
        self.said: list[str] = []
        self._serial, self._waiting, self._buffer = 0, [], b""
        self._process = subprocess.Popen(
            ["sh", "-c", PIPED, "sh", CHROMIUM or "chromium", *QUIET, f"--user-data-dir={profile}", "about:blank"],
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        target = next(t for t in self._call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self._session = self._call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, EOFError):
            self._call("Browser.close")
        self._process.wait(20)
        for pipe in (self._process.stdin, self._process.stdout):
            pipe.close()

    # -- what a reader does ----------------------------------------------------------------------------------------

    def show(self, page: Path, width: int = 1280, height: int = 800, dark: bool = False, printed: bool = False) -> None:
        """Open a file in a window of this size [px]."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", media="print" if printed else "", features=[scheme])
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        self.said.clear()
        self.call("Page.navigate", url=page.resolve().as_uri())
        self._until("Page.loadEventFired")
        self.settle()

    def settle(self) -> None:
        """Wait until what was asked for is drawn."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")

    def run(self, script: str):
        """The value of an expression in the page, awaited where it is a promise."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"]["exception"].get("description"))
        return answer["result"].get("value")

    def pointer(self, kind: str, x: float, y: float, clicks: int = 0) -> None:
        """Move, press or release the mouse at a place in the window [px]."""
        button = {"button": "left", "buttons": 1} if kind != "mouseMoved" or clicks else {}
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, clickCount=clicks, **button)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press at one place, release at another."""
        self.pointer("mousePressed", *start, 1)
        for share in (0.3, 0.7, 1.0):
            self.pointer("mouseMoved", *(a + share * (b - a) for a, b in zip(start, end)), 1)
        self.pointer("mouseReleased", *end, 1)
        self.settle()

    def press(self, key: str) -> None:
        """One key, with the character that it writes."""
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)
        self.settle()

    def picture(self) -> bytes:
        """The whole page as PNG."""
        size = self.call("Page.getLayoutMetrics")["cssContentSize"]
        clip = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        got = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
        return base64.b64decode(got["data"])

    # -- the protocol ----------------------------------------------------------------------------------------------

    def call(self, method: str, **parameters) -> dict:
        """One command of the protocol to the page, and its answer."""
        return self._call(method, self._session, **parameters)

    def _call(self, method: str, session: str | None = None, **parameters) -> dict:
        self._serial += 1
        message = {"id": self._serial, "method": method, "params": parameters}
        text = json.dumps(message | ({"sessionId": session} if session else {}))
        self._process.stdin.write(text.encode() + b"\0")
        while (got := self._next()).get("id") != message["id"]:
            self._waiting.append(got.get("method"))
        if "error" in got:
            raise RuntimeError(f"{method}: {got['error']['message']}")
        return got["result"]

    def _until(self, event: str) -> None:
        while event not in self._waiting:
            self._waiting.append(self._next().get("method"))
        self._waiting.clear()

    def _next(self) -> dict:
        while b"\0" not in self._buffer:
            if not (read := self._process.stdout.read(1 << 20)):
                raise EOFError("Chromium has ended")
            self._buffer += read
        line, _, self._buffer = self._buffer.partition(b"\0")
        message = json.loads(line)
        self._note(message.get("method"), message.get("params") or {})
        return message

    def _note(self, method: str | None, parameters: dict) -> None:
        if method == "Runtime.consoleAPICalled":
            self.said.append(" ".join(str(a.get("value", a.get("description"))) for a in parameters["args"]))
        elif method == "Runtime.exceptionThrown":
            self.said.append(parameters["exceptionDetails"].get("exception", {}).get("description", "an error"))
        elif method == "Log.entryAdded":
            self.said.append(parameters["entry"]["text"])
