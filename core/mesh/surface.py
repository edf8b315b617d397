"""Roots on a skin: placing them, where they are on a deformed skin, and strands carried along with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.mesh.mesh import Mesh, Triangles
from core.mesh.normals import edge, mesh_normals
from core.mesh.roots import Roots
from core.workers import serial_ranges

Ranges = Callable[..., None]

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
I32_2D = types.Array(types.int32, 2, "C", readonly=True)
U32_2D = types.Array(types.uint32, 2, "C", readonly=True)


def place_roots(
    mesh: Mesh,
    triangles: Triangles,
    triangle_index: NDArray[np.int32],
    barycentric: NDArray[np.float32],
    normals: NDArray[np.float32] | None = None,
) -> Roots:
    """Bind N points, given on the triangulation, to the faces of the mesh.

    Parameters
    ----------
    triangle_index : (N,) int32, rows of `triangles`, none negative.
    barycentric : (N, 3) float32, weights of the triangle's corners.
    normals : (V, 3) float32, the vertex normals of the mesh at rest, where the caller has them.

    Returns
    -------
    Roots whose rest frames have the smooth interpolated normal, and as tangent the direction of growing U on the
    skin; where there are no UVs (or they are degenerate) +X carried by the smallest rotation from +Y to the normal.
    """
    index = np.asarray(triangle_index, np.intp)
    if len(index) and index.min() < 0:
        raise ValueError("place_roots needs a triangle for every root; leave out the queries that found none")
    mesh_corners = triangles.corners[index]
    faces = triangles.faces[index]
    weights = np.array(barycentric, np.float32).reshape(-1, 3)
    vertices = np.ascontiguousarray(triangles.vertices[index])
    corner_uvs = np.zeros((len(index), 6), np.float32)
    if mesh.uvs is not None:
        corner_uvs = np.ascontiguousarray(mesh.uvs[mesh_corners].reshape(-1, 6))
    if normals is None:
        normals = mesh_normals(mesh)
    frames = np.empty((len(index), 3, 3), np.float32)
    uvs = np.empty((len(index), 2), np.float32)
    _rest_frames(mesh.points, normals, vertices, weights, corner_uvs, frames, uvs)
    local = mesh_corners - mesh.starts[faces][:, None]
    return Roots(faces=faces, corners=local.astype(np.int32), weights=weights, uvs=uvs, frames=frames)


def root_vertices(mesh: Mesh, roots: Roots) -> NDArray[np.int32]:
    """The three vertices (N, 3) int32 each root hangs on."""
    return mesh.corners[mesh.starts[roots.faces][:, None] + roots.corners]


def root_positions(mesh: Mesh, roots: Roots, points: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
    """Where the roots lie, (N, 3) float32, on the mesh at rest or at deformed `points` (V, 3) float32."""
    out = np.empty((len(roots.faces), 3), np.float32)
    places = mesh.points if points is None else np.ascontiguousarray(points, np.float32)
    _blend(places, root_vertices(mesh, roots), roots.weights, out)
    return out


def root_normals(
    mesh: Mesh,
    roots: Roots,
    points: NDArray[np.float32] | None = None,
    normals: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Smooth unit normals at the roots, (N, 3) float32, at rest (the stored ones) or at deformed `points`.

    normals : (V, 3) float32, vertex normals at `points`, where the caller has them.
    """
    return np.ascontiguousarray(root_frames(mesh, roots, points, normals)[:, 2])


