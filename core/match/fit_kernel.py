"""The pattern tracker's kernel: where a template lies in a frame, and how sure that is.

The frame's raw pixels are explained by the warped template: I(x) = a_c B_c(u(x)) + b_c,
u = G (x - p) / (1 + h.(x - p)), p the position sought. Gauss-Newton on position, warp and, per channel, gain a and
bias b; the latter are eliminated (Schur complement), so the covariance of p has them marginalised. A number more says
how much blurrier or sharper the frame is (the Laplacian of B, half a change of the blur's variance): without it one
edge would be scaled until it is as sharp as in the frame, and its place with it. Only the smooth
template is ever interpolated: the pixels that are compared stay as they are and their noise stays white. The set of
pixels is frozen after it was chosen, else the iteration may run in a circle. Lucas & Kanade 1981; Baker & Matthews
2004; covariance as in Förstner 1987.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

MOST_ITERATIONS = 20
STEP = 2.0  # pixels of the position in one iteration
DONE = 0.004  # pixels
MOST_PIXELS = 4096
FEWEST = 40  # pixels
REACH = 3.0  # of the noise: where Geman & McClure's weights begin to fall
SHARPNESS = 0.5  # pixels^2 of the template, standard deviation: half of how much the variance of its blur may differ
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
F32_4D = types.Array(types.float32, 4, "C", readonly=True)
BOOL_2D = types.Array(types.boolean, 2, "C", readonly=True)
BOOL_3D = types.Array(types.boolean, 3, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C", readonly=True)
f64, i64 = types.float64, types.int64
FAST = {"reassoc", "contract", "arcp", "nsz"}  # sums in any order, but what is not a number stays so
# covariance xx, xy, yy for residuals of variance 1; variance of the residuals; correlation; iterations; pixels;
# share of the weight that is left; 1 when it converged; lag correlation of the residuals; mean gain; last step;
# how much of what the pattern seems to tell of its place where it tells least is not from noise in the template
FOUND = ("xx", "xy", "yy", "variance", "score", "iterations", "pixels", "share", "done", "lag", "gain", "step", "known")


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _solve(n, size, rhs, out):  # type: ignore[no-untyped-def]
    """Cholesky in place of the lower triangle; False when the matrix is not positive definite."""
    for i in range(size):
        for j in range(i + 1):
            total = n[i, j]
            for k in range(j):
                total -= n[i, k] * n[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                n[i, i] = math.sqrt(total)
            else:
                n[i, j] = total / n[j, j]
    _back(n, size, rhs, out)
    return True


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _back(n, size, rhs, out):  # type: ignore[no-untyped-def]
    for i in range(size):
        total = rhs[i]
        for k in range(i):
            total -= n[i, k] * out[k]
        out[i] = total / n[i, i]
    for i in range(size - 1, -1, -1):
        total = out[i]
        for k in range(i + 1, size):
            total -= n[k, i] * out[k]
        out[i] = total / n[i, i]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _gather(shape, hold, keep, cx, cy, mu, mv, warp, half, xs, ys):  # type: ignore[no-untyped-def]
    """The pixels under the warped pattern: count, and how many there would be without masks and borders there."""
    det = warp[2] * warp[5] - warp[3] * warp[4]
    if not abs(det) > 1e-6:
        return 0, 0
    ax = half * (abs(warp[5]) + abs(warp[3])) / abs(det)
    ay = half * (abs(warp[4]) + abs(warp[2])) / abs(det)
    if not (ax < 4096.0 and ay < 4096.0):
        return 0, 0
    stride = 1
    while 4.0 * ax * ay / (stride * stride) > MOST_PIXELS:
        stride += 1
    mx = warp[0] + (warp[5] * mu - warp[3] * mv) / det
    my = warp[1] + (warp[2] * mv - warp[4] * mu) / det
    if not (abs(mx) < 1e6 and abs(my) < 1e6):
        return 0, 0
    x0, x1 = math.ceil(mx - 1.2 * ax), math.floor(mx + 1.2 * ax)
    y0, y1 = math.ceil(my - 1.2 * ay), math.floor(my + 1.2 * ay)
    size = keep.shape[0]
    count = wanted = 0
    for y in range(y0, y1 + 1, stride):
        for x in range(x0, x1 + 1, stride):
            dx, dy = x - warp[0], y - warp[1]
            w = 1.0 + warp[6] * dx + warp[7] * dy
            if w < 0.2:
                continue
            u = (warp[2] * dx + warp[3] * dy) / w
            v = (warp[4] * dx + warp[5] * dy) / w
            if abs(u - mu) > half or abs(v - mv) > half:
                continue
            i, j = int(cx + u + 0.5), int(cy + v + 0.5)
            if not (0 <= i < size and 0 <= j < size and keep[j, i]):
                continue
            wanted += 1
            if x < 0 or y < 0 or x >= shape[1] or y >= shape[0] or count >= MOST_PIXELS:
                continue
            if hold.shape[0] and hold[y, x]:
                continue
            xs[count], ys[count] = x, y
            count += 1
    return count, wanted


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _jacobian(warp, dx, dy, size, jac):  # type: ignore[no-untyped-def]
    """How a point of the template moves with the numbers of the warp; returns the point."""
    w = 1.0 / (1.0 + warp[6] * dx + warp[7] * dy)
    u, v = (warp[2] * dx + warp[3] * dy) * w, (warp[4] * dx + warp[5] * dy) * w
    jac[0, 0], jac[1, 0] = -(warp[2] - u * warp[6]) * w, -(warp[4] - v * warp[6]) * w
    jac[0, 1], jac[1, 1] = -(warp[3] - u * warp[7]) * w, -(warp[5] - v * warp[7]) * w
    if size == 4:
        jac[0, 2], jac[1, 2], jac[0, 3], jac[1, 3] = u, v, -v, u
    elif size >= 6:
        jac[0, 2], jac[1, 2], jac[0, 3], jac[1, 3] = u, 0.0, v, 0.0
        jac[0, 4], jac[1, 4], jac[0, 5], jac[1, 5] = 0.0, u, 0.0, v
        jac[0, 6], jac[1, 6], jac[0, 7], jac[1, 7] = -u * dx * w, -v * dx * w, -u * dy * w, -v * dy * w
    return u, v


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _place(normal, size, rhs, step, out):  # type: ignore[no-untyped-def]
    """The covariance of the position by the factor of the normal matrix, into `out` (3,)."""
    for k in range(2):
        rhs[:] = 0.0
        rhs[k] = 1.0
        _back(normal, size, rhs, step)
        if k == 0:
            out[0], out[1] = step[0], step[1]
        else:
            out[2] = step[1]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _greatest(xx, xy, yy):  # type: ignore[no-untyped-def]
    """The greater eigenvalue of a symmetric 2 x 2 matrix."""
    return 0.5 * (xx + yy) + math.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _fit(image, hold, coefs, keep, cx, cy, mu, mv, warp, light, half, size, scale, noise, out):  # type: ignore[no-untyped-def]
    """One pattern in one frame. warp: position, G by rows, h (8); light: gain and bias per channel (C, 2)."""
    channels, side = coefs.shape[2], coefs.shape[0]
    xs, ys = np.empty(MOST_PIXELS, np.int32), np.empty(MOST_PIXELS, np.int32)
    count, wanted = _gather(image.shape, hold, keep, cx, cy, mu, mv, warp, half, xs, ys)
    out[:] = 0.0
    out[6] = count
    if count < FEWEST or count < 0.4 * wanted:
        return
    normal, rhs, step = np.empty((9, 9)), np.empty(9), np.empty(9)
    cross, pair, right = np.empty((channels, 9, 2)), np.empty((channels, 3)), np.empty((channels, 2))
    jac, value, gx, gy = np.empty((2, 8)), np.empty(channels), np.empty(channels), np.empty(channels)
    whole = np.empty((9, 9))
    bend, ddx, ddy = np.empty(channels), np.empty(4), np.empty(4)
    last, sharp = size, 0.0
    size += 1  # the last is how much blurrier or sharper the frame is than the key
    wx, wy, dxw, dyw = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    rest, e = np.empty(channels), np.empty(9)
    for iteration in range(MOST_ITERATIONS):
        normal[:] = 0.0
        rhs[:] = 0.0
        cross[:] = 0.0
        pair[:] = 0.0
        right[:] = 0.0
        total = weights = squares = lag = 0.0
        before = 0.0
        for n in range(count):
            dx, dy = xs[n] - warp[0], ys[n] - warp[1]
            u, v = _jacobian(warp, dx, dy, last, jac)
            px = min(max(cx + u, 1.0), side - 2.001)
            py = min(max(cy + v, 1.0), side - 2.001)
            i, j = int(px), int(py)
            s, t = px - i, py - j
            r = 1.0 - s
            wx[0], wx[3] = r * r * r / 6.0, s * s * s / 6.0
            wx[1] = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0
            wx[2] = 1.0 - wx[0] - wx[1] - wx[3]
            dxw[0], dxw[3] = -0.5 * r * r, 0.5 * s * s
            dxw[1] = s * (1.5 * s - 2.0)
            dxw[2] = -dxw[0] - dxw[1] - dxw[3]
            ddx[0], ddx[1], ddx[2], ddx[3] = r, 1.0 - 3.0 * r, 1.0 - 3.0 * s, s
            r = 1.0 - t
            wy[0], wy[3] = r * r * r / 6.0, t * t * t / 6.0
            wy[1] = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
            wy[2] = 1.0 - wy[0] - wy[1] - wy[3]
            dyw[0], dyw[3] = -0.5 * r * r, 0.5 * t * t
            dyw[1] = t * (1.5 * t - 2.0)
            dyw[2] = -dyw[0] - dyw[1] - dyw[3]
            ddy[0], ddy[1], ddy[2], ddy[3] = r, 1.0 - 3.0 * r, 1.0 - 3.0 * t, t
            error = 0.0
            for c in range(channels):
                b = bx = by = bb = 0.0
                for q in range(4):
                    a0, a1 = coefs[j + q - 1, i - 1, c], coefs[j + q - 1, i, c]
                    a2, a3 = coefs[j + q - 1, i + 1, c], coefs[j + q - 1, i + 2, c]
                    row = wx[0] * a0 + wx[1] * a1 + wx[2] * a2 + wx[3] * a3
                    b += wy[q] * row
                    by += dyw[q] * row
                    bx += wy[q] * (dxw[0] * a0 + dxw[1] * a1 + dxw[2] * a2 + dxw[3] * a3)
                    bb += ddy[q] * row + wy[q] * (ddx[0] * a0 + ddx[1] * a1 + ddx[2] * a2 + ddx[3] * a3)
                b += sharp * bb
                value[c], gx[c], gy[c], bend[c] = b, bx, by, bb
                rest[c] = image[ys[n], xs[n], c] - light[c, 0] * b - light[c, 1]
                error += rest[c] * rest[c]
            weight = 1.0
            if scale > 0.0:
                weight = 1.0 / (1.0 + error / (channels * REACH * REACH * scale))
                weight *= weight
            total += weight * error
            squares += weight * weight * error
            weights += weight
            if n and xs[n] == xs[n - 1] + 1:
                lag += weight * rest[0] * before
            before = rest[0]
            m00 = m01 = m11 = f0 = f1 = 0.0
            for c in range(channels):
                a, b = light[c, 0], value[c]
                p, q = a * gx[c], a * gy[c]
                m00 += p * p
                m01 += p * q
                m11 += q * q
                f0 += p * rest[c]
                f1 += q * rest[c]
                pair[c, 0] += weight * b * b
                pair[c, 1] += weight * b
                pair[c, 2] += weight
                right[c, 0] += weight * b * rest[c]
                right[c, 1] += weight * rest[c]
                curve = a * bend[c]
                for k in range(last):
                    g = weight * (p * jac[0, k] + q * jac[1, k])
                    cross[c, k, 0] += g * b
                    cross[c, k, 1] += g
                    normal[last, k] += g * curve
                cross[c, last, 0] += weight * curve * b
                cross[c, last, 1] += weight * curve
                normal[last, last] += weight * curve * curve
                rhs[last] += weight * curve * rest[c]
            for k in range(last):
                h0 = weight * (m00 * jac[0, k] + m01 * jac[1, k])
                h1 = weight * (m01 * jac[0, k] + m11 * jac[1, k])
                rhs[k] += weight * (f0 * jac[0, k] + f1 * jac[1, k])
                for m in range(k + 1):
                    normal[k, m] += h0 * jac[0, m] + h1 * jac[1, m]
        spread = 0.0
        for c in range(channels):
            mean = pair[c, 1] / pair[c, 2]
            spread += light[c, 0] * light[c, 0] * (pair[c, 0] - mean * pair[c, 1])
            det = pair[c, 0] * pair[c, 2] - pair[c, 1] * pair[c, 1]
            if not det > 1e-9 * pair[c, 2] * pair[c, 2]:
                det = 1e300  # a flat channel says nothing about its gain
            for k in range(size):
                p, q = cross[c, k, 0], cross[c, k, 1]
                ia = (pair[c, 2] * p - pair[c, 1] * q) / det
                ib = (pair[c, 0] * q - pair[c, 1] * p) / det
                rhs[k] -= ia * right[c, 0] + ib * right[c, 1]
                for m in range(k + 1):
                    normal[k, m] -= ia * cross[c, m, 0] + ib * cross[c, m, 1]
        prior = noise[0] / (SHARPNESS * SHARPNESS)
        normal[last, last] += prior
        rhs[last] -= prior * sharp
        for k in range(size):
            normal[k, k] *= 1.0 + 1e-9
        whole[:] = normal
        if not _solve(normal, size, rhs, step):
            return
        free = max(weights * channels - size - 2 * channels, 1.0)
        out[3] = total / free
        out[4] = math.sqrt(max(spread / (spread + total + 1e-30), 0.0))
        out[5] = iteration + 1
        out[7] = weights / wanted
        out[9] = lag * channels / max(total, 1e-30)
        if scale > 0.0:
            scale = max(scale, 1e-12)
        far = math.sqrt(step[0] * step[0] + step[1] * step[1])
        shrink = min(1.0, STEP / max(far, 1e-12))
        mean = 0.0
        for c in range(channels):
            p, q = right[c, 0], right[c, 1]
            for k in range(size):
                p -= shrink * step[k] * cross[c, k, 0]
                q -= shrink * step[k] * cross[c, k, 1]
            det = pair[c, 0] * pair[c, 2] - pair[c, 1] * pair[c, 1]
            if det > 1e-9 * pair[c, 2] * pair[c, 2]:
                light[c, 0] += (pair[c, 2] * p - pair[c, 1] * q) / det
                light[c, 1] += (pair[c, 0] * q - pair[c, 1] * p) / det
            else:
                light[c, 1] += q / pair[c, 2]
            mean += light[c, 0] / channels
        out[10] = mean
        for k in range(size):
            e[k] = shrink * step[k]
        warp[0] += e[0]
        warp[1] += e[1]
        g0, g1, g2, g3 = warp[2], warp[3], warp[4], warp[5]
        sharp += e[last]
        if last == 4:
            warp[2], warp[3] = g0 + e[2] * g0 - e[3] * g2, g1 + e[2] * g1 - e[3] * g3
            warp[4], warp[5] = g2 + e[2] * g2 + e[3] * g0, g3 + e[2] * g3 + e[3] * g1
        elif last >= 6:
            warp[2], warp[3] = g0 + e[2] * g0 + e[3] * g2, g1 + e[2] * g1 + e[3] * g3
            warp[4], warp[5] = g2 + e[4] * g0 + e[5] * g2, g3 + e[4] * g1 + e[5] * g3
        if last == 8:
            warp[6] += e[6]
            warp[7] += e[7]
        out[11] = shrink * far
        if shrink * far < DONE and iteration:
            out[8] = 1.0
            break
    _place(normal, size, rhs, step, out)
    most = _greatest(out[0], out[1], out[2])
    # the slopes of noise in the template are as good as those of texture to the sums above, but tell nothing: along a
    # straight edge there are no others
    gains = 0.0
    for c in range(channels):
        gains += light[c, 0] * light[c, 0]
    # what looks like noise in the key may be fine texture; then the frame repeats it, and differs by less
    gains = noise[2] * min(gains * noise[1], channels * out[3])
    for n in range(count):
        _jacobian(warp, xs[n] - warp[0], ys[n] - warp[1], last, jac)
        for k in range(last):
            for m in range(k + 1):
                whole[k, m] -= gains * (jac[0, k] * jac[0, m] + jac[1, k] * jac[1, m])
    if _solve(whole, size, rhs, step):
        _place(whole, size, rhs, step, out)
        out[12] = most / _greatest(out[0], out[1], out[2])
    else:
        out[0], out[1], out[2] = 1e9 * most, 0.0, 1e9 * most


@njit(
    types.void(
        F32_3D, BOOL_2D, F32_4D, BOOL_3D, f64[:, ::1], f64[:, ::1], f64[:, ::1], f64[:, :, ::1], f64[::1], f64[:, ::1],
        f64, I64_1D, I64_1D, i64, i64, f64[:, ::1],
    ),
    cache=True, nogil=True, error_model="numpy", fastmath=FAST,
)  # fmt: skip
def fit_patterns(  # type: ignore[no-untyped-def]
    image, hold, coefs, keep, centre, middle, warp, light, scale, noise, half, sizes, rows, start, stop, found
):
    """Fit the patterns `rows`[start:stop] to a frame, from the warps they have.

    Parameters
    ----------
    image : (H, W, C) float32. hold : (H, W), True where tracks must not look, or (0, 0).
    coefs, keep, centre : templates of all patterns, see ``core.match.template.Templates``.
    middle : (N, 2) float64, from the point to the middle of its pattern, in template pixels.
    warp : (N, 8) float64, changed: x, y of the point; G by rows; h.
    light : (N, C, 2) float64, changed: gain and bias.
    scale : (N,) variance of the noise where weights are to be robust; 0 for least squares.
    noise : (N, 3) variance of the noise at the key; the same beside edges, zero where the frame is that of the key;
        what noise of variance 1 adds to the square of a template's slope along an axis.
    half : half the side of the pattern in template pixels.
    sizes : (N,) of each pattern: 2 translation, 4 similarity, 6 affine, 8 homography.
    found : (N, 13) float64, changed: see FOUND.
    """
    for k in range(start, stop):
        n = rows[k]
        _fit(
            image,
            hold,
            coefs[n],
            keep[n],
            centre[n, 0],
            centre[n, 1],
            middle[n, 0],
            middle[n, 1],
            warp[n],
            light[n],
            half,
            sizes[n],
            scale[n],
            noise[n],
            found[n],
        )
