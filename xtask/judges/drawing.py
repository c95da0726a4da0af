"""Reads a DXF file with ezdxf and prints the errors that its audit finds and what is in it.

usage: drawing.py FILE

Prints {"errors": [".."], "layers": {"NAME": entities, ..}}.
"""

import json
import sys

import ezdxf


def main():
    document = ezdxf.readfile(sys.argv[1])
    auditor = document.audit()
    found = [str(error.message) for error in [*auditor.errors, *auditor.fixes]]
    layers = {}
    for entity in document.modelspace():
        layers[entity.dxf.layer] = layers.get(entity.dxf.layer, 0) + 1
    json.dump({"errors": found, "layers": layers}, sys.stdout)


if __name__ == "__main__":
    main()
