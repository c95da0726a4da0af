"""Reads a geomdl file with geomdl and prints, as JSON, points and derivatives on a grid.

usage: spline_library.py FILE [SAMPLES]

Prints [{"samples": [[u, v, S, S_u, S_v, S_uu, S_uv, S_vv], ..]}, ..] with three coordinates each
in one flat list; the grid includes both ends of both parameters.
"""

import json
import sys

from geomdl import exchange

ORDERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


def samples_of(surface, count):
    (u0, u1), (v0, v1) = surface.domain
    found = []
    for i in range(count):
        for j in range(count):
            u = u0 + (u1 - u0) * i / (count - 1)
            v = v0 + (v1 - v0) * j / (count - 1)
            jet = surface.derivatives(u, v, 2)
            found.append([u, v] + [x for a, b in ORDERS for x in jet[a][b]])
    return found


def main():
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 9
    surfaces = exchange.import_json(sys.argv[1])
    json.dump([{"samples": samples_of(s, count)} for s in surfaces], sys.stdout)


if __name__ == "__main__":
    main()
