"""A page in Debian's headless chromium, controlled over the two pipes of its DevTools protocol."""

import base64
import json
import os
import select
import shutil
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

#: Command of the browser; None where it is not installed.
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium")
OPTIONS = (
    *("--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--disable-extensions", "--mute-audio"),
    *("--disable-background-networking", "--disable-component-update", "--no-first-run", "--disable-sync"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars", "--disable-dev-shm-usage"),
)


class Browser:
    """The browser process, with one page."""

    def __init__(self, folder, patience=60.0):
        self.patience, self.number, self.events = patience, 0, []
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()
        os.set_inheritable(to_browser, True)
        os.set_inheritable(from_browser, True)
        # the protocol wants descriptors 3 and 4; a shell puts them there
        exchange = f'exec 3<&{to_browser} 4>&{from_browser}; exec "$@"'
        command = ["bash", "-c", exchange, "bash", CHROMIUM, *OPTIONS, f"--user-data-dir={folder}", "about:blank"]
        environment = os.environ | {"HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "XDG_CACHE_HOME": str(folder)}
        self.process = subprocess.Popen(
            command,
            pass_fds=(to_browser, from_browser),
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self._rest, self.session = b"", None
        targets = self.ask("Target.getTargets")["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        self.session = self.ask("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.ask(f"{domain}.enable")

    def ask(self, method, **parameters):
        """The answer to a command; events received meanwhile go to `events`."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        message |= {"sessionId": self.session} if self.session else {}
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next(time.monotonic() + self.patience)
            if answer.get("id") == self.number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self.events.append(answer)

    def _next(self, until):
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._read], [], [], max(until - time.monotonic(), 0.0))
            assert ready, "the browser does not answer"
            piece = os.read(self._read, 1 << 20)
            assert piece, "the browser has ended"
            self._rest += piece
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def open(self, path, width=1400, height=1000, phone=False, dark=False):
        """Show a file and wait until its scripts have run."""
        self.events.clear()
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=2 if phone else 1,
            mobile=phone,
        )
        self.prefer(dark=dark)
        self.ask("Page.navigate", url=Path(path).resolve().as_uri())
        self.wait("document.readyState === 'complete' && document.title !== ''")
        self.pause()

    def prefer(self, dark=False, media=""):
        """Set the preferred colour scheme, and screen or print."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", media=media, features=[scheme])

    def run(self, expression):
        """Value of an expression in the page; raises its exceptions."""
        found = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def run_in_frame(self, expression):
        """`run` in the isolated frame, which has a process of its own."""
        with self._of(lambda target: target["type"] == "iframe"):
            return self.run(expression)

    @contextmanager
    def opened(self, url):
        """Work in the window opened by the page, and close it at the end."""
        with self._of(lambda target: target["url"] == url) as target:
            yield
            self.ask("Page.close")
        assert target["type"] == "page"

    @contextmanager
    def _of(self, is_wanted, seconds=20.0):
        """Work in another target, as soon as it exists."""
        page, self.session = self.session, None
        try:
            until = time.monotonic() + seconds
            while not (found := [t for t in self.ask("Target.getTargets")["targetInfos"] if is_wanted(t)]):
                assert time.monotonic() < until, "no such window"
                time.sleep(0.03)
            self.session = self.ask("Target.attachToTarget", targetId=found[0]["targetId"], flatten=True)["sessionId"]
            yield found[0]
        finally:
            self.session = page

    def wait(self, expression, seconds=20.0):
        """Until an expression is true."""
        until = time.monotonic() + seconds
        while not self.run(expression):
            assert time.monotonic() < until, f"never true: {expression}"
            time.sleep(0.03)

    def pause(self):
        """Wait until requested changes have been painted."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30))))")

    def press(self, key, text=""):
        """Press and release a key."""
        code = {"key": key} | ({"text": text} if text else {})
        code["windowsVirtualKeyCode"] = {"ArrowLeft": 37, "ArrowRight": 39, "Home": 36, "End": 35, "Tab": 9}.get(key, 0)
        self.ask("Input.dispatchKeyEvent", type="keyDown", **code)
        self.ask("Input.dispatchKeyEvent", type="keyUp", **code)
        self.pause()

    def errors(self):
        """Console errors and uncaught exceptions."""
        self.run("0")
        found = [e["params"] for e in self.events if e.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")]
        calls = [e["params"] for e in self.events if e.get("method") == "Runtime.consoleAPICalled"]
        return found + [c for c in calls if c["type"] in ("error", "warning", "assert")]

    def requests(self):
        """Addresses requested by the page, except those blocked by its policy."""
        named = {"Network.requestWillBeSent": [], "Network.loadingFailed": []}
        for event in self.events:
            named.get(event.get("method"), []).append(event.get("params"))
        stopped = {e["requestId"] for e in named["Network.loadingFailed"] if e.get("blockedReason") == "csp"}
        return [e["request"]["url"] for e in named["Network.requestWillBeSent"] if e["requestId"] not in stopped]

    def choose(self, name, value):
        """Set the element with this id to a value (JavaScript), as a user would."""
        self.run(
            f"(() => {{ const e = document.getElementById('{name}'); e.value = {value}; "
            "e.dispatchEvent(new Event(e.type === 'range' ? 'input' : 'change')); })()"
        )

    def picture(self, path=None, whole=True):
        """PNG of the whole page or of the visible part."""
        found = self.ask("Page.captureScreenshot", captureBeyondViewport=whole, **self._clip(whole))
        image = base64.b64decode(found["data"])
        if path is not None:
            Path(path).write_bytes(image)
        return image

    def _clip(self, whole):
        if not whole:
            return {}
        size = self.ask("Page.getLayoutMetrics")["cssContentSize"]
        return {"clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}}

    def paper(self, path=None):
        """PDF of the page as printed."""
        found = self.ask(
            "Page.printToPDF", printBackground=True, preferCSSPageSize=True, paperWidth=8.27, paperHeight=11.69
        )
        printed = base64.b64decode(found["data"])
        if path is not None:
            Path(path).write_bytes(printed)
        return printed

    def close(self):
        """End the process, gracefully if possible."""
        os.close(self._write)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self._read)


@contextmanager
def browser(folder):
    """A Browser with its files in `folder`."""
    opened = Browser(folder)
    try:
        yield opened
    finally:
        opened.close()
