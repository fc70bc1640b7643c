"""A short simulated scene, and a client of OpenIGTLink for what `livetet track` publishes."""

import collections
import itertools
import json
import os
import pathlib
import socket
import struct
import sys
import tempfile
import unittest

PROGRAM = os.environ["LIVETET_PROGRAM"]
MODULE = pathlib.Path(os.environ["LIVETET_ROOT"]) / "apps" / "slicer" / "LivetetTrack"
sys.path.insert(0, str(MODULE))


def block_mesh(cells, size_mm):
    """A block as MSH 2.2: six tets a cell, about its diagonal."""

    def number(place):
        i, j, k = place
        return 1 + i + (cells[0] + 1) * (j + (cells[1] + 1) * k)

    nodes, tets = [], []
    for k, j, i in itertools.product(*(range(n + 1) for n in reversed(cells))):
        at = [s * n / c for s, n, c in zip(size_mm, (i, j, k), cells)]
        nodes.append(f"{number((i, j, k))} {at[0]} {at[1]} {at[2]}")
    for corner in itertools.product(*(range(n) for n in cells)):
        for order in itertools.permutations(range(3)):
            place, path = list(corner), [number(corner)]
            for axis in order:
                place[axis] += 1
                path.append(number(place))
            if order in ((1, 0, 2), (0, 2, 1), (2, 1, 0)):  # odd: turned to a positive volume
                path[0], path[1] = path[1], path[0]
            tets.append(f"{len(tets) + 1} 4 2 1 1 {' '.join(map(str, path))}")
    return "\n".join(
        ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes)), *nodes]
        + ["$EndNodes", "$Elements", str(len(tets)), *tets, "$EndElements", ""]
    )


class InFolder(unittest.TestCase):
    """A test with a temporary folder that holds `scene.yaml`: a block, 100 mm high, on a moving
    table. A sensor on its top is pressed down by 12 mm from 3 to 4 s on."""

    SIZE_MM = (200, 100, 100)

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.scene = self.folder / "scene.yaml"
        self.write_scene()

    def write_scene(self, duration_s=60, **keys):
        (self.folder / "block.msh").write_text(block_mesh((8, 4, 4), self.SIZE_MM))
        reference = {"tool": "Reference", "at_mm": [20, 100, 50]}
        press = [{"at_s": 3}, {"at_s": 4, "by_mm": [0, 0, -12]}]
        sensor = {"tool": "Sensor", "at_mm": [100, 50, 100], "moves": press}
        stylus = {"tool": "Stylus", "on": "tracker", "at_mm": [200, -100, -50]}
        script = {
            "rate_Hz": 20,
            "duration_s": duration_s,
            "position_noise_mm": 0.2,
            "organ": {"at_mm": [300, 0, -100], "moves": [{"at_s": 5, "by_mm": [40, 0, 0]}]},
            "tools": [reference, sensor, stylus],
        }
        (self.folder / "press.yaml").write_text(json.dumps(script))
        fiducials = [
            {
                "name": f"F{n}",
                "image_mm": at,
                "tracker_mm": at,
                "reference_mm": [at[0] - 20, at[1] - 100, at[2] - 50],
                "residual_mm": 0,
                "leave_one_out_mm": 0,
                "weight": 1,
            }
            for n, at in enumerate([[0, 0, 0], [200, 0, 0], [0, 100, 0], [0, 0, 100]])
        ]
        registration = {
            "format": "livetet registration 2",
            "reference_tool": "Reference",
            "image_from_reference_mm": [1, 0, 0, 20, 0, 1, 0, 100, 0, 0, 1, 50, 0, 0, 0, 1],
            "scale": 1,
            "fre_mm": 0,
            "fle_mm": 0,
            "fiducials": fiducials,
        }
        (self.folder / "registration.json").write_text(json.dumps(registration))
        scene = {
            "mesh": {"file": "block.msh"},
            "image": "grey.nii.gz",
            "materials": [{"young_Pa": 3000, "poisson": "0.45 +- 0.02"}],
            "fix": [{"half_space_mm": [0, 0, 1, 0, 0, 1]}],
            "track": {
                "source": "press.yaml",
                "registration": "registration.json",
                "tools": [{"tool": "Stylus"}],
                "targets": [{"name": "Tumour", "point_mm": [100, 50, 60]}],
            },
            "output": {"file": "track.h5"},
            **keys,
        }
        self.scene.write_text(json.dumps(scene))


Message = collections.namedtuple("Message", "type device stamp content")


class Client:
    """Reads messages of OpenIGTLink, header version 1: what a client is sent that sends nothing."""

    def __init__(self, address):
        self._socket = socket.create_connection(address, timeout=20)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def _read(self, size):
        parts = []
        while size > 0:
            part = self._socket.recv(size)
            if not part:
                raise EOFError("the server closed the connection")
            parts.append(part)
            size -= len(part)
        return b"".join(parts)

    def receive(self):
        _, kind, device, stamp, size, _ = struct.unpack(">H12s20sQQQ", self._read(58))
        names = [text.split(b"\0")[0].decode() for text in (kind, device)]
        return Message(*names, stamp, self._read(size))


def text_of(message):
    """Of a STRING: encoding, length, bytes."""
    size = struct.unpack(">HH", message.content[:4])[1]
    return message.content[4 : 4 + size].decode()


def origin_of(message):
    """Of a TRANSFORM: its translation, after the three columns of its rotation."""
    return struct.unpack(">12f", message.content)[9:]


Surface = collections.namedtuple("Surface", "points scalar values")


def surface_of(message):
    """Points and first scalar of a POLYDATA."""
    body = message.content
    counts = struct.unpack(">10I", body[:40])
    points = list(struct.iter_unpack(">3f", body[40 : 40 + 12 * counts[0]]))
    at = 40 + 12 * counts[0] + sum(counts[2:9:2])
    headers = list(struct.iter_unpack(">BBI", body[at : at + 6 * counts[9]]))
    at += 6 * counts[9]
    name = body[at : body.index(b"\0", at)].decode()
    first = len(body) - 4 * sum(count for _, _, count in headers)  # all are scalars
    values = struct.unpack_from(f">{headers[0][2]}f", body, first)
    return Surface(points, name, values)
