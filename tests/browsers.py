"""Browsers for the report's tests: Debian's chromium through Selenium, firefox-esr through its own WebDriver BiDi.

Both are offline: no host name resolves. What a page asks for and complains of is recorded by the browser itself.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import axe_core_python
import pytest

WAIT = 60.0  # seconds: a busy machine with one core draws a page in a tenth of that


def program(*names: str) -> str:
    """First of these programs on PATH; skips the test where there is none."""
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no {' or '.join(names)} on PATH: `make browsers` installs them")
    return found


class Chrome:
    """One headless chromium for many pages; `console` and `requests` are those since the last `open`."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def open(
        self,
        path: Path,
        anchor: str = "",
        size: tuple[int, int] = (1366, 768),
        scripts: bool = True,
        dark: bool = False,
        calm: bool = False,
        printed: bool = False,
    ) -> None:
        """Load the page afresh; `calm` asks for reduced motion, `printed` for the print style."""
        command = self.driver.execute_cdp_cmd
        command("Emulation.setScriptExecutionDisabled", {"value": not scripts})
        scheme, motion = "dark" if dark else "light", "reduce" if calm else "no-preference"
        wanted = {"prefers-color-scheme": scheme, "prefers-reduced-motion": motion}
        features = [{"name": name, "value": value} for name, value in wanted.items()]
        command("Emulation.setEmulatedMedia", {"media": "print" if printed else "", "features": features})
        # Exactly this, where a window has a least width.
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size[0] < 500}
        command("Emulation.setDeviceMetricsOverride", metrics)
        self.driver.get("about:blank")
        self.driver.get_log("browser")
        self.driver.get_log("performance")
        self.driver.get(path.as_uri() + anchor)

    def js(self, script: str, *arguments: Any) -> Any:
        """What the body of a function returns in the page."""
        return self.driver.execute_script(script, *arguments)

    def until(self, condition: str) -> None:
        """Wait until this expression holds in the page; fails after `WAIT`."""
        end = time.monotonic() + WAIT
        while not self.js(f"return Boolean({condition})"):
            assert time.monotonic() < end, f"never true: {condition}; console: {self.console()}"
            time.sleep(0.02)

    def console(self) -> list[str]:
        """Warnings and errors the page has caused."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] != "INFO"]

    def requests(self) -> list[str]:
        """Addresses the page asked for, its own included; `data:` and `blob:` hold their content themselves."""
        found = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        urls = [m["params"]["request"]["url"] for m in found if m["method"] == "Network.requestWillBeSent"]
        return [url for url in urls if not url.startswith(("data:", "blob:"))]


def busy(chrome: Chrome) -> float:
    """Processor seconds the page's main thread has spent in tasks."""
    metrics = chrome.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return float(next(m["value"] for m in metrics if m["name"] == "TaskDuration"))


def serious(chrome: Chrome) -> list[tuple[str, list[str]]]:
    """What axe-core calls serious or critical in the open page, with the first elements concerned."""
    chrome.js((Path(axe_core_python.__file__).parent / "axe.min.js").read_text(encoding="utf-8"))
    found = chrome.driver.execute_async_script("const done = arguments[0]; axe.run().then(done)")
    assert found["passes"]
    bad = [one for one in found["violations"] if one["impact"] in ("serious", "critical")]
    return [(one["id"], [node["html"][:200] for node in one["nodes"]][:5]) for one in bad]


