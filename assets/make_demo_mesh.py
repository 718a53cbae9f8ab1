#!/usr/bin/env python3
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
"""Models the mesh of the demo, a hollow valve body, and checks it.

    make_demo_mesh.py [OUTPUT.obj]          default: valve_body.obj beside this file

Made as a modeller would: a block of quads, patches cut out of it, tubes turned from the
holes, bores, a handle, caps; then the corners of the block are merged or cut; at last
everything that is not pinned to a turned profile is faired. The result depends on nothing
but this file.

Conventions: z is up; faces are counter-clockwise seen from outside; a loop is the list of
vertices around a hole, in the order in which the missing face would name them.
"""

import cmath
import math
import pathlib
import sys
from collections import Counter, defaultdict

# --- vectors ----------------------------------------------------------------------------


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(s, a):
    return (s * a[0], s * a[1], s * a[2])


def combine(*terms):
    """The sum of factor * vector over the (factor, vector) terms."""
    return tuple(sum(s * v[k] for s, v in terms) for k in range(3))


def lerp(a, b, t):
    return combine((1.0 - t, a), (t, b))


def mean(points):
    return combine(*((1.0 / len(points), p) for p in points))


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return (x, y, z)


def length(a):
    return math.sqrt(dot(a, a))


def unit(a):
    return scaled(1.0 / length(a), a)


def angle(a, b):
    """The angle between two vectors, in degrees."""
    return math.degrees(math.atan2(length(cross(a, b)), dot(a, b)))


# --- the mesh and its operators ---------------------------------------------------------


def sides(face):
    """The directed edges of a face or a loop."""
    return [(face[i], face[(i + 1) % len(face)]) for i in range(len(face))]


def follow(successor):
    """The closed chain a dictionary of successors describes, from its smallest vertex."""
    chain = [min(successor)]
    while successor[chain[-1]] != chain[0]:
        chain.append(successor[chain[-1]])
    return chain


def without(loop, corners):
    return [v for i, v in enumerate(loop) if i not in corners]


def with_twice(loop, corners):
    return [v for i, v in enumerate(loop) for _ in range(2 if i in corners else 1)]


