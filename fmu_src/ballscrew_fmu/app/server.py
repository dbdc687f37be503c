"""HTTP server of the app: for one user on this machine, stateless but for the pages that are shown in a frame.

A request is answered only with the token in its path and a Host of this machine (else 404: a page of another site whose
name resolves to 127.0.0.1 finds nothing), and without an Origin of another site (403). No path or name of a request
becomes a path of a file. Every answer has a content security policy under which no other site is asked for anything.

What takes time is a stream of lines of JSON: progress, then the result. A tab has one job: a new one ends that before,
and so does a closed tab. A job ends where it reports progress next; the page is free at once.
"""

import contextlib
import json
import secrets
import select
import socket
import sys
import threading
import time
import traceback
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

HOST = "127.0.0.1"
#: largest body of a request, and what of a larger one is read so that its answer arrives [bytes]
LARGEST, DRAINED = 32_000_000, 128_000_000
#: in which a slow client must send something [s]; pages that are kept for frames; connections at a time
PATIENCE, SHOWN, CONNECTIONS = 10.0, 6, 24
#: nothing from elsewhere; the live page in its frame has its own, stricter policy
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
FRAMED = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data:; "
    "frame-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
#: what is an object in a request; questions that wait for no long job; most characters of a problem
OBJECTS, QUICK, MOST_TEXT = ("sizes", "changes", "point", "answers"), ("form", "questions", "torque"), 2000
Report = Callable[[int, int, str], None]
#: what a page asks by name: content of its request, progress -> content of the answer
Run = Callable[[Mapping[str, Any], Report], dict[str, Any]]


class CancelledError(Exception):
    """The tab has closed or asks for something else."""


