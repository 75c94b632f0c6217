#!/usr/bin/env python3
"""browser.py: Chromium without a window, driven by chromedriver over the WebDriver protocol (W3C), and its pictures.

MISSING names those of Debian's chromium and chromium-driver that are not installed."""
import base64
import json
import re
import shutil
import struct
import subprocess
import time
import urllib.error
import urllib.request
import zlib

CHROMIUM = shutil.which("chromium")
MISSING = [package for package, tool in (("chromium", "chromium"), ("chromium-driver", "chromedriver"))
           if not shutil.which(tool)]
DIRECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # bypass proxies for this machine
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
KEYS = {"Space": "\ue00d", "End": "\ue010", "Home": "\ue011", "Left": "\ue012", "Up": "\ue013", "Right": "\ue014",
        "Down": "\ue015", "Tab": "\ue004", "Enter": "\ue007"}


class Browser:
    def __init__(self, width=1280, height=900, further=()):
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                       text=True)
        self.url = None
        for line in self.driver.stdout:
            found = re.search(r"successfully on port (\d+)", line)
            if found:
                self.url = f"http://127.0.0.1:{found.group(1)}"
                break
        options = {"binary": CHROMIUM, "args": [
            "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--hide-scrollbars", "--force-device-scale-factor=1",
            f"--window-size={width},{height}", *further]}
        made = self.ask("POST", "/session", {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.url += f"/session/{made['sessionId']}"

    def ask(self, method, path, body=None):
        data = json.dumps(body).encode() if body is not None else None
        request = urllib.request.Request(self.url + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with DIRECT.open(request, timeout=1800) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(f"{path}: {json.load(error)['value']['message'][:500]}") from None

    def close(self):
        try:
            self.ask("DELETE", "")
        finally:
            self.driver.terminate()
            self.driver.wait()

    def open(self, path):
        self.ask("POST", "/url", {"url": "file://" + path})

    def run(self, script, *arguments):
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def find(self, selector):
        return self.ask("POST", "/element", {"using": "css selector", "value": selector})[ELEMENT]

    def click(self, selector):
        self.ask("POST", f"/element/{self.find(selector)}/click", {})

    def keys(self, selector, *names):
        """Sends keys to an element, which takes the focus."""
        self.run("document.querySelector(arguments[0]).focus()", selector)
        for name in names:
            key = KEYS.get(name, name)
            self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": [
                {"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]}]})

    def hover(self, selector, x, y):
        """Moves the pointer to a position relative to an element's middle, in pixels."""
        self.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [
            {"type": "pointerMove", "duration": 0, "origin": {ELEMENT: self.find(selector)}, "x": x, "y": y}]}]})

    def drag(self, selector, x, y):
        """Drags from an element's middle by x, y pixels."""
        origin = {ELEMENT: self.find(selector)}
        self.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [
            {"type": "pointerMove", "duration": 0, "origin": origin, "x": 0, "y": 0}, {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "duration": 50, "origin": origin, "x": x, "y": y}, {"type": "pointerUp", "button": 0}]}]})

    def tools(self, command, **parameters):
        """Sends a command of the DevTools."""
        return self.ask("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def log(self):
        return [entry["message"] for entry in self.ask("POST", "/se/log", {"type": "browser"})]

    def picture(self, selector):
        return read_png(base64.b64decode(self.ask("GET", f"/element/{self.find(selector)}/screenshot")))

    def wait(self, script, *arguments, seconds=60):
        """Waits until the script returns something true; returns it."""
        end = time.monotonic() + seconds
        while True:
            value = self.run(script, *arguments)
            if value:
                return value
            if time.monotonic() > end:
                raise RuntimeError(f"not in {seconds} s: {script}")
            time.sleep(0.05)


def read_png(data):
    """Returns width, height and rows of (r, g, b) of an eight-bit PNG."""
    at, packed, head = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            head = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, depth, colour = head
    assert depth == 8 and colour in (2, 6), head
    size, raw = 3 if colour == 2 else 4, zlib.decompress(packed)
    stride, rows, before = size * width, [], bytes(size * width)
    for y in range(height):
        way, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for k in range(stride):
            left, up, corner = row[k - size] if k >= size else 0, before[k], before[k - size] if k >= size else 0
            if way == 1:
                row[k] = row[k] + left & 255
            elif way == 2:
                row[k] = row[k] + up & 255
            elif way == 3:
                row[k] = row[k] + (left + up) // 2 & 255
            elif way == 4:
                guess = left + up - corner
                a, b, c = abs(guess - left), abs(guess - up), abs(guess - corner)
                row[k] = row[k] + (left if a <= b and a <= c else up if b <= c else corner) & 255
        rows.append([tuple(row[k:k + 3]) for k in range(0, stride, size)])
        before = row
    return width, height, rows
