"""Reads a STEP file with Open CASCADE and prints, as JSON, what it finds on a grid of parameters.

usage: open_cascade.py FILE [SAMPLES]

Prints {"roots": n, "valid": bool, "solids": n, "shells": n, "edges": n, "open_edges": n,
"kink": .., "volume": .., "box": [x0, y0, z0, x1, y1, z1], "faces": [{"area": .., "slack": ..,
"domain": [u0, u1, v0, v1], "samples": [[u, v, x, y, z, K, H], ..]}]}; the slack of an area is what
the tolerances of the edges, by which their courses in space and on the face differ, make of it along
their lengths; the grid includes both ends of both
parameters. Edges without length are not counted; open ones have one face. The kink is the largest
angle in degrees between the normals of two faces at places along the edge they share.
Lengths are millimetres, as Open CASCADE converts them.
"""

import json
import math
import sys

from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GeomLProp import GeomLProp_SLProps
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_REVERSED,
    TopAbs_SHELL,
    TopAbs_SOLID,
)
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.TopTools import (
    TopTools_IndexedDataMapOfShapeListOfShape,
    TopTools_IndexedMapOfShape,
)


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


# Places along an edge at which the faces beside it are compared.
PLACES = 9


def normal_at(edge, face, t):
    """The outer normal of a face at a parameter of its edge; nothing at a pole."""
    at = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0).Value(t)
    properties = GeomLProp_SLProps(BRep_Tool.Surface_s(face), at.X(), at.Y(), 1, 1e-12)
    if not properties.IsNormalDefined():
        return None
    normal = properties.Normal()
    return normal.Reversed() if face.Orientation() == TopAbs_REVERSED else normal


def kink_of(edge, faces):
    curve = BRepAdaptor_Curve(edge)
    start, end = curve.FirstParameter(), curve.LastParameter()
    worst = 0.0
    for k in range(1, PLACES + 1):
        t = start + (end - start) * k / (PLACES + 1)
        normals = [normal_at(edge, face, t) for face in faces]
        if None not in normals:
            worst = max(worst, normals[0].Angle(normals[1]))
    return math.degrees(worst)


def edges_by_faces(shape):
    """Numbers of edges with length and of those among them with one face, and the largest kink."""
    faces_of = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, faces_of)
    edges, open_edges, kink = 0, 0, 0.0
    for k in range(1, faces_of.Extent() + 1):
        edge = TopoDS.Edge_s(faces_of.FindKey(k))
        if BRep_Tool.Degenerated_s(edge):
            continue
        faces = [TopoDS.Face_s(face) for face in faces_of.FindFromIndex(k)]
        edges += 1
        open_edges += len(faces) == 1
        if len(faces) == 2 and not faces[0].IsSame(faces[1]):
            kink = max(kink, kink_of(edge, faces))
    return edges, open_edges, kink


def volume_of(shape):
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties, 1e-9)
    return properties.Mass()


def box_of(shape):
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    return [low.X(), low.Y(), low.Z(), high.X(), high.Y(), high.Z()]


def area_of(face):
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties, 1e-9)
    return properties.Mass()


def slack_of(face):
    slack = 0.0
    explorer = TopExp_Explorer(face, TopAbs_EDGE)
    while explorer.More():
        edge = TopoDS.Edge_s(explorer.Current())
        if not BRep_Tool.Degenerated_s(edge):
            properties = GProp_GProps()
            BRepGProp.LinearProperties_s(edge, properties)
            slack += properties.Mass() * BRep_Tool.Tolerance_s(edge)
        explorer.Next()
    return slack


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
        faces.append(
            {"area": area_of(face), "slack": slack_of(face), "domain": domain, "samples": found}
        )
        explorer.Next()
    valid = BRepCheck_Analyzer(shape).IsValid()
    edges, open_edges, kink = edges_by_faces(shape)
    found = {
        "roots": roots,
        "valid": valid,
        "solids": count(shape, TopAbs_SOLID),
        "shells": count(shape, TopAbs_SHELL),
        "edges": edges,
        "open_edges": open_edges,
        "kink": kink,
        "volume": volume_of(shape) if count(shape, TopAbs_SOLID) > 0 else 0.0,
        "box": box_of(shape),
        "faces": faces,
    }
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
