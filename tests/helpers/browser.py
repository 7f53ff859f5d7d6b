"""A headless Chromium for tests.

It speaks the Chrome DevTools Protocol over two pipes, messages of JSON that
end with a zero byte, and needs no library. Unlike with a window's size, pages
may be narrower than 500 pixels.
"""

import base64
from contextlib import contextmanager
import fcntl
import json
import os
from pathlib import Path
import select
import shutil
import subprocess

# Numbers of the pipes that Chromium reads from and writes to.
_IN = 3
_OUT = 4
# Longest wait for an answer; only a broken page or browser takes so long [s].
_PATIENCE = 600.0
_KEYS = {"ArrowLeft": 37, "ArrowRight": 39, "Escape": 27, "Tab": 9, " ": 32}


def has_chromium() -> bool:
    return shutil.which("chromium") is not None


@contextmanager
def chromium(profile: Path, *options: str):
    """Yields a `Browser`; ends its process afterwards."""
    # These are higher than their numbers in the process.
    child_in, ours_out = (_high(fd) for fd in os.pipe())
    ours_in, child_out = (_high(fd) for fd in os.pipe())

    def connect() -> None:
        os.dup2(child_in, _IN)
        os.dup2(child_out, _OUT)

    process = subprocess.Popen(
        [
            "chromium",
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--remote-debugging-pipe",
            f"--user-data-dir={profile}",
            *options,
        ],
        preexec_fn=connect,
        pass_fds=(_IN, _OUT),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(child_in)
    os.close(child_out)
    try:
        yield Browser(ours_in, ours_out)
    finally:
        os.close(ours_out)
        os.close(ours_in)
        # It ends when its pipes are closed, or else it is killed.
        try:
            process.wait(timeout=600)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Browser:
    """One tab.

    Attributes:
        complaints: errors and warnings of the console, and exceptions, since
            the last page was opened.
    """

    def __init__(self, fd_in: int, fd_out: int):
        self._fd_in, self._fd_out = fd_in, fd_out
        self._received = b""
        self._last_id = 0
        self._num_loads = 0
        self._session: str | None = None
        self.complaints: list[str] = []
        target = self._send("Target.createTarget", url="about:blank")
        self._session = self._send(
            "Target.attachToTarget", targetId=target["targetId"], flatten=True
        )["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self._send(f"{domain}.enable")

    def open(
        self,
        address: str,
        width: int,
        height: int,
        scheme: str = "light",
        media: str = "screen",
    ) -> None:
        """Opens a page, on a screen of a size in pixels or on paper."""
        # An empty page between makes a page with another fragment load again.
        self._load("about:blank")
        self.complaints.clear()
        self._send(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self._send(
            "Emulation.setEmulatedMedia",
            media=media,
            features=[{"name": "prefers-color-scheme", "value": scheme}],
        )
        self._load(address)

    def evaluate(self, expression: str):
        """Returns the value of an expression, or of its promise."""
        answer = self._send(
            "Runtime.evaluate",
            expression=expression,
            awaitPromise=True,
            returnByValue=True,
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, condition: str) -> None:
        """Returns when a condition in the page holds."""
        self.evaluate(
            "new Promise((resolve) => { const look = () =>"
            f" ({condition}) ? resolve() : setTimeout(look, 10); look(); }})"
        )

    def picture(self) -> bytes:
        """Returns the screen as PNG."""
        answer = self._send("Page.captureScreenshot", format="png")
        return base64.b64decode(answer["data"])

    def press(self, key: str) -> None:
        for kind in ("keyDown", "keyUp"):
            self._send(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                code="Space" if key == " " else key,
                windowsVirtualKeyCode=_KEYS[key],
            )

    def click(self, x: float, y: float) -> None:
        """Clicks on a point of the screen."""
        self.drag((x, y))

    def drag(self, *places: tuple[float, float]) -> None:
        """Presses the mouse at the first place, and releases it at the last."""
        kinds = ["mousePressed", *["mouseMoved"] * (len(places) - 1)]
        for kind, (x, y) in zip(
            [*kinds, "mouseReleased"], [*places, places[-1]], strict=True
        ):
            self._send(
                "Input.dispatchMouseEvent",
                type=kind,
                x=x,
                y=y,
                button="left",
                clickCount=1,
            )

    def _load(self, address: str) -> None:
        before = self._num_loads
        self._send("Page.navigate", url=address)
        while self._num_loads == before:
            self._receive()

    def _send(self, method: str, **parameters):
        self._last_id += 1
        message = {"id": self._last_id, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._fd_out, json.dumps(message).encode() + b"\0")
        while (answer := self._receive()).get("id") != self._last_id:
            pass
        assert "error" not in answer, answer
        return answer["result"]

    def _receive(self) -> dict:
        while b"\0" not in self._received:
            ready, _, _ = select.select([self._fd_in], [], [], _PATIENCE)
            assert ready, "no answer from Chromium"
            part = os.read(self._fd_in, 1 << 16)
            assert part, "Chromium ended"
            self._received += part
        text, self._received = self._received.split(b"\0", 1)
        message = json.loads(text)
        self._note(message)
        return message

    def _note(self, message: dict) -> None:
        parameters = message.get("params", {})
        kind = message.get("method")
        if kind == "Page.loadEventFired":
            self._num_loads += 1
        elif kind == "Runtime.exceptionThrown":
            self.complaints.append(str(parameters["exceptionDetails"]))
        elif kind == "Runtime.consoleAPICalled":
            self.complaints.append(str(parameters["args"]))
        elif kind == "Log.entryAdded":
            self.complaints.append(str(parameters["entry"]))


def _high(fd: int) -> int:
    """Returns another number for a pipe, and closes the first."""
    other = fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 10)
    os.close(fd)
    return other