@contextmanager
def open_chrome(*options: str) -> Iterator[Chrome]:
    """A headless chromium; skips where it or its driver is not installed."""
    from selenium.webdriver import Chrome as Driver
    from selenium.webdriver import ChromeOptions, ChromeService

    settings = ChromeOptions()
    settings.binary_location = program("chromium", "chromium-browser", "google-chrome")
    for option in ("--headless", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars"):
        settings.add_argument(option)
    settings.add_argument("--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE localhost")
    for option in options:
        settings.add_argument(option)
    settings.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = Driver(options=settings, service=ChromeService(program("chromedriver")))
    driver.set_script_timeout(WAIT)
    try:
        yield Chrome(driver)
    finally:
        driver.quit()


class Firefox:
    """One headless firefox-esr, spoken to over WebDriver BiDi; `console` and `requests` are those since `open`."""

    def __init__(self, socket: Any) -> None:
        self.socket, self.number, self.events = socket, 0, list[dict[str, Any]]()
        self.call("session.new", capabilities={})
        self.call("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])
        self.context = self.call("browsingContext.getTree")["contexts"][0]["context"]

    def call(self, method: str, **parameters: Any) -> Any:
        """Result of one command; events that arrive meanwhile are kept."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv())
            if message.get("id") == self.number:
                assert message["type"] == "success", message
                return message["result"]
            self.events.append(message)

    def open(self, path: Path, anchor: str = "") -> None:
        """Load the page and wait for its load event."""
        self.events.clear()
        self.call("browsingContext.navigate", context=self.context, url=path.as_uri() + anchor, wait="complete")

    def js(self, expression: str) -> Any:
        """Value of an expression in the page: a number, text or truth value."""
        target = {"context": self.context}
        found = self.call("script.evaluate", expression=expression, target=target, awaitPromise=True)
        assert found["type"] == "success", found
        return found["result"].get("value")

    def until(self, condition: str) -> None:
        """Wait until this expression holds in the page; fails after `WAIT`."""
        end = time.monotonic() + WAIT
        while not self.js(f"Boolean({condition})"):
            assert time.monotonic() < end, f"never true: {condition}; console: {self.console()}"
            time.sleep(0.05)

    def console(self) -> list[str]:
        """Warnings and errors the page has caused."""
        logged = [event["params"] for event in self.events if event.get("method") == "log.entryAdded"]
        return [str(entry["text"]) for entry in logged if entry["level"] in ("warn", "error")]

    def requests(self) -> list[str]:
        """Addresses the page asked for, its own included."""
        sent = [e["params"] for e in self.events if e.get("method") == "network.beforeRequestSent"]
        return [p["request"]["url"] for p in sent if not p["request"]["url"].startswith(("data:", "blob:"))]


@contextmanager
def open_firefox(profile: Path) -> Iterator[Firefox]:
    """A headless firefox-esr with this profile folder; skips where it is not installed."""
    from websocket import create_connection

    profile.mkdir(parents=True, exist_ok=True)
    # A proxy nobody listens on: offline, whatever the machine's network is.
    offline = {"network.proxy.type": 1, "network.proxy.http": "127.0.0.1", "network.proxy.http_port": 9}
    offline |= {"network.proxy.ssl": "127.0.0.1", "network.proxy.ssl_port": 9}
    lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in offline.items()]
    (profile / "user.js").write_text("\n".join(lines), encoding="utf-8")
    command = [program("firefox-esr", "firefox"), "--headless", "--no-remote", "--remote-debugging-port", "0"]
    log = profile / "stderr.log"
    with log.open("w") as errors:
        process = subprocess.Popen([*command, "--profile", str(profile)], stdout=errors, stderr=errors)
        try:
            socket = create_connection(f"{_address(process, log)}/session", timeout=WAIT, suppress_origin=True)
            yield Firefox(socket)
            socket.close()
        finally:
            process.terminate()
            process.wait(WAIT)


def _address(process: subprocess.Popen[bytes], log: Path) -> str:
    """Where Firefox says it listens."""
    end = time.monotonic() + WAIT
    while True:
        found = re.search(r"WebDriver BiDi listening on (ws://\S+)", log.read_text(errors="replace"))
        if found:
            return found[1]
        assert process.poll() is None, log.read_text(errors="replace")
        assert time.monotonic() < end, "Firefox does not listen"
        time.sleep(0.05)
