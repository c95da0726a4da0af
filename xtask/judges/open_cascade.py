"""Reads a STEP file with Open CASCADE and prints, as JSON, what it finds on a grid of parameters.

usage: open_cascade.py FILE [SAMPLES]

Prints {"roots": n, "valid": bool, "faces": [{"name": .., "domain": [u0, u1, v0, v1],
"samples": [[u, v, x, y, z, K, H], ..]}]}; the grid includes both ends of both parameters.
Lengths are millimetres, as Open CASCADE converts them.
"""

import json
import sys

from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.GeomLProp import GeomLProp_SLProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS


def samples_of(surface, count):
    u0, u1, v0, v1 = surface.Bounds()
    found = []
    for i in range(count):
        for j in range(count):
            u = u0 + (u1 - u0) * i / (count - 1)
            v = v0 + (v1 - v0) * j / (count - 1)
            properties = GeomLProp_SLProps(surface, u, v, 2, 1e-12)
            # Asked first: some versions return 0 for the first curvature otherwise.
            if not properties.IsCurvatureDefined():
                continue
            point = properties.Value()
            found.append(
                [u, v, point.X(), point.Y(), point.Z(),
                 properties.GaussianCurvature(), properties.MeanCurvature()]
            )
    return [u0, u1, v0, v1], found


def main():
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 9
    reader = STEPControl_Reader()
    if reader.ReadFile(sys.argv[1]) != IFSelect_RetDone:
        sys.exit(f"{sys.argv[1]}: Open CASCADE cannot read it")
    roots = reader.TransferRoots()
    shape = reader.OneShape()
    faces = []
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        surface = BRep_Tool.Surface_s(TopoDS.Face_s(explorer.Current()))
        domain, found = samples_of(surface, count)
        faces.append({"domain": domain, "samples": found})
        explorer.Next()
    valid = BRepCheck_Analyzer(shape).IsValid()
    json.dump({"roots": roots, "valid": valid, "faces": faces}, sys.stdout)


if __name__ == "__main__":
    main()
