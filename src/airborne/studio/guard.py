"""Who may speak to the studio: this computer's browser with the token, and no other page in it."""

from __future__ import annotations

import re
import secrets
from urllib.parse import parse_qs

from starlette.types import ASGIApp, Message, Receive, Scope, Send

_SCRIPT = re.compile(rb"<script(?= |>)")  # what comes from files stands in the page with its < escaped
_POLICY = (
    "default-src 'self'; script-src 'self' 'nonce-{nonce}' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)
# a figure, a film or a table from a run: shown, never executed, and it can ask for nothing
FILE_POLICY = "sandbox; default-src 'none'; img-src 'self' data:; media-src 'self'; style-src 'unsafe-inline'"
# a report shows frames by its own scripts: its origin is none, so that it has no cookie, and it can ask for nothing
REPORT_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class Guard:
    """Lets requests pass that name this server, come from its own pages, and bring the token; all others end here."""

    def __init__(self, app: ASGIApp, *, token: str, port: int) -> None:
        """Stand before an ASGI application that listens at a port of the loopback."""
        self._app, self._token, self._cookie = app, token, f"airborne-{port}"
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[-1]
        if headers.get("host") not in self._hosts or not self._is_own(headers.get("origin")):
            await _refuse(scope, send, "this address belongs to the studio on its own computer only")
        elif scope["type"] == "http" and scope["method"] == "GET" and self._is_token(given):
            await self._admit(scope, send)
        elif self._is_token(_cookie(headers.get("cookie", ""), self._cookie)):
            await self._app(scope, receive, _HeaderWriter(send) if scope["type"] == "http" else send)
        else:
            await _refuse(scope, send, "open the address, with its token, that `airborne studio` printed")

    def _is_own(self, origin: str | None) -> bool:
        return origin is None or origin in {f"http://{host}" for host in self._hosts}

    def _is_token(self, text: str) -> bool:
        return secrets.compare_digest(text.encode(), self._token.encode())

    async def _admit(self, scope: Scope, send: Send) -> None:
        """Give the browser the token as a cookie, and take it out of the address."""
        cookie = f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
        headers = [(b"location", scope["raw_path"].partition(b"?")[0]), (b"set-cookie", cookie.encode())]
        await send({"type": "http.response.start", "status": 303, "headers": headers})
        await send({"type": "http.response.body", "body": b""})


class _HeaderWriter:
    """Adds to every answer what its page may do; scripts of our own pages get the nonce."""

    def __init__(self, send: Send) -> None:
        self._send, self._nonce = send, secrets.token_urlsafe(16)
        self._start: Message | None = None
        self._body = b""

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = [(name.lower(), value) for name, value in message["headers"]]
            names = {name for name, _ in headers}
            if b"content-security-policy" not in names:
                headers.append((b"content-security-policy", _POLICY.format(nonce=self._nonce).encode()))
                is_page = any(name == b"content-type" and value.startswith(b"text/html") for name, value in headers)
            else:
                is_page = False
            headers += [(b"x-content-type-options", b"nosniff"), (b"referrer-policy", b"no-referrer")]
            message = {**message, "headers": headers}
            if is_page:
                self._start = message
                return
        elif self._start is not None and message["type"] == "http.response.body":
            self._body += message.get("body", b"")
            if message.get("more_body"):
                return
            body = _SCRIPT.sub(b'<script nonce="' + self._nonce.encode() + b'"', self._body)
            kept = [(name, value) for name, value in self._start["headers"] if name != b"content-length"]
            length = (b"content-length", str(len(body)).encode())
            await self._send({**self._start, "headers": [*kept, length]})
            message, self._start = {"type": "http.response.body", "body": body}, None
        await self._send(message)


def _cookie(header: str, name: str) -> str:
    """Return a cookie's value; of other programs on this computer there may be any number beside it."""
    pairs = (part.strip().partition("=") for part in header.split(";"))
    return next((value for key, _, value in pairs if key == name), "")


async def _refuse(scope: Scope, send: Send, reason: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": f"airborne studio: {reason}\n".encode()})
