"""How two triangles meet, in fractions: an independent reference, slow and plain."""

from fractions import Fraction
from itertools import combinations


def point(p):
    return [Fraction(float(x)) for x in p]


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def heights(triangle, over):
    normal = cross(minus(over[1], over[0]), minus(over[2], over[0]))
    return [dot(normal, minus(p, over[0])) for p in triangle]


def off_plane(a, b):
    """The largest distance of a corner of a from the plane of b."""
    one, other = [point(p) for p in a], [point(p) for p in b]
    normal = cross(minus(other[1], other[0]), minus(other[2], other[0]))
    return float(max(abs(h) for h in heights(one, other))) / float(dot(normal, normal)) ** 0.5


def _cut(triangle, other):
    """Where a triangle's border meets the other's plane, and its corners' heights over it."""
    height = heights(triangle, other)
    points = [triangle[k] for k in range(3) if height[k] == 0]
    for k in range(3):
        a, b = height[k], height[(k + 1) % 3]
        if a * b < 0:
            t = a / (a - b)
            points.append([x + t * (y - x) for x, y in zip(triangle[k], triangle[(k + 1) % 3], strict=True)])
    return points, height


def reference(a, b):
    """(crosses, touches) by intersecting both triangles with the line of their planes; None if coplanar."""
    one, other = [point(p) for p in a], [point(p) for p in b]
    points_a, height_a = _cut(one, other)
    points_b, height_b = _cut(other, one)
    if all(h == 0 for h in height_a):
        return None
    if not points_a or not points_b:
        return False, False
    normals = [cross(minus(t[1], t[0]), minus(t[2], t[0])) for t in (one, other)]
    line = cross(*normals)
    on_a, on_b = [dot(line, p) for p in points_a], [dot(line, p) for p in points_b]
    low, high = max(min(on_a), min(on_b)), min(max(on_a), max(on_b))
    through = all(min(h) < 0 < max(h) for h in (height_a, height_b))
    return low < high and through, low <= high


def common_part(a, b):
    """The corners of what two coplanar triangles, or a segment and a triangle b in its plane, have in common."""
    normal = cross(minus(b[1], b[0]), minus(b[2], b[0]))
    left = list(a)
    for k in range(3):
        inward = cross(normal, minus(b[(k + 1) % 3], b[k]))
        height = [dot(inward, minus(p, b[k])) for p in left]
        cut = []
        for m, p in enumerate(left):
            if height[m - 1] * height[m] < 0:
                t = height[m - 1] / (height[m - 1] - height[m])
                cut.append([x + t * (y - x) for x, y in zip(left[m - 1], p, strict=True)])
            if height[m] >= 0:
                cut.append(p)
        left = cut
    return left


def has_area(points):
    return any(any(cross(minus(q, points[0]), minus(r, points[0]))) for q, r in combinations(points[1:], 2))


def counts(vertices, faces):
    """Crossings (pairs of faces, and edges in a face whose faces leave to both sides), coplanar overlaps without and
    with those of pairs that share an edge, and pairs of faces that have a point in common."""
    corners = [[point(vertices[i]) for i in face] for face in faces]
    crossing = overlap = folded = 0
    touching = set()
    for i, j in combinations(range(len(faces)), 2):
        shared = len(set(faces[i]) & set(faces[j]))
        answer = reference(vertices[faces[i]], vertices[faces[j]])
        part = []
        if answer is None:
            part = common_part(corners[i], corners[j])
        if shared or part or (answer and answer[1]):
            touching.add((i, j))
        covers = shared < 3 and len(part) > 2 and has_area(part)
        crossing += shared < 2 and bool(answer and answer[0])
        overlap += shared < 2 and covers
        folded += shared == 2 and covers
    for i in range(len(faces)):
        sides = {}
        for j in range(len(faces)):
            if i == j or len(set(faces[i]) & set(faces[j])) > 1:
                continue
            height = heights(corners[j], corners[i])
            if sum(h == 0 for h in height) == 2:
                free = next(k for k in range(3) if height[k] != 0)
                ends = [(free + 1) % 3, (free + 2) % 3]
                if _through(corners[j][ends[0]], corners[j][ends[1]], corners[i]):
                    edge = tuple(sorted(int(faces[j][k]) for k in ends))
                    sides.setdefault(edge, set()).add(height[free] > 0)
        crossing += sum(len(both) == 2 for both in sides.values())
    return crossing, (overlap, overlap + folded), touching


def _through(u, v, b):
    """Whether the segment passes through the inside of triangle b, in whose plane it lies."""
    part = common_part([u, v], b)
    if len(part) < 2 or all(p == part[0] for p in part):
        return False
    far = max(part, key=lambda p: dot(minus(p, part[0]), minus(p, part[0])))
    middle = [(x + y) / 2 for x, y in zip(part[0], far, strict=True)]
    normal = cross(minus(b[1], b[0]), minus(b[2], b[0]))
    return all(dot(cross(normal, minus(b[(k + 1) % 3], b[k])), minus(middle, b[k])) > 0 for k in range(3))
