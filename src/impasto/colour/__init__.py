"""Colour: from encoded values to linear light, and from a camera's radiance to a display.

Here are the transfer functions that every stage uses. The modules beside them are imported where they are
needed: `adaptation` to another white, the `primaries` of colour spaces, `camera` (radiance to XYZ),
`displays`, `icc_display`, `rendition` (all of these in a row) and `profiles`.
"""

from impasto.colour.transfer import (
    TRANSFER_CHOICES,
    decode_srgb,
    encode_srgb,
    linearisation_table,
    quantise,
)

__all__ = ["TRANSFER_CHOICES", "decode_srgb", "encode_srgb", "linearisation_table", "quantise"]
