"""Conversions to other libraries, which are imported on first use."""


def to_shapely(rings):
    """A shapely MultiPolygon: outer rings with their holes."""
    from shapely.geometry import MultiPolygon, Polygon

    outer_of = rings.outer_of
    holes = {}
    for k, outer in enumerate(outer_of):
        if outer >= 0:
            holes.setdefault(int(outer), []).append(rings[k])
    return MultiPolygon([Polygon(rings[k], holes.get(k, []))
                         for k, outer in enumerate(outer_of) if outer < 0])


def to_path(rings):
    """A matplotlib Path of all rings, for PathPatch, which does not fill the holes."""
    import numpy
    from matplotlib.path import Path

    # Copies the offsets: numpy.insert modifies its indices in place, and requires signed integers.
    offsets = rings.offsets.astype(numpy.intp)
    starts, ends = offsets[:-1], offsets[1:]
    vertices = numpy.insert(rings.points, ends, rings.points[starts], axis=0)
    codes = numpy.full(len(vertices), Path.LINETO, Path.code_type)
    codes[starts + numpy.arange(len(starts))] = Path.MOVETO
    codes[ends + numpy.arange(len(ends))] = Path.CLOSEPOLY
    return Path(vertices, codes)


def to_triangulation(mesh):
    """A matplotlib Triangulation, for triplot, tripcolor and tricontour.

    Its interpolators and get_trifinder refuse T-junctions. The fills "conforming" and "polygon" have no
    T-junctions; "greedy" has none if particles carry attributes.
    """
    from matplotlib.tri import Triangulation

    return Triangulation(mesh.points[:, 0], mesh.points[:, 1], mesh.triangles)


def to_meshio(mesh, attributes=None):
    """A meshio Mesh with z = 0. meshio writes VTK, VTU, STL, Gmsh and other formats.

    attributes: Result.attributes, or a part of them.
    """
    import meshio
    import numpy

    # Some writers of meshio require three coordinates per point. The writer of Gmsh files requires signed
    # indices.
    points = numpy.pad(mesh.points, ((0, 0), (0, 1)))
    return meshio.Mesh(points, [("triangle", mesh.triangles.astype(numpy.int64))],
                       point_data=dict(attributes or {}))


def surface_to_meshio(surface, attributes=None):
    """A meshio Mesh. meshio writes VTK, VTU, PLY, OBJ, STL, Gmsh and other formats.

    attributes: Result.attributes, or a part of them.
    """
    import meshio
    import numpy

    return meshio.Mesh(surface.points, [("triangle", surface.triangles.astype(numpy.int64))],
                       point_data=dict(attributes or {}))


def to_svg(result, width=800):
    """The text of an SVG picture: outline and mesh, `width` pixels wide. A surface with points is
    refused."""
    if len(result.surface.points) > 0:
        raise ValueError("to_svg: the result is a surface, and to_svg draws outlines; draw a section "
                         "(result.sections[0].to_svg()), write a mesh (result.surface.to_meshio()), or let "
                         "`partiemc replay --surface --format svg` draw the surface")
    points = result.rings.points
    if len(points) == 0:
        return '<svg xmlns="http://www.w3.org/2000/svg"/>\n'
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    margin = max(right - left, top - bottom) / 20

    def path(rings):
        return " ".join("M" + " ".join(f"{x:.6g},{-y:.6g}" for x, y in ring) + "Z" for ring in rings)

    cuts = set(result.rings.cuts.tolist())

    def outline(rings):  # Without the segments on faces of a periodic box.
        if not cuts:
            return path(rings)
        segments = []
        for first, last in zip(rings.offsets[:-1].tolist(), rings.offsets[1:].tolist()):
            for k in range(first, last):
                if k not in cuts:
                    ends = points[[k, k + 1 if k + 1 < last else first]]
                    segments.append("M" + " ".join(f"{x:.6g},{-y:.6g}" for x, y in ends))
        return " ".join(segments)

    box = (left - margin, -top - margin, right - left + 2 * margin, top - bottom + 2 * margin)
    style = f'stroke-width="{margin / 30:.3g}" stroke-linejoin="round"'
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" viewBox="'
            + " ".join(f"{number:.6g}" for number in box) + '">\n'
            f'<path fill="#cfe3f5" fill-rule="evenodd" d="{path(result.rings)}"/>\n'
            f'<path fill="none" stroke="#7fa8cc" {style} '
            f'd="{path(result.mesh.points[result.mesh.triangles])}"/>\n'
            f'<path fill="none" stroke="#123a5c" stroke-width="{margin / 12:.3g}" '
            f'd="{outline(result.rings)}"/>\n</svg>\n')
