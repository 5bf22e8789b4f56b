"""A real browser, without a window: Chromium and its driver, as Debian brings them."""

import io
import json
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
NO_BROWSER = "no browser here: apt install chromium chromium-driver"
needs_browser = pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason=NO_BROWSER)
AXE = Path("tests/page/vendor/axe.min.js")


class Window:
    """One window; ``done`` looks at what it has asked for and complained about."""

    def __init__(self, width=1440, height=900, *, phone=False):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for word in (
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--disable-dev-shm-usage",
            "--disable-background-networking",
            "--no-first-run",
            "--disable-component-update",
        ):
            options.add_argument(word)
        if phone:
            options.add_experimental_option(
                "mobileEmulation", {"deviceMetrics": {"width": width, "height": height, "pixelRatio": 2, "touch": True}}
            )
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(DRIVER))
        if not phone:
            self.driver.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
            )
        self.asked = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.driver.quit()

    def open(self, url, at_most_s=20.0):
        """Open an address and wait until the page is ready; return how long that took [s]."""
        began = time.monotonic()
        self.driver.get(url)
        self.until("return document.body.dataset.ready === '1'", at_most_s)
        return time.monotonic() - began

    def js(self, text, *arguments):
        return self.driver.execute_script(text, *arguments)

    def until(self, text, at_most_s=20.0, *arguments):
        """Wait until a script returns something true, and return it."""
        until_s = time.monotonic() + at_most_s
        while not (found := self.js(text, *arguments)):
            assert time.monotonic() < until_s, f"never: {text}"
            time.sleep(0.1)
        return found

    def text(self, name):
        return self.js("return document.getElementById(arguments[0]).textContent", name)

    def click(self, selector):
        from selenium.webdriver.common.by import By

        self.driver.find_element(By.CSS_SELECTOR, selector).click()

    def keys(self, *keys):
        from selenium.webdriver.common.action_chains import ActionChains

        ActionChains(self.driver).send_keys(*keys).perform()

    def glaring(self):
        """Return how many pixels of what is seen would dazzle eyes that are used to the night: any colour but red."""
        seen = np.asarray(Image.open(io.BytesIO(self.driver.get_screenshot_as_png())).convert("RGB"), dtype=int)
        red, other = seen[:, :, 0], seen[:, :, 1:].max(axis=2)
        return int(((other > 60) & (other > 0.75 * red)).sum())

    def requests(self):
        """Return the addresses asked for so far."""
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                self.asked.append(message["params"]["request"]["url"])
        return self.asked

    def complaints(self):
        """Return what the console holds of errors and warnings since it was read last."""
        return [e["message"] for e in self.driver.get_log("browser") if e["level"] in {"SEVERE", "WARNING"}]

    def barriers(self):
        """Return what axe finds that keeps people out: serious and critical."""
        # the page's policy lets no script in but its own: axe is brought by the driver
        self.driver.execute_script(AXE.read_text())
        found = self.driver.execute_async_script(
            "const done = arguments[arguments.length - 1]; axe.run(document, {resultTypes: ['violations']})"
            ".then((r) => done(r.violations.map((v) => [v.impact, v.id, v.nodes.map((n) => n.target.join(' '))])))"
        )
        return [v for v in found if v[0] in {"serious", "critical"}]
