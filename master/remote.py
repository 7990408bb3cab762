"""An FMU on another machine, or in a container: `selflock serve X.fmu` there, `host = "machine:port"` here.

A connection is one instance, in a process of its own there. Before anything else both sides prove that they know the same
secret, which itself never travels; docs/coupling.md tells the bytes. What follows is not encrypted.
"""

from __future__ import annotations

import hmac
import logging
import os
import secrets
import shutil
import socket
import tempfile
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from . import binary, isolation
from .distant import Distant
from .errors import DescriptionError
from .line import Garbled, Line, called
from .process import start

log = logging.getLogger("selflock")
SECRET = "SELFLOCK_SECRET"
GREETING, NONCE = b"selflock 1 ", 32
PATIENCE = 10.0  # s that the other side has to prove itself
MOST = 64  # instances at a time


class RemotePart(Distant):
    """An FMU instance that `selflock serve` holds."""

    def __init__(
        self,
        name: str,
        address: str,
        fmu: str = "",
        step_timeout: float = 0.0,
        tolerance: float | None = None,
        interface: str = "",
        given: Mapping[str, Any] | None = None,
    ):
        """address: "machine:port". fmu: the file that must be served there, by its name; "": any. The rest as of a ProcessPart."""
        super().__init__(name)
        self.address, self.path = address, Path(fmu or address)
        self.step_timeout = step_timeout or isolation.TIMEOUT
        self._line = Line(_connected(name, address))
        try:
            self._line.wait(PATIENCE)
            self._sound(self._prove)
            self._open(name, fmu, False, tolerance, interface, dict(given or {}))
        except BaseException:
            self.close()
            raise

    def _prove(self) -> None:
        secret = os.environ[SECRET].encode()
        greeting = self._line.receive(len(GREETING) + NONCE)
        if not greeting.startswith(GREETING) or len(greeting) != len(GREETING) + NONCE:
            raise DescriptionError(f"{self.name}: what answers at {self.address} is no `selflock serve` of this version.")
        theirs, ours = greeting[len(GREETING) :], secrets.token_bytes(NONCE)
        self._line.send(ours + _proof(secret, b"client", theirs, ours))
        if not hmac.compare_digest(self._line.receive(NONCE), _proof(secret, b"server", theirs, ours)):
            raise DescriptionError(f"{self.name}: {self.address} does not take the secret in {SECRET}, or knows another one.")

    def _crashed(self) -> NoReturn:
        self._end(0.0)
        self._failed(
            f"no more, for the line to {self.address} ended,",
            "what `selflock serve` said there, and whether it still runs; other components are unharmed.",
        )

    def _end(self, seconds: float) -> int | None:
        self._line.close()
        return None

    def close(self) -> None:
        try:
            if not self._asked:
                self._line.send(called("close", ()))
        except OSError:
            pass
        self._end(0.0)


def _connected(name: str, address: str) -> socket.socket:
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise DescriptionError(f'{name}: host = "{address}": write "machine:port", such as "127.0.0.1:7000".')
    if not os.environ.get(SECRET):
        raise DescriptionError(
            f"{name}: host = {address} is asked only with a secret: set the environment variable {SECRET} to that of "
            "`selflock serve`."
        )
    try:
        end = socket.create_connection((host.strip("[]"), int(port)), PATIENCE)
    except OSError as error:
        raise DescriptionError(
            f"{name}: nobody answers at {address} ({error.strerror or error}). Start `selflock serve` there."
        ) from None
    return _tuned(end)


def _tuned(end: socket.socket) -> socket.socket:
    """Short messages go at once, and a machine that is gone is noticed."""
    end.settimeout(None)
    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    end.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    return end


def _proof(secret: bytes, side: bytes, theirs: bytes, ours: bytes) -> bytes:
    return hmac.digest(secret, side + theirs + ours, "sha256")


# --- the other side ----------------------------------------------------------------------------------------------


class Server:
    """Serves instances of one FMU, to whoever knows the secret."""

    def __init__(self, fmu: Path | str, host: str = "127.0.0.1", port: int = 0, secret: str = "", isolate: bool = False):
        """port: 0 for any that is free. isolate: instances have limits and no rights (master.isolation). Raises DescriptionError."""
        self.fmu, self.isolate = Path(fmu).absolute(), isolate
        binary.open_fmu(self.fmu)  # found out now, not by whoever asks first
        self.secret = secret or os.environ.get(SECRET) or secrets.token_hex(16)  # 128 bits
        try:
            self._listening = socket.create_server((host, port))
        except OSError as error:
            raise DescriptionError(f"{host}:{port} cannot be listened at: {error.strerror}. Choose another --port.") from None
        self.address = f"{host}:{self._listening.getsockname()[1]}"
        self._free = threading.Semaphore(MOST)
        self._over = False

    def run(self, tell: Callable[[str], None] = log.info) -> None:
        """Until `close`, or for ever."""
        while not self._over:
            try:
                end, (who, *_) = self._listening.accept()
            except OSError:
                return
            threading.Thread(target=self._instance, args=(_tuned(end), who, tell), daemon=True).start()

    def close(self) -> None:
        """No more instances. Those that are there go on until their users end them, or this process ends."""
        self._over = True
        with suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)  # else `run` waits on
        self._listening.close()

    def _instance(self, end: socket.socket, who: str, tell: Callable[[str], None]) -> None:
        """One connection; the thread lives as long as the process that it starts."""
        with end, self._free:
            if not self._proven(Line(end)):
                return tell(f"{who} does not know the secret")
            home = tempfile.mkdtemp(prefix="served_", dir=binary.root())
            try:
                process = start(end.fileno(), home, None, self.isolate, str(self.fmu))
                end.close()
                tell(f"an instance for {who}")
                code = process.wait()
                tell(f"{who} is done" if code == 0 else f"the instance of {who} ended with code {code}")
            finally:
                shutil.rmtree(home, ignore_errors=True)

    def _proven(self, line: Line) -> bool:
        ours, secret = secrets.token_bytes(NONCE), self.secret.encode()
        try:
            line.wait(PATIENCE)
            line.send(GREETING + ours)
            told = line.receive(2 * NONCE)
            theirs, proof = told[:NONCE], told[NONCE:]
            known = len(told) == 2 * NONCE and hmac.compare_digest(proof, _proof(secret, b"client", ours, theirs))
            line.send(_proof(secret, b"server", ours, theirs) if known else b"no")
            line.wait(0.0)
        except (Garbled, EOFError, OSError):
            return False
        return known
