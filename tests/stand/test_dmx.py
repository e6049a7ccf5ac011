"""Domes over the network: what is sent is read by other people's libraries."""

import socket
import time

import pytest
from sacn.messages.data_packet import DataPacket
from stands import stand_of, write_plan
from stupidArtnet import StupidArtnetServer

from impasto.errors import CaptureError
from impasto.stand.desk import Desk
from impasto.stand.drivers import open_light
from impasto.stand.lights.dmx import sacn_packet
from impasto.stand.plan_file import read_plan


@pytest.fixture
def receiver():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(3)
        yield listening


def dome(folder, protocol, port, universe=3):
    settings = f'protocol = "{protocol}"\nport = {port}'
    replace = [('protocol = "sacn"', settings), ('host = ""', 'host = "127.0.0.1"'),
               ("universe = 1", f"universe = {universe}")]  # fmt: skip
    path = write_plan(folder, light="dmx", arm=(-40, 0, 40), times=(1,), replace=replace)
    made = stand_of(path, Desk())
    return open_light(made), made.plan.file.place


def lit(levels):
    return {channel: level for channel, level in enumerate(levels, start=1) if level}


def test_sacn_lights_one_lamp_at_a_time(receiver, tmp_path):
    light, places = dome(tmp_path, "sacn", receiver.getsockname()[1])
    sequences = []
    for place in places:
        light.show(place)
        for _ in range(2):
            packet = DataPacket.make_data_packet(list(receiver.recv(2000)))
            assert packet.universe == 3
            assert packet.dmxStartCode == 0
            assert packet.sourceName == "impasto"
            assert lit(packet.dmxData) == {place.dmx_channel: 255}
            sequences.append(packet.sequence)
    assert sequences == list(range(1, 7))
    light.close()
    assert lit(DataPacket.make_data_packet(list(receiver.recv(2000))).dmxData) == {}


def test_lamps_stay_lit_while_nothing_changes(receiver, tmp_path):
    """Receivers go dark after 2.5 s without a packet."""
    light, places = dome(tmp_path, "sacn", receiver.getsockname()[1])
    light.show(places[1])
    for _ in range(3):  # two at the change, and one unasked
        packet = DataPacket.make_data_packet(list(receiver.recv(2000)))
        assert lit(packet.dmxData) == {2: 255}
    light.close()


def test_sacn_packets_are_those_of_another_sender():
    levels = bytes(range(256)) * 2
    theirs = DataPacket(tuple(b"x" * 16), "impasto", 63999, tuple(levels), 100, 255)
    assert sacn_packet(63999, 255, levels, b"x" * 16) == bytes(theirs.getBytes())


def test_art_net_lights_one_lamp_at_a_time(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = StupidArtnetServer(port)
    heard = server.register_listener(universe=3)
    light, places = dome(tmp_path, "artnet", port)
    for place in places:
        expected = {place.dmx_channel: 255}
        end = time.monotonic() + 3
        while lit(server.get_buffer(heard)) != expected and time.monotonic() < end:
            light.show(place)
            time.sleep(0.02)
        assert lit(server.get_buffer(heard)) == expected
        assert len(server.get_buffer(heard)) == 512
    light.close()
    server.listen = False
    server.delete_all_listener()


def test_every_place_needs_its_channel(tmp_path):
    path = write_plan(tmp_path, light="dmx", arm=(-40, 0, 40), times=(1,))
    path.write_text(path.read_text().replace("dmx_channel = 2\n", "").replace("dmx_channel = 3\n", ""))
    with pytest.raises(CaptureError) as caught:
        read_plan(path)
    assert [problem.what for problem in caught.value.problems] == ["key dmx_channel is missing"] * 2