def root_frames(
    mesh: Mesh,
    roots: Roots,
    points: NDArray[np.float32] | None = None,
    normals: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Frames at the roots, (N, 3, 3) float32, rows tangent, bitangent, normal.

    At rest these are the stored frames. At deformed `points` (V, 3) the normal is the deformed smooth normal and the
    tangent is the stored one pushed forward by the root's triangle, so the frame follows the skin without UVs too.
    A triangle that has collapsed turns the stored tangent by the smallest rotation between the two normals.

    normals : (V, 3) float32, vertex normals at `points`, where the caller has them.
    """
    if points is None:
        return roots.frames
    points = np.ascontiguousarray(points, np.float32)
    if normals is None:
        normals = mesh_normals(mesh, points)
    out = np.empty((len(roots.faces), 3, 3), np.float32)
    _deformed_frames(mesh.points, points, normals, root_vertices(mesh, roots), roots.weights, roots.frames, out)
    return out


def strands_on_deformed(
    mesh: Mesh,
    roots: Roots,
    strand_points: NDArray[np.float32],
    deformed_points: NDArray[np.float32],
    normals: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Strands carried rigidly by their root frames: x' = x0' + F1^T F0 (x - x0), frames as rows.

    Parameters
    ----------
    strand_points : (N, P, 3) float32, object space at rest.
    deformed_points : (V, 3) float32, the deformed vertices.

    Returns
    -------
    (N, P, 3) float32. A point equal to ``root_positions(mesh, roots)`` lands on
    ``root_positions(mesh, roots, deformed_points)`` to the bit; lengths are kept to rounding.
    """
    rest = root_positions(mesh, roots)
    moved = root_positions(mesh, roots, deformed_points)
    frames = root_frames(mesh, roots, deformed_points, normals)
    out = np.empty(strand_points.shape, np.float32)
    _carry(np.ascontiguousarray(strand_points, np.float32), rest, moved, roots.frames, frames, out)
    return out


def rest_from_posed(
    mesh: Mesh,
    roots: Roots,
    posed_strands: NDArray[np.float32],
    deformed_points: NDArray[np.float32],
    normals: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """The other way round: strands edited on the deformed skin, as they stand at rest; x = x0 + F0^T F1 (x' - x0').

    Parameters
    ----------
    posed_strands : (N, P, 3) float32, object space on the deformed skin.
    deformed_points : (V, 3) float32, the deformed vertices. normals : (V, 3) float32 there, where the caller has them.

    Returns
    -------
    (N, P, 3) float32, what :func:`strands_on_deformed` carries to `posed_strands` to rounding (about 1e-7 of the size
    of the animal). Rounding touches strands nobody edited too: keep those, and every root, as they were.
    """
    rest = root_positions(mesh, roots)
    moved = root_positions(mesh, roots, deformed_points)
    frames = root_frames(mesh, roots, deformed_points, normals)
    out = np.empty(posed_strands.shape, np.float32)
    _carry(np.ascontiguousarray(posed_strands, np.float32), moved, rest, frames, roots.frames, out)
    return out


class Carried(NamedTuple):
    """The same strands on a deformed skin and at rest, (N, P, 3) float32 each."""

    posed: NDArray[np.float32]
    rest: NDArray[np.float32]


def rest_from_posed_again(
    now: NDArray[np.float32],
    last: Carried,
    start: Carried,
    posed_frames: NDArray[np.float32],
    rest_frames: NDArray[np.float32],
    ranges: Ranges = serial_ranges,
) -> NDArray[np.float32]:
    """:func:`rest_from_posed` while strands are edited again and again: only what changed is carried.

    Parameters
    ----------
    now : (N, P, 3) float32 on the deformed skin.
    last : the newest that belong together: strands that kept their bits since keep those at rest.
    start : as they were before the first edit, their first points at the roots: strands that came back to their bits
        there have those at rest again, and all of them have their roots.
    posed_frames, rest_frames : (N, 3, 3) float32, frames at the roots.
    """
    now = np.ascontiguousarray(now, np.float32)
    out = np.empty(now.shape, np.float32)

    def bits(points: NDArray[np.float32]) -> NDArray[np.uint32]:
        return points.reshape(len(points), -1).view(np.uint32)

    rows = bits(now), bits(start.posed), bits(start.rest), bits(last.posed), bits(last.rest)
    ranges(len(now), lambda first, stop: _carry_changed(
        now, start.posed, start.rest, posed_frames, rest_frames, *rows, first, stop, out, bits(out)
    ))
    return out


@njit(types.void(F32_2D, I32_2D, F32_2D, types.float32[:, ::1]), cache=True, nogil=True)
def _blend(points, vertices, weights, out):  # type: ignore[no-untyped-def]
    for i in range(len(vertices)):
        for k in range(3):
            total = 0.0
            for j in range(3):
                total += np.float64(weights[i, j]) * points[vertices[i, j], k]
            out[i, k] = total


@njit(cache=True, inline="always")
def _minimal_turn(ax, ay, az, bx, by, bz, vx, vy, vz):  # type: ignore[no-untyped-def]
    """Turn vector v by the smallest rotation that takes unit a to unit b (a half turn when they are opposite)."""
    c = ax * bx + ay * by + az * bz
    if c < -0.999999:
        # half turn about any axis square to a
        if abs(ax) < 0.6:
            kx, ky, kz = 0.0, -az, ay
        else:
            kx, ky, kz = az, 0.0, -ax
        s = 2.0 * (kx * vx + ky * vy + kz * vz) / (kx * kx + ky * ky + kz * kz)
        return s * kx - vx, s * ky - vy, s * kz - vz
    kx, ky, kz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    s = (kx * vx + ky * vy + kz * vz) / (1.0 + c)
    return (
        c * vx + ky * vz - kz * vy + s * kx,
        c * vy + kz * vx - kx * vz + s * ky,
        c * vz + kx * vy - ky * vx + s * kz,
    )


@njit(cache=True, inline="always")
def _write_frame(out, i, tx, ty, tz, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Store tangent (made square to n), n x t and n; False, and nothing stored, when t has no part along the skin."""
    before = tx * tx + ty * ty + tz * tz
    d = tx * nx + ty * ny + tz * nz
    tx, ty, tz = tx - d * nx, ty - d * ny, tz - d * nz
    length = tx * tx + ty * ty + tz * tz
    if not length > 1e-12 * before:
        return False
    length = 1.0 / math.sqrt(length)
    tx, ty, tz = tx * length, ty * length, tz * length
    out[i, 0, 0], out[i, 0, 1], out[i, 0, 2] = tx, ty, tz
    out[i, 1, 0], out[i, 1, 1], out[i, 1, 2] = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    out[i, 2, 0], out[i, 2, 1], out[i, 2, 2] = nx, ny, nz
    return True


@njit(cache=True, inline="always")
def _normal_at(points, normals, vertices, weights, i, fx, fy, fz):  # type: ignore[no-untyped-def]
    """The smooth normal of root i; without one that of its triangle, without that the unit vector f."""
    nx = ny = nz = 0.0
    for j in range(3):
        v, w = vertices[i, j], np.float64(weights[i, j])
        nx += w * normals[v, 0]
        ny += w * normals[v, 1]
        nz += w * normals[v, 2]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length < 1e-6:
        a, b, c = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        ux, uy, uz = edge(points, a, b)
        vx, vy, vz = edge(points, a, c)
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if length == 0.0:
            return fx, fy, fz
    return nx / length, ny / length, nz / length


@njit(
    types.void(F32_2D, F32_2D, I32_2D, F32_2D, F32_2D, types.float32[:, :, ::1], types.float32[:, ::1]),
    cache=True, nogil=True,
)
def _rest_frames(points, normals, vertices, weights, corner_uvs, frames, uvs):  # type: ignore[no-untyped-def]
    for i in range(len(vertices)):
        nx, ny, nz = _normal_at(points, normals, vertices, weights, i, 0.0, 1.0, 0.0)
        for k in range(2):
            total = 0.0
            for j in range(3):
                total += np.float64(weights[i, j]) * corner_uvs[i, 2 * j + k]
            uvs[i, k] = total
        a, b, c = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        du1 = np.float64(corner_uvs[i, 2]) - corner_uvs[i, 0]
        dv1 = np.float64(corner_uvs[i, 3]) - corner_uvs[i, 1]
        du2 = np.float64(corner_uvs[i, 4]) - corner_uvs[i, 0]
        dv2 = np.float64(corner_uvs[i, 5]) - corner_uvs[i, 1]
        det = du1 * dv2 - du2 * dv1
        done = False
        if abs(det) > 1e-9 * (du1 * du1 + dv1 * dv1 + du2 * du2 + dv2 * dv2):
            s1, s2 = dv2 / det, -dv1 / det
            tx = s1 * (np.float64(points[b, 0]) - points[a, 0]) + s2 * (np.float64(points[c, 0]) - points[a, 0])
            ty = s1 * (np.float64(points[b, 1]) - points[a, 1]) + s2 * (np.float64(points[c, 1]) - points[a, 1])
            tz = s1 * (np.float64(points[b, 2]) - points[a, 2]) + s2 * (np.float64(points[c, 2]) - points[a, 2])
            done = _write_frame(frames, i, tx, ty, tz, nx, ny, nz)
        if not done:
            tx, ty, tz = _minimal_turn(0.0, 1.0, 0.0, nx, ny, nz, 1.0, 0.0, 0.0)
            _write_frame(frames, i, tx, ty, tz, nx, ny, nz)


@njit(
    types.void(F32_2D, F32_2D, F32_2D, I32_2D, F32_2D, F32_3D, types.float32[:, :, ::1]), cache=True, nogil=True
)
def _deformed_frames(rest, points, normals, vertices, weights, stored, frames):  # type: ignore[no-untyped-def]
    for i in range(len(vertices)):
        mx, my, mz = np.float64(stored[i, 2, 0]), np.float64(stored[i, 2, 1]), np.float64(stored[i, 2, 2])
        px, py, pz = np.float64(stored[i, 0, 0]), np.float64(stored[i, 0, 1]), np.float64(stored[i, 0, 2])
        nx, ny, nz = _normal_at(points, normals, vertices, weights, i, mx, my, mz)
        a, b, c = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        ux, uy, uz = edge(rest, a, b)
        vx, vy, vz = edge(rest, a, c)
        # the stored tangent, dropped along its normal onto the rest triangle, in the triangle's two edges
        cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area2 = cx * cx + cy * cy + cz * cz
        facing = mx * cx + my * cy + mz * cz
        done = False
        if area2 > 0.0 and abs(facing) > 0.05 * math.sqrt(area2):
            slide = (px * cx + py * cy + pz * cz) / facing
            qx, qy, qz = px - slide * mx, py - slide * my, pz - slide * mz
            # q = s u + r v within the plane: s = (q x v).c / c.c, r = (u x q).c / c.c
            s = ((qy * vz - qz * vy) * cx + (qz * vx - qx * vz) * cy + (qx * vy - qy * vx) * cz) / area2
            r = ((uy * qz - uz * qy) * cx + (uz * qx - ux * qz) * cy + (ux * qy - uy * qx) * cz) / area2
            tx = s * (np.float64(points[b, 0]) - points[a, 0]) + r * (np.float64(points[c, 0]) - points[a, 0])
            ty = s * (np.float64(points[b, 1]) - points[a, 1]) + r * (np.float64(points[c, 1]) - points[a, 1])
            tz = s * (np.float64(points[b, 2]) - points[a, 2]) + r * (np.float64(points[c, 2]) - points[a, 2])
            done = _write_frame(frames, i, tx, ty, tz, nx, ny, nz)
        if not done:
            tx, ty, tz = _minimal_turn(mx, my, mz, nx, ny, nz, px, py, pz)
            _write_frame(frames, i, tx, ty, tz, nx, ny, nz)


@njit(cache=True, inline="always")
def _turn_row(frames_rest, frames_moved, i, r):  # type: ignore[no-untyped-def]
    """Row r of the rotation from frame i at rest to the moved one."""
    a, b, c = 0.0, 0.0, 0.0
    for k in range(3):
        m = np.float64(frames_moved[i, k, r])
        a += m * frames_rest[i, k, 0]
        b += m * frames_rest[i, k, 1]
        c += m * frames_rest[i, k, 2]
    return a, b, c


@njit(cache=True, inline="always")
def _carry_one(strands, i, rest, moved, frames_rest, frames_moved, out):  # type: ignore[no-untyped-def]
    """Strand i from root `rest` to root `moved`, both (3,), turned from one frame to the other."""
    x0, y0, z0 = np.float64(rest[0]), np.float64(rest[1]), np.float64(rest[2])
    x1, y1, z1 = np.float64(moved[0]), np.float64(moved[1]), np.float64(moved[2])
    a0, a1, a2 = _turn_row(frames_rest, frames_moved, i, 0)
    b0, b1, b2 = _turn_row(frames_rest, frames_moved, i, 1)
    c0, c1, c2 = _turn_row(frames_rest, frames_moved, i, 2)
    for p in range(strands.shape[1]):
        x, y, z = strands[i, p, 0] - x0, strands[i, p, 1] - y0, strands[i, p, 2] - z0
        out[i, p, 0] = x1 + (a0 * x + a1 * y + a2 * z)
        out[i, p, 1] = y1 + (b0 * x + b1 * y + b2 * z)
        out[i, p, 2] = z1 + (c0 * x + c1 * y + c2 * z)


@njit(types.void(F32_3D, F32_2D, F32_2D, F32_3D, F32_3D, types.float32[:, :, ::1]), cache=True, nogil=True)
def _carry(strands, rest, moved, frames_rest, frames_moved, out):  # type: ignore[no-untyped-def]
    for i in range(len(strands)):
        _carry_one(strands, i, rest[i], moved[i], frames_rest, frames_moved, out)


@njit(cache=True, inline="always")
def _same_bits(a, b, i):  # type: ignore[no-untyped-def]
    # One OR over the row and a single branch: an early way out would cost the vector instructions.
    bits = np.uint32(0)
    for k in range(a.shape[1]):
        bits |= a[i, k] ^ b[i, k]
    return bits == 0


@njit(
    types.void(
        F32_3D, F32_3D, F32_3D, F32_3D, F32_3D, U32_2D, U32_2D, U32_2D, U32_2D, U32_2D, types.int64, types.int64,
        types.float32[:, :, ::1], types.uint32[:, ::1]
    ),
    cache=True, nogil=True,
)
def _carry_changed(  # type: ignore[no-untyped-def]
    now, shown, before, frames_shown, frames_before, now_bits, shown_bits, before_bits, last_bits, last_rest_bits,
    start, stop, out, out_bits
):
    for i in range(start, stop):
        if _same_bits(now_bits, last_bits, i):
            for k in range(out_bits.shape[1]):
                out_bits[i, k] = last_rest_bits[i, k]
        elif _same_bits(now_bits, shown_bits, i):
            for k in range(out_bits.shape[1]):
                out_bits[i, k] = before_bits[i, k]
        else:
            _carry_one(now, i, shown[i, 0], before[i, 0], frames_shown, frames_before, out)
            for k in range(3):
                out[i, 0, k] = before[i, 0, k]
