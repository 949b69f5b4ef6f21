#!/usr/bin/env python3
"""A map's heights as a picture: height_image.py MAP HEIGHTS.png [CELL]

A 16-bit grey PNG, and beside it a .json with its scale: height = offset + scale * value, 0 for nothing; row 0 is the largest
y, column 0 the smallest x, `origin` the first pixel's centre; in the map turned so that up is +z.
"""
import json
import pathlib
import struct
import sys
import zlib

import numpy as np

import octosurf


def png(pixels: "np.ndarray[tuple[int, int], np.dtype[np.float64]]") -> bytes:
    """Of (rows, columns) uint16."""
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels.astype(">u2"))
    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def main() -> None:
    file, cell = pathlib.Path(sys.argv[2]), float(sys.argv[3]) if len(sys.argv) > 3 else 0.0
    grid = octosurf.height_grid(octosurf.load(sys.argv[1]).snapshot(), cell=cell)
    heights = grid.elevation.T[:, ::-1]  # the grid's columns run against y, its rows against x
    low, high = float(np.nanmin(heights)), float(np.nanmax(heights))
    scale = max(1e-4, (high - low) / 65534)
    pixels = np.where(np.isnan(heights), 0, 1 + np.round((np.nan_to_num(heights) - low) / scale))
    file.write_bytes(png(pixels))
    file.with_suffix(".json").write_text(json.dumps(
        {"image": file.name, "width": heights.shape[1], "height": heights.shape[0], "scale": scale, "offset": low - scale,
         "no_data": 0, "cell": grid.cell, "origin": grid.center_of(grid.elevation.shape[0] - 1, 0).tolist()}, indent=1))
    print(f"{file}: {heights.shape[1]} x {heights.shape[0]} cells of {grid.cell:g} m")


main()