class RefusedError(Exception):
    """A request that is no question of the page: status and text."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


class App(ThreadingHTTPServer):
    """Server of the page.

    files: content and type by name, "" = the page; runs: by name; failures: exceptions with a line for the user.
    """

    daemon_threads = True

    def __init__(
        self, files: Mapping[str, tuple[bytes, str]], runs: Mapping[str, Run],
        failures: tuple[type[BaseException], ...], port: int = 0,
    ) -> None:  # fmt: skip
        super().__init__((HOST, port), Handler)
        self.files, self.runs, self.failures = files, runs, failures
        self.token = secrets.token_urlsafe(24)
        self.shown: OrderedDict[str, bytes] = OrderedDict()
        self.jobs: dict[str, threading.Event] = {}
        # one long job at a time: two would take the memory of both and no less time; beside it the quick ones, while
        # somebody types in another tab. Each kind in one thread, whose memory is used again
        self.lock, self.heavy, self.quick = threading.Lock(), ThreadPoolExecutor(1), ThreadPoolExecutor(1)
        self.places = threading.BoundedSemaphore(CONNECTIONS)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.server_port}/{self.token}/"

    def show(self, page: str) -> str:
        """Keep a page for a frame. Returns its name."""
        name = secrets.token_urlsafe(9)
        with self.lock:
            self.shown[name] = page.encode()
            while len(self.shown) > SHOWN:
                self.shown.popitem(last=False)
        return name

    def job_of(self, tab: str) -> threading.Event:
        """The new job of a tab, set when it is to end; that before ends."""
        event = threading.Event()
        with self.lock:
            if (before := self.jobs.pop(tab, None)) is not None:
                before.set()
            self.jobs[tab] = event
        return event

    def end_of(self, tab: str, event: threading.Event) -> None:
        """A job has ended."""
        with self.lock:
            if self.jobs.get(tab) is event:
                del self.jobs[tab]

    def server_close(self) -> None:
        """Ends its jobs as well."""
        super().server_close()
        for jobs in (self.heavy, self.quick):
            jobs.shutdown(wait=False, cancel_futures=True)
        with self.lock:
            for event in self.jobs.values():
                event.set()

    def process_request(self, request: Any, client_address: Any) -> None:
        """One more connection, if there is room."""
        if self.places.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """In its thread."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that left is no error; anything else is shown."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """One connection with one request."""

    server: App
    protocol_version = "HTTP/1.0"
    server_version, sys_version = "ballscrew", ""
    timeout = PATIENCE
    body_read = False

    def handle(self) -> None:
        """The request, whose head must be there in PATIENCE as a whole."""
        self.late = threading.Timer(PATIENCE, self._hang_up)
        self.late.daemon = True
        self.late.start()
        try:
            super().handle()
        finally:
            self.late.cancel()

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What the library refuses, with the policy of every answer."""
        with contextlib.suppress(OSError):
            self._send(b"refused\n", "text/plain; charset=utf-8", HTTPStatus(code))

    def _hang_up(self) -> None:
        with contextlib.suppress(OSError):
            self.connection.shutdown(socket.SHUT_RD)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal shows the address."""

    def do_GET(self) -> None:
        """The page, its parts, and pages for frames."""
        self._answered(self._get)

    def do_POST(self) -> None:
        """What the page asks."""
        self._answered(self._post)

    def _answered(self, answer: Callable[[str], None]) -> None:
        """The answer to a request that may be asked, else its refusal."""
        self.late.cancel()
        try:
            answer(self._name())
        except RefusedError as refused:
            self._drop_body()
            with contextlib.suppress(OSError):
                self._send(f"{refused}\n".encode(), "text/plain; charset=utf-8", refused.status)

    def _drop_body(self) -> None:
        """Read what is left of a small body: a connection that is closed before is reset, and its answer lost."""
        length = self.headers.get("Content-Length", "0")
        if not self.body_read and length.isascii() and length.isdigit() and len(length) < 6:
            with contextlib.suppress(OSError):
                self.connection.settimeout(0.5)
                self.rfile.read(int(length))

    def _name(self) -> str:
        """What is asked for, behind the token."""
        hosts = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}
        try:
            parts = urlsplit(self.path).path.split("/", 2)
        except ValueError:
            raise RefusedError(HTTPStatus.NOT_FOUND, "not found") from None
        known = self.headers.get("Host") in hosts and len(parts) == 3
        if not (known and secrets.compare_digest(parts[1].encode(), self.server.token.encode())):
            raise RefusedError(HTTPStatus.NOT_FOUND, "not found")
        if self.headers.get("Origin", f"http://{self.headers['Host']}") not in {
            f"http://{host}" for host in hosts
        }:
            raise RefusedError(HTTPStatus.FORBIDDEN, "of another site")
        return parts[2]

    def _get(self, name: str) -> None:
        if name in self.server.files:
            content, kind = self.server.files[name]
            self._send(content, kind)
        elif (page := self.server.shown.get(name.removeprefix("shown/"))) and name.startswith("shown/"):
            self._send(page, "text/html; charset=utf-8", policy=FRAMED)
        else:
            raise RefusedError(HTTPStatus.NOT_FOUND, "not found")

    def _post(self, name: str) -> None:
        run = self.server.runs.get(name)
        if run is None:
            raise RefusedError(HTTPStatus.NOT_FOUND, "not found")
        if self.headers.get_content_type() != "application/json":
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "needs application/json")
        body = self._body()
        try:
            content = json.loads(body)
        except (ValueError, RecursionError):
            content = None
        objects = (
            all(isinstance(content.get(name, {}), dict) for name in OBJECTS)
            if isinstance(content, dict)
            else False
        )
        if not (objects and isinstance(content.get("tab"), str) and len(content["tab"]) <= 100):
            raise RefusedError(HTTPStatus.BAD_REQUEST, "needs an object of JSON, with its tab")
        self._head(HTTPStatus.OK, "application/x-ndjson", POLICY)
        self.end_headers()
        self._line(self._result(name, run, content))

    def _body(self) -> bytes:
        """Of the request; a large one is read and dropped, so that its refusal is read."""
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit() and len(length) < 16):
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "needs a Content-Length")
        size = int(length)
        if size > LARGEST:
            left, end = min(size, DRAINED), time.monotonic() + PATIENCE
            with contextlib.suppress(TimeoutError):
                while left > 0 and time.monotonic() < end and (part := self.rfile.read(min(left, 1 << 16))):
                    left -= len(part)
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {LARGEST // 1_000_000} MB")
        self.body_read = True
        body, end = b"", time.monotonic() + PATIENCE
        while len(body) < size:
            part = b""
            with contextlib.suppress(TimeoutError):
                part = self.rfile.read1(size - len(body)) if time.monotonic() < end else b""
            if not part:
                raise RefusedError(HTTPStatus.REQUEST_TIMEOUT, "the request is not complete")
            body += part
        return body

    def _result(self, name: str, run: Run, content: Mapping[str, Any]) -> dict[str, Any]:
        """Result or problem of a job, with lines of progress on the way."""
        over, told = self.server.job_of(str(content["tab"])), 0.0

        def report(finished: int, total: int, what: str) -> None:
            nonlocal told
            if over.is_set() or self._left():
                raise CancelledError
            if time.monotonic() - told > 0.1 or finished == total:
                told = time.monotonic()
                self._line({"progress": [finished, total, what]})

        try:
            job = (self.server.quick if name in QUICK else self.server.heavy).submit(run, content, report)
            try:
                while not (wait([job], timeout=0.1).done or job.running()):
                    report(0, 1, "waiting for another tab")
            except CancelledError:
                job.cancel()
                raise
            result = job.result()
            if page := result.pop("html", ""):
                result["shown"] = f"shown/{self.server.show(page)}"
            return {"result": result}
        except CancelledError:
            return {"cancelled": True}
        except self.server.failures as error:
            problems = [
                {"entry": one.entry, "allowed": one.allowed, "remedy": one.remedy}
                for one in getattr(error, "problems", ())
            ]
            return {"problem": str(error)[:MOST_TEXT], "problems": problems}
        except Exception as error:
            traceback.print_exc()
            return {
                "problem": f"a defect of the program: {type(error).__name__}; the terminal has more",
                "problems": [],
            }
        finally:
            self.server.end_of(str(content["tab"]), over)

    def _left(self) -> bool:
        """Whether the client has closed the connection."""
        readable, _, _ = select.select([self.connection], [], [], 0.0)
        with contextlib.suppress(BlockingIOError):
            return bool(readable) and not self.connection.recv(1, socket.MSG_PEEK)
        return False

    def _line(self, content: Mapping[str, Any]) -> None:
        """A line of the stream; a client that left ends the job at its next report."""
        with contextlib.suppress(OSError):
            self.wfile.write(json.dumps(content, allow_nan=False).encode())
            self.wfile.write(b"\n")
            self.wfile.flush()

    def _head(self, status: HTTPStatus, kind: str, policy: str) -> None:
        self.send_response(status)
        for name, value in (
            ("Content-Type", kind), ("Content-Security-Policy", policy), ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"), ("Cache-Control", "no-store"),
            ("Cross-Origin-Resource-Policy", "same-origin"), ("Cross-Origin-Opener-Policy", "same-origin"),
        ):  # fmt: skip
            self.send_header(name, value)

    def _send(
        self, content: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK, policy: str = POLICY
    ) -> None:
        self._head(status, kind, policy)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)
