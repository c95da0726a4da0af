"""Reads a STEP file with Open CASCADE and prints, as JSON, what it finds on a grid of parameters.

usage: open_cascade.py FILE [SAMPLES]

Prints {"roots": n, "valid": bool, "shells": n, "edges": n, "faces": [{"area": ..,
"domain": [u0, u1, v0, v1], "samples": [[u, v, x, y, z, K, H], ..]}]}; the grid includes both ends
of both parameters.
Lengths are millimetres, as Open CASCADE converts them.
"""

import json
import sys

from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GeomLProp import GeomLProp_SLProps
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.TopTools import TopTools_IndexedMapOfShape


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


def count(shape, kind):
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return found.Extent()


def area_of(face):
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties, 1e-9)
    return properties.Mass()


def main():
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 9
    reader = STEPControl_Reader()
    if reader.ReadFile(sys.argv[1]) != IFSelect_RetDone:
        sys.exit(f"{sys.argv[1]}: Open CASCADE cannot read it")
    roots = reader.TransferRoots()
    shape = reader.OneShape()
    faces = []
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face_s(explorer.Current())
        domain, found = samples_of(BRep_Tool.Surface_s(face), samples)
        faces.append({"area": area_of(face), "domain": domain, "samples": found})
        explorer.Next()
    valid = BRepCheck_Analyzer(shape).IsValid()
    shells, edges = count(shape, TopAbs_SHELL), count(shape, TopAbs_EDGE)
    found = {"roots": roots, "valid": valid, "shells": shells, "edges": edges, "faces": faces}
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
