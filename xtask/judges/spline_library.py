"""Reads a geomdl file with geomdl and prints, as JSON, points and derivatives on a grid.

usage: spline_library.py FILE [SAMPLES]

Prints [{"samples": [[u, v, S, S_u, S_v, S_uu, S_uv, S_vv], ..]}, ..] with three coordinates each
in one flat list; the grid includes both ends of both parameters. geomdl rescales knots to [0, 1],
so parameters and derivatives are those of a domain scaled to the unit square.
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
            u, v = i / (count - 1), j / (count - 1)
            jet = surface.derivatives(u0 + (u1 - u0) * u, v0 + (v1 - v0) * v, 2)
            scales = [(u1 - u0) ** a * (v1 - v0) ** b for a, b in ORDERS]
            vectors = [jet[a][b] for a, b in ORDERS]
            found.append([u, v] + [s * x for s, vector in zip(scales, vectors) for x in vector])
    return found


def main():
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 9
    surfaces = exchange.import_json(sys.argv[1])
    json.dump([{"samples": samples_of(s, count)} for s in surfaces], sys.stdout)


if __name__ == "__main__":
    main()
