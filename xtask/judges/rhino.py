"""Reads a 3DM file with openNURBS: validity of every object, points of NURBS surfaces, faces.

Called with a file that does not exist, it writes one first: surfaces of openNURBS for us to read.
"""
import json
import os
import sys

import rhino3dm


def make(path):
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Centimeters
    for rational in (False, True):
        surface = rhino3dm.NurbsSurface.Create(3, rational, 4, 3, 6, 5)
        for i in range(6):
            for j in range(5):
                w = 1.0 + 0.1 * ((i + j) % 3) if rational else 1.0
                x, y, z = i + 0.1 * j, j - 0.05 * i * i, 0.3 * ((i * j) % 4)
                surface.Points[i, j] = rhino3dm.Point4d(x * w, y * w, z * w, w)
        for k, t in enumerate([0, 0, 0, 0.3, 1.1, 2, 2, 2]):
            surface.KnotsU[k] = t
        for k, t in enumerate([-1, -1, 0, 0.5, 1, 1]):
            surface.KnotsV[k] = t
        model.Objects.AddSurface(surface)
    ball = rhino3dm.Sphere(rhino3dm.Point3d(1, 2, 3), 2.0).ToBrep()
    model.Objects.AddBrep(ball)
    model.Write(path, 7)


def main(path, count):
    if not os.path.exists(path):
        make(path)
    model = rhino3dm.File3dm.Read(path)
    if model is None:
        sys.exit("openNURBS cannot read the file")
    invalid, surfaces, faces = [], [], 0
    for k in range(len(model.Objects)):
        geometry = model.Objects[k].Geometry
        valid, why = geometry.IsValidWithLog
        if not valid:
            invalid.append(f"object {k}: {why}")
        if isinstance(geometry, rhino3dm.NurbsSurface):
            u, v = geometry.Domain(0), geometry.Domain(1)
            samples = []
            for i in range(count):
                for j in range(count):
                    s = u.T0 + (u.T1 - u.T0) * i / (count - 1)
                    t = v.T0 + (v.T1 - v.T0) * j / (count - 1)
                    p = geometry.PointAt(s, t)
                    samples.append([s, t, p.X, p.Y, p.Z])
            surfaces.append(samples)
        if isinstance(geometry, rhino3dm.Brep):
            faces += len(geometry.Faces)
    print(json.dumps({"invalid": invalid, "surfaces": surfaces, "faces": faces}))


main(sys.argv[1], int(sys.argv[2]))
