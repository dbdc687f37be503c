"""A browser for tests: QtWebEngine, which is Chromium, without a screen, in a process of its own.

The process reads a command a line of JSON and writes its answer. It ends with its input, so also if pytest is killed.
Each page has its own profile. Keys and clicks are events of the window system.
"""

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

#: at most, on a slow machine [s]: start of the engine, answer to a command, change of a page
STARTED, ANSWERED, CHANGED = 30.0, 60.0, 180.0
NEEDS = (
    'pip install --editable ".[test,browser]"; on Linux apt-get install libnss3 libasound2 libegl1 libgl1 '
    "libxkbcommon0 libxkbfile1 libxcomposite1 libxdamage1 libxrandr2 libxtst6"
)
#: without the sandbox, which root and most containers cannot have: it opens pages of the tests only
SETTINGS = {
    "QT_QPA_PLATFORM": "offscreen", "QTWEBENGINE_DISABLE_SANDBOX": "1",
    "QTWEBENGINE_CHROMIUM_FLAGS": "--disable-gpu --lang=en-US",
}  # fmt: skip


def lines_of(stream):
    """Queue of the lines of a stream, read in a thread; "" at its end."""
    lines = queue.Queue()
    threading.Thread(target=lambda: [*map(lines.put, stream), lines.put("")], daemon=True).start()
    return lines


class Browser:
    """The engine. RuntimeError: it does not start or has ended, with its last lines."""

    def __init__(self):
        self.folder, self.opened = tempfile.TemporaryDirectory(), 0
        self.log = Path(self.folder.name, "log")
        with self.log.open("w") as log:
            self.engine = subprocess.Popen(
                [sys.executable, __file__, self.folder.name], env=os.environ | SETTINGS, text=True,
                encoding="utf-8", stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
            )  # fmt: skip
        self.lines = lines_of(self.engine.stdout)
        self.open("about:blank", seconds=STARTED).close()

    def ask(self, name, *arguments, seconds=ANSWERED):
        """Answer to a command."""
        try:
            print(json.dumps([name, *arguments]), file=self.engine.stdin, flush=True)
            line = self.lines.get(timeout=seconds)
        except (OSError, queue.Empty):
            line = ""
        if not line:
            self.close()
            last = self.log.read_text(errors="replace")[-600:].strip()
            raise RuntimeError(f"no answer to {name} in {seconds:g} s: {last}")
        return json.loads(line)

    def open(self, address, width=1280, height=900, seconds=ANSWERED):
        """A new page, loaded."""
        self.opened += 1
        assert self.ask("open", self.opened, address, width, height, seconds=seconds), address
        return Page(self, self.opened)

    def close(self):
        """End the engine."""
        self.engine.kill()
        self.engine.wait()


class Page:
    """A page; other methods are those of Tab in the process of the engine."""

    def __init__(self, browser, number):
        self.browser, self.number, self.asked = browser, number, 0

    def __getattr__(self, name):
        return lambda *arguments: self.browser.ask(name, self.number, *arguments)

    def now(self, expression, selector="html"):
        """Value of an expression of the first element `one` of a selector."""
        text = self._json(expression, selector)
        assert text.startswith("["), f"{text}: {expression}; {self.messages()}"
        return json.loads(text)[0]

    def _json(self, expression, selector="html"):
        """Text of a list with the value, or of the error; "None" where a page has just been left."""
        body = f"try {{ return JSON.stringify([({expression})]); }} catch (error) {{ return `${{error}}`; }}"
        return str(self.run(f"((one) => {{ {body} }})(document.querySelector({json.dumps(selector)}))"))

    def evaluate(self, expression):
        """Value of an expression or of its promise."""
        self.asked += 1
        own = f"(globalThis.told ??= {{}})[{self.asked}]"
        done = f"(value) => {{ {own} = [value ?? null]; }}, (error) => {{ {own} = `${{error}}`; }}"
        self.now(f"void (async () => ({expression}))().then({done})")
        self.until(own, ANSWERED)
        value = self.now(own)
        assert isinstance(value, list), f"{value}: {expression}"
        return value[0]

    def until(self, condition, seconds=CHANGED):
        """Wait for a condition, an expression or a function; its value, true or not empty."""
        found = condition if callable(condition) else lambda: self._json(f"Boolean({condition})") == "[true]"
        end = time.monotonic() + seconds
        while not (value := found()):
            assert time.monotonic() < end, f"not in {seconds:g} s: {condition}; {self.messages()}"
            time.sleep(0.01)
        return value

    def text(self, selector):
        """Text of an element as it is shown."""
        return self.now("one.innerText", selector)

    def fill(self, selector, text):
        """Paste a text in the place of that of a field."""
        command = "insertText" if text else "delete"
        insert = f"document.execCommand('{command}', false, {json.dumps(text)})"
        taken = self.now("one.focus(), one.select(), one === document.activeElement", selector)
        assert taken, f"{selector} takes no keys"
        self.now(insert)

    def click(self, selector):
        """Click on the middle of an element."""
        box = self.now("one.scrollIntoView({ block: 'center' }), one.getBoundingClientRect()", selector)
        self.press((box["left"] + box["right"]) / 2, (box["top"] + box["bottom"]) / 2)

    def choose(self, selector, *files):
        """Click on an element that asks for files, and choose these."""
        self.offer(*map(str, files))
        self.click(selector)

    def drop(self, selector, name, text):
        """Drop a file on an element."""
        file = f"new File([{json.dumps(text)}], {json.dumps(name)})"
        self.now(f"(globalThis.dropped = new DataTransfer()).items.add({file})")
        event = "new DragEvent('drop', { dataTransfer: dropped, bubbles: true, cancelable: true })"
        self.now(f"one.dispatchEvent({event})", selector)

    def kept(self):
        """Name and content of the next file that the page saves."""
        path = Path(self.until(self.saved))
        return path.name, path.read_bytes()


