"""A headless Chromium, driven over its own pipe: no port, no other package."""

import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time
from base64 import b64decode
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "msedge")


def chromium() -> str:
    """The browser of this machine; without one the test is skipped, or fails where STICKSLIP_BROWSER=required."""
    for name in NAMES:
        if found := shutil.which(name):
            return found
    reason = f"no browser: install one of {', '.join(NAMES)}"
    if os.environ.get("STICKSLIP_BROWSER") == "required":
        pytest.fail(reason)
    pytest.skip(reason)


class Browser:
    """One page of a browser."""

    def __init__(self, width: int = 1440, height: int = 900) -> None:
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        (here, to), (back, there) = os.pipe(), os.pipe()
        command = [
            chromium(), "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
            "--remote-debugging-pipe", f"--user-data-dir={self._folder.name}", f"--window-size={width},{height}",
        ]  # fmt: skip

        def pipes() -> None:
            # The browser reads commands on 3 and writes answers on 4; neither may be taken before it is copied.
            ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (here, there)]
            for end, number in zip(ends, (3, 4), strict=True):
                os.dup2(end, number)

        self._process = subprocess.Popen(
            command, preexec_fn=pipes, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(here)
        os.close(there)
        self._to, self._from = os.fdopen(to, "wb"), os.fdopen(back, "rb")
        self._id, self._session = 0, None
        self._left = b""
        self.problems: list[str] = []
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")
        self.resize(width, height)

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._to.close()
        self._from.close()
        self._folder.cleanup()

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._left:
            more = os.read(self._from.fileno(), 1 << 20)
            if not more:
                raise EOFError("the browser ended")
            self._left += more
        message, _, self._left = self._left.partition(b"\0")
        return json.loads(message)

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the browser, and its answer."""
        self._id += 1
        session = {"sessionId": self._session} if self._session else {}
        self._to.write(json.dumps({"id": self._id, "method": method, "params": parameters, **session}).encode() + b"\0")
        self._to.flush()
        while True:
            message = self._message()
            if message.get("id") == self._id:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            if message.get("method") == "Runtime.exceptionThrown":
                details = message["params"]["exceptionDetails"]
                self.problems.append(str(details.get("exception", {}).get("description", details["text"])))
            if message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
                self.problems.append(message["params"]["entry"]["text"])

    def resize(self, width: int, height: int, scale: float = 1.0, touch: bool = False) -> None:
        """The window, as of a desktop or, with touch, of a phone."""
        self.send(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=touch
        )
        self.send("Emulation.setTouchEmulationEnabled", enabled=touch)

    def prefer(self, **features: str) -> None:
        """What the user prefers, such as prefers_color_scheme="dark"."""
        listed = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
        self.send("Emulation.setEmulatedMedia", features=listed)

    def open(self, address: str) -> None:
        """Open an address and wait until the explorer is there."""
        self.send("Page.navigate", url="about:blank")
        self.send("Page.navigate", url=address)
        self.wait("document.body?.dataset.ready === 'yes'")

    def run(self, script: str) -> Any:
        """The value of an expression in the page; a promise is waited for."""
        result = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def wait(self, condition: str, seconds: float = 120.0) -> None:
        """Wait until an expression is true: generous, as other work may hold the machine."""
        end = time.monotonic() + seconds
        while not self.run(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise TimeoutError(f"not true after {seconds:g} s: {condition}; {self.problems}")
            time.sleep(0.05)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Press, move or release the left button."""
        buttons = 0 if kind == "mouseReleased" else 1
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """From one point of the window to another."""
        self.mouse("mousePressed", *start)
        for share in (0.5, 1.0):
            self.mouse("mouseMoved", *(a + share * (b - a) for a, b in zip(start, end, strict=True)))
        self.mouse("mouseReleased", *end)

    def key(self, key: str) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=key)

    def screenshot(self, path: str | Path) -> None:
        """What the window shows."""
        data = self.send("Page.captureScreenshot", format="png")["data"]
        Path(path).write_bytes(b64decode(data))
