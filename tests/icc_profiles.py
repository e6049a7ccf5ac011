"""Build small ICC profiles, byte by byte, for tests."""

import struct

import numpy as np

# sRGB's colorants adapted to D50, so that colour engines accept the profile as a display's.
_COLORANTS = {
    b"rXYZ": (0.4361, 0.2225, 0.0139),
    b"gXYZ": (0.3851, 0.7169, 0.0971),
    b"bXYZ": (0.1431, 0.0606, 0.7141),
    b"wtpt": (0.9642, 1.0, 0.8249),
}


def fixed(*values):
    return struct.pack(f">{len(values)}i", *(round(value * 65536) for value in values))


def gamma_curve(gamma):
    return b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256))


def straight_curve():
    return b"curv\0\0\0\0" + struct.pack(">I", 0)


def sampled_curve(samples):
    codes = np.rint(np.asarray(samples) * 65535).astype(">u2")
    return b"curv\0\0\0\0" + struct.pack(">I", len(codes)) + codes.tobytes()


def parametric_curve(kind, *parameters):
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + fixed(*parameters)


def description(text):
    encoded = text.encode("utf-16-be")
    return b"mluc\0\0\0\0" + struct.pack(">II2s2sII", 1, 12, b"en", b"US", len(encoded), 28) + encoded


def old_description(text):
    encoded = text.encode("ascii") + b"\0"
    return b"desc\0\0\0\0" + struct.pack(">I", len(encoded)) + encoded + b"\0" * 79


def profile(tags, space=b"RGB ", name="test profile", version=b"\x04\x40\0\0", pcs=b"XYZ "):
    """Return a profile of the given tags; the description, white and colorants are added."""
    tags = {b"desc": description(name), b"cprt": description("none"), **tags}
    for tag, xyz in _COLORANTS.items():
        if space == b"RGB " or tag == b"wtpt":
            tags.setdefault(tag, b"XYZ \0\0\0\0" + fixed(*xyz))
    at = 128 + 4 + 12 * len(tags)
    table, data = b"", b""
    for tag, content in tags.items():
        content += b"\0" * (-len(content) % 4)
        table += struct.pack(">4sII", tag, at + len(data), len(content))
        data += content
    body = struct.pack(">I", len(tags)) + table + data
    header = struct.pack(">I4s4s4s4s4s", 128 + len(body), b"none", version, b"mntr", space, pcs)
    header += struct.pack(">6H", 2000, 1, 1, 0, 0, 0) + b"acsp"
    header += b"\0" * 28 + fixed(0.9642, 1.0, 0.8249)
    return header.ljust(128, b"\0") + body


def rgb(red, green=None, blue=None, **options):
    """Return an RGB profile with the given tone curves."""
    return profile({b"rTRC": red, b"gTRC": green or red, b"bTRC": blue or red}, **options)


def grey(curve, **options):
    """Return a grey profile with the given tone curve."""
    return profile({b"kTRC": curve}, space=b"GRAY", **options)


def tables(to_pcs, from_pcs, grid=17):
    """Return an RGB profile of look-up tables, from drive to encoded Lab (0 to 1) and back."""
    return profile({b"A2B0": _table(to_pcs, grid), b"B2A0": _table(from_pcs, grid)}, pcs=b"Lab ")


def _table(function, grid):
    axis = np.linspace(0, 1, grid)
    corners = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    codes = np.rint(np.clip(function(corners), 0, 1) * 65535).astype(">u2")
    straight = np.array([0, 65535] * 3, ">u2").tobytes()
    head = b"mft2\0\0\0\0" + bytes([3, 3, grid, 0]) + fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    return head + struct.pack(">HH", 2, 2) + straight + codes.tobytes() + straight
