"""An LED dome over the network: DMX by Art-Net or sACN."""

from __future__ import annotations

import socket
import threading
import uuid
from contextlib import suppress
from typing import Annotated, Literal

from pydantic import Field

from impasto.capture.toml_tables import Table
from impasto.errors import Problem
from impasto.stand.drivers import DriverError, Stand
from impasto.stand.plan_file import PlacePlan

CHANNELS = 512
_PORTS = {"artnet": 6454, "sacn": 5568}
# Receivers go dark when they hear nothing: after 2.5 s by E1.31, section 6.7.1; Art-Net asks for 0.8 to 1 s.
_REPEAT_S = 0.8
_SOURCE = "impasto"
_PRIORITY = 100


class DmxLight:
    """Switches one lamp of a dome on, and all others off.

    Parameters
    ----------
    settings : DmxLight.Settings
    stand : Stand

    Raises
    ------
    DriverError
        If the host's name is not known.
    """

    class Settings(Table):
        """The table ``[light.dmx]``; each place has its `dmx_channel`, from 1.

        An sACN universe without a host is sent to its multicast address. `width` channels in a row are lit,
        for lamps of several colours.
        """

        protocol: Literal["artnet", "sacn"] = "sacn"
        host: str = ""
        port: int | None = Field(None, gt=0, lt=65536)
        universe: Annotated[int, Field(ge=0, le=63999)] = 1
        level: Annotated[int, Field(ge=1, le=255)] = 255
        width: Annotated[int, Field(ge=1, le=8)] = 1

    def __init__(self, settings: Settings, stand: Stand) -> None:
        self._settings = settings
        self._address = (_host(settings), settings.port or _PORTS[settings.protocol])
        self._source = uuid.uuid4().bytes
        self._sequence = 0
        self._levels = bytes(CHANNELS)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        try:
            family = socket.getaddrinfo(*self._address, type=socket.SOCK_DGRAM)[0][0]
        except OSError as error:
            raise self._problem(f"is not known: {error.strerror}") from error
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._thread = threading.Thread(target=self._repeat, daemon=True, name="dmx")
        self._thread.start()

    def show(self, place: PlacePlan) -> None:
        """Light the lamp of a place."""
        assert place.dmx_channel is not None  # the plan was checked
        levels = bytearray(CHANNELS)
        first = place.dmx_channel - 1
        for channel in range(first, min(first + self._settings.width, CHANNELS)):
            levels[channel] = self._settings.level
        self._set(bytes(levels))

    def off(self) -> None:
        """Switch all lamps off."""
        self._set(bytes(CHANNELS))

    def close(self) -> None:
        """Switch all lamps off and stop sending."""
        with suppress(DriverError):
            self.off()
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def _set(self, levels: bytes) -> None:
        self._levels = levels
        try:
            # Datagrams may be lost; a second one costs nothing.
            self._send()
            self._send()
        except OSError as error:
            raise self._problem(f"cannot be reached: {error.strerror}") from error

    def _repeat(self) -> None:
        while not self._ended.wait(_REPEAT_S):
            with suppress(OSError):  # said at the next change
                self._send()

    def _send(self) -> None:
        with self._lock:
            self._sequence = self._sequence % 255 + 1  # Art-Net's 0 would switch its counting off
            universe = self._settings.universe
            packet = (
                artnet_packet(universe, self._sequence, self._levels)
                if self._settings.protocol == "artnet"
                else sacn_packet(universe, self._sequence, self._levels, self._source)
            )
            self._socket.sendto(packet, self._address)

    def _problem(self, what: str) -> DriverError:
        where = f"dome at {self._address[0]}"
        return DriverError(Problem(where, what, "See that it is on and its network holds, then try again"))


def artnet_packet(universe: int, sequence: int, levels: bytes) -> bytes:
    """Return an ArtDmx packet.

    Parameters
    ----------
    universe : int
        Port address of 15 bits: net, sub-net and universe.
    sequence : int
        1 to 255.
    levels : bytes
        Of the channels from 1 on; an even number of them, at most 512.

    References
    ----------
    [ArtNet4]_, "ArtDmx packet definition"
    """
    return b"".join([
        b"Art-Net\0",
        (0x5000).to_bytes(2, "little"),  # OpDmx
        (14).to_bytes(2, "big"),  # protocol version
        bytes([sequence, 0]),  # and the physical port, for information only
        universe.to_bytes(2, "little"),
        len(levels).to_bytes(2, "big"),
        levels,
    ])  # fmt: skip


def sacn_packet(universe: int, sequence: int, levels: bytes, source: bytes) -> bytes:
    """Return an E1.31 data packet.

    Parameters
    ----------
    universe : int
        1 to 63999.
    sequence : int
        0 to 255.
    levels : bytes
        Of the channels from 1 on, at most 512.
    source : bytes
        16 bytes that tell this sender from others.

    References
    ----------
    [E131]_, sections 5 to 7
    """
    dmp = b"".join([
        bytes([0x02, 0xA1]),  # set property; two-byte addresses, range of equal sizes
        (0).to_bytes(2, "big"), (1).to_bytes(2, "big"), (1 + len(levels)).to_bytes(2, "big"),
        b"\0", levels,  # DMX start code
    ])  # fmt: skip
    framing = b"".join([
        (2).to_bytes(4, "big"),  # VECTOR_E131_DATA_PACKET
        _SOURCE.encode().ljust(64, b"\0"),
        bytes([_PRIORITY]), (0).to_bytes(2, "big"), bytes([sequence, 0]),
        universe.to_bytes(2, "big"),
        _counted(dmp),
    ])  # fmt: skip
    root = (4).to_bytes(4, "big") + source + _counted(framing)  # VECTOR_ROOT_E131_DATA
    return (0x10).to_bytes(2, "big") + bytes(2) + b"ASC-E1.17\0\0\0" + _counted(root)


def _counted(layer: bytes) -> bytes:
    """Return a layer behind its flags and length, which counts these two bytes."""
    return (0x7000 | (len(layer) + 2)).to_bytes(2, "big") + layer


def _host(settings: DmxLight.Settings) -> str:
    if settings.host:
        return settings.host
    high, low = divmod(settings.universe, 256)
    return f"239.255.{high}.{low}" if settings.protocol == "sacn" else "255.255.255.255"
