"""The page's server: where it listens, and a session for each tab."""

from __future__ import annotations

import contextlib
import errno
import io
import socket
import threading
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from jet_gym.studio.errors import PortInUseError, StudioError, ViserMissingError
from jet_gym.studio.inputs import Inputs
from jet_gym.utils.self_closing import SelfClosing

if TYPE_CHECKING:
    from viser import ClientHandle, ViserServer

    from jet_gym.studio.session import Session

DEFAULT_HOST, DEFAULT_PORT = "127.0.0.1", 8080

_CAMERA_POSITION, _CAMERA_TARGET = (1.35, 1.5, 0.85), (0.29, 0.17, 0.14)  # [m]
_FIELD_OF_VIEW = 0.66  # [rad]
_FOG = (3.0, 7.5)  # [m] from where on things fade into the background, and where they are gone


class Studio(SelfClosing):
    """Serves the page until it is closed; a context manager.

    Args:
        host: Address to listen at; 127.0.0.1 lets only this machine in.
        port: Port to listen at; 0 for any that is free.
        inputs: What a page asks for at first.

    Raises:
        ViserMissingError: If viser is not installed.
        PortInUseError: If something else listens there.
        StudioError: If the address cannot be listened at.
    """

    def __init__(self, host: str = DEFAULT_HOST, port: int = DEFAULT_PORT, inputs: Inputs | None = None) -> None:
        # What is drawn for a tab in the moment in which it is closed is lost, and nobody needs to know.
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection", category=UserWarning)
        self._inputs = inputs
        self._lock = threading.Lock()
        self._sessions: dict[int, Session] = {}
        self._viser = _start_viser(host, port)
        self._viser.scene.world_axes.visible = False
        self._viser.scene.configure_fog(*_FOG)
        camera = self._viser.initial_camera
        camera.position, camera.look_at, camera.fov = _CAMERA_POSITION, _CAMERA_TARGET, _FIELD_OF_VIEW
        self._viser.on_client_connect(self._open)
        self._viser.on_client_disconnect(self._close)

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._viser.get_port())

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{self._viser.get_host()}:{self.port}"

    @property
    def sessions(self) -> tuple[Session, ...]:
        """The open tabs, oldest first."""
        with self._lock:
            return tuple(self._sessions.values())

    def close(self) -> None:
        """Close every tab's session and stop listening; may be called twice."""
        with self._lock:
            sessions, self._sessions = list(self._sessions.values()), {}
        for session in sessions:
            session.close()
        with _silent():
            self._viser.stop()

    def _open(self, client: ClientHandle) -> None:
        from jet_gym.studio.session import Session

        session = Session(client, self._inputs)
        with self._lock:
            self._sessions[client.client_id] = session
        if client.client_id not in self._viser.get_clients():  # closed while its page was being built
            self._close(client)

    def _close(self, client: ClientHandle) -> None:
        with self._lock:
            session = self._sessions.pop(client.client_id, None)
        if session is not None:
            session.close()


def _start_viser(host: str, port: int) -> ViserServer:
    try:
        from viser import ViserServer
    except ImportError as error:
        raise ViserMissingError('the studio needs viser: pip install "jet-gym[studio]"') from error
    _require_free(host, port)

    class LocalServer(ViserServer):  # type: ignore[misc]
        """A server that never opens a tunnel through which others could reach it."""

        def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002
            return None

    with _silent():
        server = LocalServer(host=host, port=port, verbose=False)
    if port not in (0, server.get_port()):  # viser goes on to the next free port
        with _silent():
            server.stop()
        raise _in_use(host, port)
    return server


def _require_free(host: str, port: int) -> None:
    """Refuse an address that cannot be listened at."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise _in_use(host, port) from error
        raise StudioError(f"cannot listen at {host}, port {port}: {error.strerror or error}") from error


def _in_use(host: str, port: int) -> PortInUseError:
    return PortInUseError(
        f"port {port} of {host} is in use by another program; choose another with --port, or 0 for any that is free"
    )


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Keep viser from printing; what is worth saying the command line says."""
    import rich

    console: Any = rich.get_console()
    quiet, console.quiet = console.quiet, True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        console.quiet = quiet