class Mesh:
    """Points, and faces as vertex lists; a face that was removed is None."""

    def __init__(self):
        self.points = []
        self.faces = []
        self.pinned = set()

    def add_points(self, points, pin=True):
        added = list(range(len(self.points), len(self.points) + len(points)))
        self.points += points
        self.pinned.update(added if pin else [])
        return added

    def add_face(self, face):
        self.faces.append(list(face))
        return len(self.faces) - 1

    def at(self, vertices):
        return [self.points[v] for v in vertices]

    def faces_around(self, vertex):
        return [f for f, face in enumerate(self.faces) if face and vertex in face]

    def towards(self, band, direction):
        """The position in a band of the face that lies farthest in a direction."""
        reach = [dot(mean(self.at(self.faces[f])), direction) for f in band]
        return max(range(len(band)), key=reach.__getitem__)

    def cut(self, patch):
        """Removes the faces of a disk-like patch; returns the loop of the hole."""
        edges = [edge for f in patch for edge in sides(self.faces[f])]
        for f in patch:
            self.faces[f] = None
        return follow({a: b for a, b in edges if (b, a) not in edges})

    def extend(self, loop, points, pin=True):
        """Grows a band of quads from a loop to a new ring; returns ring and band."""
        ring = self.add_points(points, pin)
        quads = [[a, b, d, c] for (a, b), (c, d) in zip(sides(loop), sides(ring))]
        return ring, [self.add_face(quad) for quad in quads]

    def extrude(self, patch, place):
        """Lifts a patch to where place puts its points, on a band of quads."""
        lifted = [self.faces[f] for f in patch]
        loop = self.cut(patch)
        inside = sorted({v for face in lifted for v in face})
        top = dict(zip(inside, self.add_points([place(p) for p in self.at(inside)])))
        for a, b in sides(loop):
            self.add_face([a, b, top[b], top[a]])
        return [self.add_face(top[v] for v in face) for face in lifted]

    def bridge(self, loop, other):
        """Joins two loops that face each other by a band of quads, least twisted."""
        n = len(loop)
        mirrored = other[::-1]

        def turned(k):
            return mirrored[k:] + mirrored[:k]

        def gap(k):
            pairs = zip(self.at(loop), self.at(turned(k)))
            return sum(length(sub(p, q)) for p, q in pairs)

        partner = turned(min(range(n), key=gap))
        for (a, b), (c, d) in zip(sides(loop), sides(partner)):
            self.add_face([a, b, d, c])

    def cap_fan(self, loop, pole):
        """Closes a loop of n by n triangles around a pole."""
        (centre,) = self.add_points([pole])
        for a, b in sides(loop):
            self.add_face([a, b, centre])

    def cap_pole(self, loop, pole):
        """Closes a loop of 2 n by n quads around a pole."""
        (centre,) = self.add_points([pole])
        for i in range(0, len(loop), 2):
            self.add_face([loop[i - 1], loop[i], loop[i + 1], centre])

    def cap_pentagons(self, loop, points):
        """Closes a loop of 2 n by n pentagons around an n-gon."""
        ring = self.add_points(points)
        for i in range(len(ring)):
            outer = [loop[2 * i - 2], loop[2 * i - 1], loop[2 * i]]
            self.add_face(outer + [ring[i], ring[i - 1]])
        self.add_face(ring)

    def narrow(self, loop, corners, points, with_triangles=False, pin=True):
        """Extends a loop to a ring without its corners, each swallowed by a pentagon.

        Corners are positions in the loop. With triangles, each pentagon is cut in three.
        """
        ring = self.add_points(points, pin)
        partner = dict(zip(without(loop, corners), ring))
        for i, b in enumerate(loop):
            a, c = loop[i - 1], loop[(i + 1) % len(loop)]
            if b in partner and a in partner:
                self.add_face([a, b, partner[b], partner[a]])
            elif b not in partner and with_triangles:
                self.add_face([a, b, partner[a]])
                self.add_face([b, partner[c], partner[a]])
                self.add_face([b, c, partner[c]])
            elif b not in partner:
                self.add_face([a, b, c, partner[c], partner[a]])
        return ring

    def widen(self, loop, corners, points, pin=True):
        """Extends a loop to a ring with each corner twice, a triangle between the two."""
        ring = self.add_points(points, pin)
        spread = with_twice(loop, corners)
        for i, (a, b) in enumerate(sides(spread)):
            c, d = ring[(i + 1) % len(ring)], ring[i]
            self.add_face([a, c, d] if a == b else [a, b, c, d])
        return ring

    def dissolve_vertex(self, vertex):
        """Merges the faces around a vertex into one."""
        self.add_face(self.cut(self.faces_around(vertex)))

    def truncate_vertex(self, vertex, t):
        """Cuts a vertex off at the fraction t of its edges, which leaves a new face."""
        new_vertex = {}
        successor = {}
        for f in self.faces_around(vertex):
            face = self.faces[f]
            i = face.index(vertex)
            ends = (face[i - 1], face[(i + 1) % len(face)])
            for end in ends:
                if end not in new_vertex:
                    point = lerp(self.points[vertex], self.points[end], t)
                    (new_vertex[end],) = self.add_points([point], pin=False)
            enter, leave = (new_vertex[end] for end in ends)
            face[i : i + 1] = [enter, leave]
            successor[leave] = enter
        self.add_face(follow(successor))


# --- turning and lofting ----------------------------------------------------------------


