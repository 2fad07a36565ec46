"""Firefox on a screen in memory, driven by its own protocol (Marionette: JSON over a socket): nothing is downloaded.

Headless Firefox has no WebGL without a graphics card, so it is shown on Xvfb, where Mesa draws in software.
"""

import base64
import json
import os
import socket
import subprocess
import time
from pathlib import Path
from typing import Any

_SETTINGS = {
    "marionette.port": 0,  # a free one; it is written to the profile
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "webgl.force-enabled": True,
}


class Firefox:
    """One window. Close it in any case.

    Raises:
        TimeoutError: the browser does not come up.
    """

    def __init__(self, program: str, profile: Path, patience_s: float = 120.0) -> None:
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in _SETTINGS.items()]
        (profile / "user.js").write_text("".join(lines))
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        told, tells = os.pipe()
        screen = ["Xvfb", "-displayfd", str(tells), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]
        self._screen = subprocess.Popen(screen, pass_fds=[tells], **quiet)
        os.close(tells)
        with os.fdopen(told) as lines_of_screen:
            display = lines_of_screen.readline().strip()
        arguments = [program, "--no-remote", "--marionette", "--profile", str(profile)]
        environment = {**os.environ, "DISPLAY": f":{display}", "LIBGL_ALWAYS_SOFTWARE": "1"}
        self._process = subprocess.Popen(arguments, env=environment, **quiet)
        self._socket: socket.socket | None = None
        self._count = 0
        try:
            self._connect(profile / "MarionetteActivePort", time.monotonic() + patience_s)
        except BaseException:
            self.close()
            raise

    def _connect(self, port_file: Path, deadline: float) -> None:
        while not (port_file.is_file() and port_file.read_text().strip()):
            if time.monotonic() > deadline or self._process.poll() is not None:
                raise TimeoutError("Firefox did not come up")
            time.sleep(0.1)
        self._socket = socket.create_connection(("127.0.0.1", int(port_file.read_text())), timeout=300)
        self._receive()  # who it is
        self.command("WebDriver:NewSession", {"capabilities": {"alwaysMatch": {"acceptInsecureCerts": False}}})

    def _receive(self) -> Any:
        assert self._socket is not None
        length = b""
        while not length.endswith(b":"):
            length += self._socket.recv(1)
        wanted, text = int(length[:-1]), b""
        while len(text) < wanted:
            text += self._socket.recv(wanted - len(text))
        return json.loads(text)

    def command(self, name: str, parameters: dict[str, Any] | None = None) -> Any:
        """Run one command; return its value."""
        assert self._socket is not None
        self._count += 1
        message = json.dumps([0, self._count, name, parameters or {}])
        self._socket.sendall(f"{len(message)}:{message}".encode("ascii"))
        _, _, fault, result = self._receive()
        if fault:
            raise RuntimeError(f"{name}: {fault['error']}: {fault['message']}")
        return result.get("value", result) if isinstance(result, dict) else result

    def open(self, url: str, width: int, height: int) -> None:
        """Open a page in a window of some size."""
        self.command("WebDriver:SetWindowRect", {"width": width, "height": height})
        self.command("WebDriver:Navigate", {"url": url})

    def evaluate(self, script: str) -> Any:
        """Return what a script returns."""
        return self.command("WebDriver:ExecuteScript", {"script": script, "args": []})

    def wait_for(self, selector: str, patience_s: float = 120.0) -> None:
        """Wait until an element is there."""
        deadline = time.monotonic() + patience_s
        while not self.evaluate(f"return document.querySelector({json.dumps(selector)}) !== null"):
            if time.monotonic() > deadline:
                raise TimeoutError(f"no {selector} on the page")
            time.sleep(0.2)

    def write(self, selector: str, text: str) -> None:
        """Type into an element, key by key."""
        element = self.command("WebDriver:FindElement", {"using": "css selector", "value": selector})
        self.command("WebDriver:ElementSendKeys", {"id": next(iter(element.values())), "text": text})

    def screenshot(self) -> bytes:
        """Return what is on the screen, PNG."""
        return base64.b64decode(self.command("WebDriver:TakeScreenshot", {"full": False}))

    def close(self) -> None:
        """End the browser."""
        if self._socket is not None:
            self._socket.close()
        for process in (self._process, self._screen):
            process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