def serve():
    """The process of the engine."""
    from PyQt6 import sip
    from PyQt6.QtCore import QPoint, Qt, QUrl
    from PyQt6.QtGui import QKeySequence
    from PyQt6.QtTest import QTest
    from PyQt6.QtWebEngineCore import QWebEnginePage, QWebEngineProfile, QWebEngineUrlRequestInterceptor
    from PyQt6.QtWebEngineWidgets import QWebEngineView
    from PyQt6.QtWidgets import QApplication

    class Requests(QWebEngineUrlRequestInterceptor):
        def interceptRequest(self, info):
            self.found.append(info.requestUrl().toString())

    class Engine(QWebEnginePage):
        def javaScriptConsoleMessage(self, level, message, line, source):
            self.found.append(f"{message} ({source[:100]}:{line})")

        def chooseFiles(self, mode, old, types):
            return self.offered

    def result(start):
        """What an asynchronous call gives to its callback."""
        found = []
        start(found.append)
        while not found:
            QTest.qWait(1)
        return found[0]

    class Tab:
        def __init__(self, width, height):
            self.view, self.profile, self.interceptor = QWebEngineView(), QWebEngineProfile(), Requests()
            self.page = Engine(self.profile, self.view)
            self.page.found, self.interceptor.found, self.downloads = [], [], []
            self.page.renderProcessTerminated.connect(lambda *how: self.page.found.append(f"ended: {how}"))
            self.profile.setUrlRequestInterceptor(self.interceptor)
            self.profile.downloadRequested.connect(self._download)
            self.view.setPage(self.page)
            self.resize(width, height)
            self.view.show()

        def load(self, address):
            self.page.load(QUrl(address))
            return result(self.page.loadFinished.connect)

        def _download(self, item):
            item.setDownloadDirectory(tempfile.mkdtemp(dir=folder))
            self.downloads.append(item)
            item.accept()

        def saved(self):
            """Path of the next file that is saved, or nothing."""
            if not (self.downloads and self.downloads[0].isFinished()):
                return ""
            item = self.downloads.pop(0)
            return os.path.join(item.downloadDirectory(), item.downloadFileName())

        def run(self, text):
            """Value of a text."""
            return result(lambda take: self.page.runJavaScript(text, take))

        def resize(self, width, height):
            self.view.resize(width, height)

        def _window(self):
            self.view.activateWindow()
            self.view.focusProxy().setFocus()
            return self.view.focusProxy()

        def keys(self, *names):
            """Press keys by their names in Qt, as Tab or Shift+Tab."""
            for name in names:
                QTest.keySequence(self._window(), QKeySequence(name))

        def type(self, text):
            """Press the keys of a text."""
            QTest.keyClicks(self._window(), text)

        def press(self, x, y):
            QTest.mouseClick(self._window(), Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))

        def offer(self, *files):
            self.page.offered = files

        def messages(self):
            """Of the console, with errors that nothing caught."""
            return self.page.found

        def requests(self):
            """Addresses that were asked for."""
            return self.interceptor.found

        def picture(self, file):
            """Write what is seen as a PNG."""
            assert self.view.grab().save(file), file

        def close(self):
            sip.delete(self.view)
            sip.delete(self.profile)

    _application, folder = QApplication(sys.argv[:1]), sys.argv[1]
    tabs, commands = {}, lines_of(sys.stdin)
    while True:
        while commands.empty():
            QTest.qWait(5)
        if not (line := commands.get()):
            os._exit(0)  # the other processes of the engine end with it
        name, number, *arguments = json.loads(line)
        if name == "open":
            tabs[number] = Tab(*arguments[1:])
            name, arguments = "load", arguments[:1]
        print(json.dumps(getattr(tabs[number], name)(*arguments)), flush=True)


if __name__ == "__main__":
    serve()