class Lathe:
    """Turns rings about an axis, at the phase that fits the vertices of a loop best."""

    def __init__(self, mesh, loop, origin, axis):
        self.origin, self.axis = origin, unit(axis)
        self.u = unit(cross(self.axis, (0.31, 0.53, 0.79)))
        self.v = cross(self.axis, self.u)
        self.fit(mesh, loop)

    def fit(self, mesh, loop):
        total = 0.0
        for k, point in enumerate(mesh.at(loop)):
            d = sub(point, self.origin)
            turn = cmath.exp(-2j * math.pi * k / len(loop))
            total += complex(dot(d, self.u), dot(d, self.v)) * turn
        self.phase = cmath.phase(total)

    def pole(self, height):
        return combine((1.0, self.origin), (height, self.axis))

    def ring(self, height, radius, n):
        points = []
        for k in range(n):
            t = self.phase + 2.0 * math.pi * k / n
            u, v = radius * math.cos(t), radius * math.sin(t)
            points.append(combine((1.0, self.pole(height)), (u, self.u), (v, self.v)))
        return points

    def turn(self, mesh, loop, profile, pin=True):
        """Extends a loop along a profile of (height, radius); returns loop and bands."""
        bands = []
        for height, radius in profile:
            loop, band = mesh.extend(loop, self.ring(height, radius, len(loop)), pin)
            bands.append(band)
        return loop, bands


def bezier(control, t):
    """Point and tangent direction of a cubic Bezier curve."""
    p, q, r, s = control
    a, b, c = lerp(p, q, t), lerp(q, r, t), lerp(r, s, t)
    d, e = lerp(a, b, t), lerp(b, c, t)
    return lerp(d, e, t), unit(sub(e, d))


def loft_handle(mesh, loop, other, spine, width, height, n_rings):
    """Joins two loops of six by a tube along a Bezier spine in the xz-plane.

    Every hexagon has two vertices at the level of the spine, to its left and right. The
    tube flares at both ends; its first and last ring stay free.
    """
    side = (0.0, 1.0, 0.0)
    start = max(range(6), key=lambda i: mesh.points[loop[i]][1])
    loop = loop[start:] + loop[:start]
    for k in range(1, n_rings + 1):
        s = k / (n_rings + 1)
        centre, tangent = bezier(spine, s)
        up = cross(tangent, side)
        flare = 1.0 + 0.6 * (2.0 * s - 1.0) ** 6
        points = []
        for i in range(6):
            w = flare * width * math.cos(math.pi * i / 3.0)
            h = flare * height * math.sin(math.pi * i / 3.0)
            points.append(combine((1.0, centre), (w, side), (h, up)))
        loop, _ = mesh.extend(loop, points, pin=1 < k < n_rings)
    mesh.bridge(loop, other)


# --- the valve body ---------------------------------------------------------------------

CELLS = (7, 5, 5)  # faces of the block along x, y, z
HALF_SIZE = (0.84, 0.56, 0.56)
NECK_X = 0.24
RIGHT, LEFT = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)
FRONT = (0.0, 1.0, 0.0)
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
CENTRE = (0.0, 0.0, 0.0)
CORNERS = (0, 3, 6, 9)  # where the loop of a patch of 3 x 3 faces turns


def rounded(p, roundness):
    """Pulls a point of the cube [-1, 1]^3 towards the unit sphere."""
    ball = []
    for k in range(3):
        a, b = p[k - 1] ** 2, p[k - 2] ** 2
        ball.append(p[k] * math.sqrt(1.0 - a / 2.0 - b / 2.0 + a * b / 3.0))
    return lerp(p, tuple(ball), roundness)


def make_block(mesh):
    """A closed block of quads: its vertices by lattice site, its faces by cell.

    A cell is (axis, end, i, j), where i and j count along the two axes that follow.
    """
    sites = [
        (i, j, k)
        for i in range(CELLS[0] + 1)
        for j in range(CELLS[1] + 1)
        for k in range(CELLS[2] + 1)
        if i in (0, CELLS[0]) or j in (0, CELLS[1]) or k in (0, CELLS[2])
    ]
    points = []
    for site in sites:
        p = rounded([2.0 * s / n - 1.0 for s, n in zip(site, CELLS)], 0.7)
        points.append(tuple(h * c for h, c in zip(HALF_SIZE, p)))
    vertex = dict(zip(sites, mesh.add_points(points, pin=False)))

    cell = {}
    for axis, end in ((a, e) for a in range(3) for e in (0, 1)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for i, j in ((i, j) for i in range(CELLS[u]) for j in range(CELLS[v])):
            face = []
            for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                site = [0, 0, 0]
                site[axis], site[u], site[v] = end * CELLS[axis], i + di, j + dj
                face.append(vertex[tuple(site)])
            cell["xyz"[axis], end, i, j] = mesh.add_face(face if end else face[::-1])
    return vertex, cell


class ValveBody:
    """The mesh under construction and what later steps need from earlier ones."""

    def __init__(self):
        self.mesh = Mesh()
        self.vertex, self.cell = make_block(self.mesh)

    def cut_patch(self, axis, end, columns, rows):
        """Cuts cells out of the block; the loop starts at a corner of the patch."""
        cells = [self.cell[axis, end, i, j] for i in columns for j in rows]
        return self.mesh.cut(cells)

    def cut_column(self, bands, direction):
        """Cuts a column of faces, one a band, out of the side of a tube."""
        i = self.mesh.towards(bands[0], direction)
        return self.mesh.cut([band[i] for band in bands])

    def make_side_port(self, end, axis, with_triangles):
        """Tube, flange and start of the bore, where twelve sides become eight."""
        mesh = self.mesh
        loop = self.cut_patch("x", end, range(1, 4), range(1, 4))
        lathe = Lathe(mesh, loop, CENTRE, axis)
        loop, _ = lathe.turn(mesh, loop, [(0.83, 0.36)], pin=False)
        profile = [(0.90, 0.35), (0.97, 0.345), (1.05, 0.35), (1.095, 0.415)]
        profile += [(1.13, 0.505), (1.20, 0.54), (1.265, 0.49), (1.28, 0.39)]
        loop, tube = lathe.turn(mesh, loop, profile)
        lathe.fit(mesh, without(loop, CORNERS))
        loop = mesh.narrow(loop, CORNERS, lathe.ring(1.20, 0.315, 8), with_triangles)
        loop, _ = lathe.turn(mesh, loop, [(1.02, 0.295), (0.80, 0.29)])
        return lathe, loop, tube

    def make_bore(self, lathe, loop, far_loop):
        """Joins the side ports; returns the hole in the roof below the neck."""
        mesh = self.mesh
        loop, _ = lathe.turn(mesh, loop, [(0.60, 0.29)])
        stops = (0.45, 0.05, -0.10)
        loop, bands = lathe.turn(mesh, loop, [(x, 0.29) for x in stops], pin=False)
        loop, _ = lathe.turn(mesh, loop, [(-0.25, 0.29), (-0.42, 0.29), (-0.60, 0.29)])
        mesh.bridge(loop, far_loop)
        top = mesh.towards(bands[1], UP)
        return mesh.cut([bands[1][top - 1], bands[1][top], bands[1][(top + 1) % 8]])

    def make_neck(self, roof_hole):
        """Eight sides on a hole of twelve: a pentagon at each corner of the root."""
        mesh = self.mesh
        loop = self.cut_patch("z", 1, range(3, 6), range(1, 4))
        lathe = Lathe(mesh, without(loop, CORNERS), (NECK_X, 0.0, 0.0), UP)
        loop = mesh.narrow(loop, CORNERS, lathe.ring(0.66, 0.30, 8), pin=False)
        tube = [(0.75, 0.285), (0.83, 0.28), (0.91, 0.28), (1.00, 0.295)]
        flange = [(1.04, 0.36), (1.09, 0.395), (1.155, 0.39), (1.19, 0.34), (1.18, 0.275)]
        loop, neck = lathe.turn(mesh, loop, tube + flange)
        loop, _ = lathe.turn(mesh, loop, [(1.11, 0.235), (0.95, 0.21), (0.79, 0.205)])
        loop, _ = lathe.turn(mesh, loop, [(0.63, 0.205), (0.48, 0.205)], pin=False)
        mesh.bridge(loop, roof_hole)
        return neck

    def make_handle(self, neck, far_tube):
        """From the neck over to the far tube."""
        mesh = self.mesh
        top = self.cut_column(neck[1:3], LEFT)
        low = self.cut_column(far_tube[0:2], UP)
        mesh.pinned -= set(top)
        spine = [(-0.03, 0.0, 0.83), (-0.52, 0.0, 0.90), (-0.92, 0.0, 1.26)]
        spine.append((-0.90, 0.0, 0.34))
        loft_handle(mesh, top, low, spine, width=0.10, height=0.07, n_rings=9)

    def make_nipple(self, tube):
        """A nub on the near tube, closed by a pole of six triangles."""
        mesh = self.mesh
        loop = self.cut_column(tube[0:2], UP)
        mesh.pinned -= set(loop)
        lathe = Lathe(mesh, loop, (0.90, 0.0, 0.0), UP)
        loop, _ = lathe.turn(mesh, loop, [(0.41, 0.085), (0.47, 0.085), (0.51, 0.06)])
        mesh.cap_fan(loop, lathe.pole(0.525))

    def make_cover(self):
        """On the front, a cover of sixteen sides on a hole of twelve.

        It is closed by pentagons: four that lead back to twelve, six around a hexagon.
        """
        mesh = self.mesh
        loop = self.cut_patch("y", 1, range(1, 4), range(3, 6))
        lathe = Lathe(mesh, with_twice(loop, CORNERS), (NECK_X, 0.0, 0.0), FRONT)
        loop = mesh.widen(loop, CORNERS, lathe.ring(0.58, 0.33, 16), pin=False)
        profile = [(0.67, 0.325), (0.71, 0.36), (0.77, 0.375), (0.82, 0.35)]
        loop, _ = lathe.turn(mesh, loop, profile + [(0.845, 0.29)])
        corners = (2, 6, 10, 14)
        lathe.fit(mesh, without(loop, corners))
        loop = mesh.narrow(loop, corners, lathe.ring(0.855, 0.21, 12))
        lathe.fit(mesh, loop[::2])
        mesh.cap_pentagons(loop, lathe.ring(0.86, 0.11, 6))

    def make_plug(self):
        """On the front, a plug closed by a pole of eight triangles."""
        mesh = self.mesh
        loop = self.cut_patch("y", 1, range(1, 4), range(1, 2))
        lathe = Lathe(mesh, loop, (-0.40, 0.0, 0.0), (-0.15, 1.0, 0.0))
        loop, _ = lathe.turn(mesh, loop, [(0.51, 0.155)], pin=False)
        loop, _ = lathe.turn(mesh, loop, [(0.60, 0.155), (0.655, 0.15), (0.69, 0.105)])
        mesh.cap_fan(loop, lathe.pole(0.705))

    def make_pad(self):
        """On the back, a raised pad, square and rounded."""
        patch = [self.cell["y", 0, i, j] for i in range(1, 4) for j in range(2, 5)]
        for y, s in ((-0.58, 0.9), (-0.69, 0.82)):
            patch = self.mesh.extrude(patch, lambda p, y=y, s=s: (s * p[0], y, s * p[2]))

    def make_foot(self):
        """Below, a flared foot closed by a pole of eight quads."""
        mesh = self.mesh
        loop = self.cut_patch("z", 0, range(1, 6), range(1, 4))
        lathe = Lathe(mesh, loop, CENTRE, DOWN)
        loop, _ = lathe.turn(mesh, loop, [(0.67, 0.385)], pin=False)
        flare = [(0.77, 0.385), (0.85, 0.45), (0.895, 0.54), (0.95, 0.595), (1.01, 0.58)]
        loop, _ = lathe.turn(mesh, loop, flare + [(1.025, 0.49), (1.00, 0.31)])
        mesh.cap_pole(loop, lathe.pole(0.985))

    def edit_corners(self):
        """Merges or cuts the faces at corners of the block, all of valence three."""
        nx, ny, nz = CELLS
        for site in ((nx, ny, nz), (0, 0, nz)):
            self.mesh.dissolve_vertex(self.vertex[site])
        for site in ((0, ny, nz), (nx, ny, 0), (nx, 0, nz)):
            self.mesh.truncate_vertex(self.vertex[site], 0.5)


def build():
    body = ValveBody()
    lathe, near_loop, near_tube = body.make_side_port(1, RIGHT, with_triangles=False)
    _, far_loop, far_tube = body.make_side_port(0, LEFT, with_triangles=True)
    roof_hole = body.make_bore(lathe, near_loop, far_loop)
    neck = body.make_neck(roof_hole)
    body.make_handle(neck, far_tube)
    body.make_nipple(near_tube)
    body.make_cover()
    body.make_plug()
    body.make_pad()
    body.make_foot()
    fair(body.mesh, pull=0.002, n_steps=200)

    # After the fairing, so that the new faces lie where the surface already is; the
    # strong pull then only settles them.
    body.edit_corners()
    fair(body.mesh, pull=0.1, n_steps=50)
    return body.mesh


# --- fairing ----------------------------------------------------------------------------


def neighbours_of(mesh):
    near = defaultdict(set)
    for face in filter(None, mesh.faces):
        for a, b in sides(face):
            near[a].add(b)
            near[b].add(a)
    return {v: sorted(near[v]) for v in sorted(near)}


def fair(mesh, pull, n_steps):
    """Minimises sum |L p|^2 + pull sum |p - p0|^2 over the points that are not pinned.

    L is the umbrella operator, a point minus the mean of its neighbours; the first sum is
    the energy of a thin plate. The pull towards the modelled points p0 keeps the body
    full. Solved by conjugate gradients.
    """
    near = neighbours_of(mesh)
    free = [v for v in near if v not in mesh.pinned]

    def umbrella(p):
        return {v: sub(p[v], mean([p[w] for w in near[v]])) for v in near}

    def system(p):
        """L^T L p + pull p on the free points."""
        q = umbrella(p)
        out = {}
        for v in free:
            spread = [(-1.0 / len(near[w]), q[w]) for w in near[v]]
            out[v] = combine((1.0, q[v]), (pull, p[v]), *spread)
        return out

    def inner(a, b):
        return sum(dot(a[v], b[v]) for v in free)

    position = dict(enumerate(mesh.points))
    start = system(position)
    residual = {v: combine((pull, position[v]), (-1.0, start[v])) for v in free}
    step = dict(residual)
    pinned = {v: (0.0, 0.0, 0.0) for v in near if v in mesh.pinned}
    square = inner(residual, residual)
    for _ in range(n_steps):
        image = system({**pinned, **step})
        t = square / inner(step, image)
        for v in free:
            position[v] = combine((1.0, position[v]), (t, step[v]))
            residual[v] = combine((1.0, residual[v]), (-t, image[v]))
        previous, square = square, inner(residual, residual)
        t = square / previous
        step = {v: combine((1.0, residual[v]), (t, step[v])) for v in free}
    mesh.points = [position[v] for v in range(len(mesh.points))]


# --- checks -----------------------------------------------------------------------------

MIN_ANGLE = 30.0  # of a face at a corner, degrees
MAX_ANGLE = 160.0  # a quad at a pole with two sides of a ring of 16 has 157.5
MAX_WARP = 0.2  # distance of a corner from the plane of its face / mean edge of the face
MAX_BEND = 90.0  # between the normals of faces that share an edge, degrees
MAX_EDGE_RATIO = 8.0  # longest edge of the mesh / shortest
MAX_ASPECT = 5.0  # longest edge of a face / shortest
N_FACES = (500, 1000)
GENUS = 3


class Report:
    """Prints figures and remembers what is wrong."""

    def __init__(self):
        self.n_failed = 0

    def figure(self, name, value):
        print(f"{name:34} {value}")

    def require(self, name, holds, value=""):
        self.n_failed += not holds
        print(f"{name:34} {value} {'ok' if holds else 'FAILED'}")


def histogram(values):
    return ", ".join(f"{k}: {n}" for k, n in sorted(Counter(values).items()))


def fan_is_closed(vertex, around, faces):
    """Whether the faces around a vertex form one closed fan."""
    successor = {}
    for f in around:
        face = faces[f]
        i = face.index(vertex)
        successor[face[(i + 1) % len(face)]] = face[i - 1]
    if set(successor) != set(successor.values()):
        return False
    return len(follow(successor)) == len(around)


def n_components(faces, faces_at):
    seen = set()
    count = 0
    for start in range(len(faces)):
        count += start not in seen
        todo = [start]
        while todo:
            f = todo.pop()
            if f not in seen:
                seen.add(f)
                todo += [g for v in faces[f] for g in faces_at[v]]
    return count


def check_topology(report, points, faces):
    edges = [edge for face in faces for edge in sides(face)]
    faces_at = [[] for _ in points]
    for f, face in enumerate(faces):
        for v in face:
            faces_at[v].append(f)
    n_edges = len(edges) // 2
    known = set(edges)
    euler = len(points) - n_edges + len(faces)

    report.figure("vertices, edges, faces", f"{len(points)}, {n_edges}, {len(faces)}")
    in_range = N_FACES[0] <= len(faces) <= N_FACES[1]
    report.require("number of faces", in_range, N_FACES)
    report.require("no vertex twice in a face", all(len(set(f)) == len(f) for f in faces))
    once = len(known) == len(edges)
    report.require("each directed edge once", once)
    report.require("closed", all((b, a) in known for a, b in edges))
    fans = all(fan_is_closed(v, around, faces) for v, around in enumerate(faces_at))
    report.require("one fan at each vertex", fans)
    report.require("connected", n_components(faces, faces_at) == 1)
    report.require("genus", euler == 2 - 2 * GENUS, GENUS)

    sizes = [len(face) for face in faces]
    valences = [len(around) for around in faces_at]
    all_sizes = set(sizes) == {3, 4, 5, 6} and sizes.count(4) > len(faces) / 2
    report.require("faces by size", all_sizes, histogram(sizes))
    all_valences = set(valences) == {3, 4, 5, 6, 8}
    report.require("vertices by valence", all_valences, histogram(valences))
    check_isolation(report, faces, faces_at, valences)


def check_isolation(report, faces, faces_at, valences):
    """Of n-gons and of extraordinary vertices, some stand alone and some do not."""
    n_gons = [f for f, face in enumerate(faces) if len(face) != 4]
    extraordinary = [v for v, n in enumerate(valences) if n != 4]
    alone = [
        len(faces[f])
        for f in n_gons
        if all(valences[v] == 4 for v in faces[f])
        and all(g == f or len(faces[g]) == 4 for v in faces[f] for g in faces_at[v])
    ]
    lone = [
        valences[v]
        for v in extraordinary
        if all(len(faces[f]) == 4 for f in faces_at[v])
        and all(w == v or valences[w] == 4 for f in faces_at[v] for w in faces[f])
    ]
    some = 0 < len(alone) < len(n_gons)
    report.require("isolated n-gons by size", some, histogram(alone))
    some = 0 < len(lone) < len(extraordinary)
    report.require("isolated vertices by valence", some, histogram(lone))


def area_vector(corners):
    terms = [cross(p, q) for p, q in sides(corners)]
    return scaled(0.5 * len(terms), mean(terms))


def check_shape(report, points, faces):
    angles, warps, aspects, turns = [], [], [], []
    normal_across = {}
    volume = 0.0
    for face in faces:
        corners = [points[v] for v in face]
        area, centre = area_vector(corners), mean(corners)
        normal = unit(area)
        volume += dot(area, centre) / 3.0
        spokes = [sub(q, p) for p, q in sides(corners)]
        lengths = [length(e) for e in spokes]
        for before, after in ((spokes[i - 1], spokes[i]) for i in range(len(spokes))):
            angles.append(angle(scaled(-1.0, before), after))
            turns.append(dot(cross(before, after), normal))
        offsets = [abs(dot(sub(p, centre), normal)) for p in corners]
        warps.append(max(offsets) * len(lengths) / sum(lengths))
        aspects.append(max(lengths) / min(lengths))
        normal_across.update((edge, normal) for edge in sides(face))

    bends = [angle(n, normal_across[b, a]) for (a, b), n in normal_across.items()]
    edges = [length(sub(points[a], points[b])) for a, b in normal_across]
    ratio = max(edges) / min(edges)
    box = [(min(c), max(c)) for c in zip(*points)]
    report.figure("bounding box", ", ".join(f"[{a:.3f}, {b:.3f}]" for a, b in box))
    report.require("volume, positive", volume > 0.0, f"{volume:.4f}")
    report.require("every face convex", min(turns) > 0.0)
    report.require("smallest angle", min(angles) >= MIN_ANGLE, f"{min(angles):.1f}")
    report.require("largest angle", max(angles) <= MAX_ANGLE, f"{max(angles):.1f}")
    report.require("largest warp of a face", max(warps) <= MAX_WARP, f"{max(warps):.3f}")
    report.require("largest bend at an edge", max(bends) <= MAX_BEND, f"{max(bends):.1f}")
    report.figure("shortest and longest edge", f"{min(edges):.4f}, {max(edges):.4f}")
    report.require("their ratio", ratio <= MAX_EDGE_RATIO, f"{ratio:.2f}")
    aspect = max(aspects)
    report.require("largest aspect of a face", aspect <= MAX_ASPECT, f"{aspect:.2f}")


def pierces(p, q, triangle):
    """Whether the segment pq meets a triangle."""
    a, b, c = triangle
    d, e, f = sub(q, p), sub(b, a), sub(c, a)
    n = cross(d, f)
    det = dot(e, n)
    if abs(det) <= 1e-9 * length(e) * length(n):  # parallel to the plane of the triangle
        return False
    s = sub(p, a)
    m = cross(s, e)
    u, v, t = dot(s, n) / det, dot(d, m) / det, dot(f, m) / det
    return u >= 0.0 and v >= 0.0 and u + v <= 1.0 and 0.0 <= t <= 1.0


def check_intersections(report, points, faces, size=0.15):
    """No edge of the mesh, cut into triangles from the face centres, meets another."""
    points = points + [mean([points[v] for v in face]) for face in faces]
    first_centre = len(points) - len(faces)
    triangles = [
        (a, b, first_centre + f) for f, face in enumerate(faces) for a, b in sides(face)
    ]

    def boxes(vertices):
        spans = zip(*(points[v] for v in vertices))
        ends = ((math.floor(min(c) / size), math.floor(max(c) / size)) for c in spans)
        x, y, z = (range(first, last + 1) for first, last in ends)
        return [(i, j, k) for i in x for j in y for k in z]

    triangles_in = defaultdict(list)
    for t, triangle in enumerate(triangles):
        for box in boxes(triangle):
            triangles_in[box].append(t)
    n_hits = 0
    for p, q in sorted({tuple(sorted(e)) for t in triangles for e in sides(t)}):
        near = {t for box in boxes((p, q)) for t in triangles_in[box]}
        for triangle in (triangles[t] for t in near):
            if p not in triangle and q not in triangle:
                n_hits += pierces(points[p], points[q], [points[v] for v in triangle])
    report.require("no self-intersection", n_hits == 0, f"{n_hits} hits,")


# --- output -----------------------------------------------------------------------------

HEAD = """\
# Copyright 2026 The osdx authors.
# SPDX-License-Identifier: Apache-2.0
# A hollow valve body with a handle, of mixed polygons; made by assets/make_demo_mesh.py.
"""


def compacted(mesh):
    """Points in use and faces renumbered to them."""
    used = sorted({v for face in filter(None, mesh.faces) for v in face})
    new = {v: i for i, v in enumerate(used)}
    faces = [[new[v] for v in face] for face in filter(None, mesh.faces)]
    return mesh.at(used), faces


def write_obj(path, points, faces):
    lines = ["v " + " ".join(f"{round(c, 9) + 0.0:.9f}" for c in p) for p in points]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text(HEAD + "\n".join(lines) + "\n", encoding="ascii", newline="\n")


def read_obj(path):
    """The points and faces of a file of write_obj, so that the checks see the file."""
    points, faces = [], []
    for kind, *fields in (line.split() for line in path.read_text("ascii").splitlines()):
        if kind == "v":
            points.append(tuple(float(field) for field in fields))
        elif kind == "f":
            faces.append([int(field) - 1 for field in fields])
    return points, faces


def main():
    default = pathlib.Path(__file__).with_name("valve_body.obj")
    path = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default
    write_obj(path, *compacted(build()))

    points, faces = read_obj(path)
    report = Report()
    check_topology(report, points, faces)
    if report.n_failed == 0:
        check_shape(report, points, faces)
        check_intersections(report, points, faces)
    return 1 if report.n_failed else 0


if __name__ == "__main__":
    sys.exit(main())
