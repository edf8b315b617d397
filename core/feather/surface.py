"""The one map from a feather's attributes to points: every level of detail, barb and hair goes through it.

A vane is swept by its barbs. A barb of one side ends on the outline at `edge` (0 calamus .. 1 tip), begins on the shaft
at `root_of_edge`, and runs between in the flat vane; cup, angle, camber, curl and ruffles then raise the flat vane, and
the bends, sweeps and twist of the shaft carry it. Feather frame: x right, y along the shaft, z away from the skin;
lengths here are in shaft lengths. All functions are kernels over one row of the table of attributes (float32).
"""

from __future__ import annotations

import math

from numba import njit, types

from core.feather.attributes import column

BEND_BASE, BEND_MIDDLE, BEND_TIP = column("shaftBendBase"), column("shaftBendMiddle"), column("shaftBendTip")
SWEEP_BASE, SWEEP_MIDDLE, SWEEP_TIP = column("shaftSweepBase"), column("shaftSweepMiddle"), column("shaftSweepTip")
TWIST, TWIST_POWER = column("shaftTwist"), column("shaftTwistPower")
WAVE, WAVE_COUNT, WAVE_PHASE = column("shaftWave"), column("shaftWaveCount"), column("shaftWavePhase")
KINK, KINK_SIDE, KINK_POSITION = column("shaftKink"), column("shaftKinkSide"), column("shaftKinkPosition")
ASYMMETRY, TAPER, WIDTH = column("vaneAsymmetry"), column("vaneTaper"), column("vaneWidth*")
START, END, WIDEST = column("vaneStart*"), column("vaneEnd*"), column("vaneWidest*")
BASE_FULLNESS, TIP_FULLNESS = column("vaneBaseFullness*"), column("vaneTipFullness*")
NOTCH_POSITION, NOTCH_DEPTH = column("vaneNotchPosition*"), column("vaneNotchDepth*")
NOTCH_LENGTH = column("vaneNotchLength*")
EDGE_WAVE, EDGE_WAVE_COUNT = column("vaneEdgeWave*"), column("vaneEdgeWaveCount*")
EDGE_WAVE_PHASE = column("vaneEdgeWavePhase*")
CAMBER, CUP, CUP_TIP = column("vaneCamber*"), column("vaneCup*"), column("vaneCupTip*")
ANGLE, ANGLE_TIP = column("vaneAngle*"), column("vaneAngleTip*")
CURL, CURL_START = column("vaneCurl*"), column("vaneCurlStart*")
RUFFLE, RUFFLE_COUNT, RUFFLE_PHASE = column("vaneRuffle*"), column("vaneRuffleCount*"), column("vaneRufflePhase*")
BARB_BASE, BARB_MIDDLE, BARB_TIP = column("barbAngleBase*"), column("barbAngleMiddle*"), column("barbAngleTip*")
BARB_CURVE = column("barbCurve*")
LENGTH = column("shaftLength")
ROW = types.Array(types.float32, 1, "C", readonly=True)  # all attributes of a feather, as kernels take them

NODES = 17  # of the table of a shaft
REACH = 1.25  # where the table ends, in shaft lengths: vanes may reach beyond the shaft
KINK_SPAN = 0.02  # of the shaft, over which a kink turns


@njit(cache=True, inline="always")
def smoothstep(x):  # type: ignore[no-untyped-def]
    """0 below 0, 1 above 1, smooth between (kernel form)."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


@njit(cache=True)
def shaft_table(a, table):  # type: ignore[no-untyped-def]
    """Fill (NODES, 12) with position, right, along and out of the shaft at even places 0 .. REACH."""
    step = REACH / (NODES - 1)
    x = y = z = 0.0
    before_x = before_y = before_z = 0.0
    for node in range(NODES):
        for half in range(2):  # the middle of the step that leads here, then the node itself
            place = node * step - (0.5 * step if half == 0 else 0.0)
            if place < 0.0:
                continue
            t = min(place, 1.0)
            base, tip = 1.0 - (1.0 - t) ** 3, t**3
            middle = 3.0 * t * t - 2.0 * tip
            kink = smoothstep((place - a[KINK_POSITION]) / KINK_SPAN + 0.5)
            pitch = a[BEND_BASE] * base + a[BEND_MIDDLE] * middle + a[BEND_TIP] * tip + a[KINK] * kink
            yaw = a[SWEEP_BASE] * base + a[SWEEP_MIDDLE] * middle + a[SWEEP_TIP] * tip + a[KINK_SIDE] * kink
            if a[WAVE] > 0.0:
                turns = 2.0 * math.pi * a[WAVE_COUNT]
                pitch -= math.atan(a[WAVE] * turns * t * math.cos(turns * t + 2.0 * math.pi * a[WAVE_PHASE]))
            cos_p, sin_p, cos_y, sin_y = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
            tx, ty, tz = sin_y * cos_p, cos_y * cos_p, -sin_p
            if half == 0:
                x, y, z = before_x + step * tx, before_y + step * ty, before_z + step * tz
        before_x, before_y, before_z = x, y, z
        zx, zy, zz = sin_y * sin_p, cos_y * sin_p, cos_p  # right x along
        roll = a[TWIST] * t ** a[TWIST_POWER] if a[TWIST] != 0.0 else 0.0
        cos_r, sin_r = math.cos(roll), math.sin(roll)
        row = table[node]
        row[0], row[1], row[2] = x, y, z
        row[3], row[4], row[5] = cos_r * cos_y + sin_r * zx, -cos_r * sin_y + sin_r * zy, sin_r * zz
        row[6], row[7], row[8] = tx, ty, tz
        row[9], row[10], row[11] = -sin_r * cos_y + cos_r * zx, sin_r * sin_y + cos_r * zy, cos_r * zz


@njit(cache=True, inline="always")
def on_shaft(table, place, x, z):  # type: ignore[no-untyped-def]
    """The point at `place` along the shaft, `x` to its right and `z` out of it; before 0 and beyond REACH straight."""
    step = REACH / (NODES - 1)
    at = min(max(int(place / step), 0), NODES - 2)
    f = place / step - at
    a, b = table[at], table[at + 1]
    g = min(max(f, 0.0), 1.0)
    h01 = g * g * (3.0 - 2.0 * g)
    h10, h11 = g * (1.0 - g) * (1.0 - g) * step, g * g * (g - 1.0) * step
    over = (f - g) * step
    out0 = (1.0 - h01) * a[0] + h01 * b[0] + h10 * a[6] + h11 * b[6]
    out1 = (1.0 - h01) * a[1] + h01 * b[1] + h10 * a[7] + h11 * b[7]
    out2 = (1.0 - h01) * a[2] + h01 * b[2] + h10 * a[8] + h11 * b[8]
    n = 1.0 - g
    out0 += x * (n * a[3] + g * b[3]) + over * (n * a[6] + g * b[6]) + z * (n * a[9] + g * b[9])
    out1 += x * (n * a[4] + g * b[4]) + over * (n * a[7] + g * b[7]) + z * (n * a[10] + g * b[10])
    out2 += x * (n * a[5] + g * b[5]) + over * (n * a[8] + g * b[8]) + z * (n * a[11] + g * b[11])
    return out0, out1, out2


@njit(cache=True, inline="always")
def share_of_edge(a, side, edge):  # type: ignore[no-untyped-def]
    """Where between begin and end of the vane an edge lies, 0 .. 1."""
    return min(max((edge - a[START + side]) / max(a[END + side] - a[START + side], 1e-3), 0.0), 1.0)


@njit(cache=True, inline="always")
def edge_of_share(a, side, share):  # type: ignore[no-untyped-def]
    """The edge at a share 0 .. 1 of the vane; a vane that would end before it begins has no length to speak of."""
    return a[START + side] + max(a[END + side] - a[START + side], 1e-3) * share


@njit(cache=True)
def vane_width(a, side, edge):  # type: ignore[no-untyped-def]
    """Width of the flat vane at an edge, in shaft lengths."""
    u = share_of_edge(a, side, edge)
    widest = a[WIDEST + side]
    if u < widest:
        power, off = a[BASE_FULLNESS + side], 1.0 - u / widest
    else:
        power, off = a[TIP_FULLNESS + side], (u - widest) / (1.0 - widest)
    width = math.sqrt(max(1.0 - off * off, 0.0)) if power == 2.0 else max(1.0 - off**power, 0.0) ** (1.0 / power)
    width *= a[WIDTH + side] * (1.0 + (2.0 * side - 1.0) * a[ASYMMETRY]) * (1.0 - a[TAPER] * u)
    if a[NOTCH_DEPTH + side] > 0.0:
        width *= 1.0 - a[NOTCH_DEPTH + side] * smoothstep((u - a[NOTCH_POSITION + side]) / a[NOTCH_LENGTH + side])
    if a[EDGE_WAVE + side] > 0.0:
        turns = a[EDGE_WAVE_COUNT + side] * u + a[EDGE_WAVE_PHASE + side]
        width *= 1.0 - a[EDGE_WAVE + side] * (0.5 - 0.5 * math.cos(2.0 * math.pi * turns))
    return width


@njit(cache=True)
def root_of_edge(a, side, edge, width, tip_inset):  # type: ignore[no-untyped-def]
    """Where on the shaft the barb stands that ends at `edge` of a vane of `width`, in shaft lengths.

    Rises with the edge for every outline that is convex: barbs do not cross at the base, where they would.
    """
    u = share_of_edge(a, side, edge)
    v = 1.0 - u
    angle = v * v * a[BARB_BASE + side] + 2.0 * u * v * a[BARB_MIDDLE + side] + u * u * a[BARB_TIP + side]
    start = a[START + side]
    forward = min(width / math.tan(angle), 0.85 * max(edge - start, 0.0))
    end = edge_of_share(a, side, 1.0)
    highest = min(end, 1.0) - tip_inset * (min(end, 1.0) - start)
    return start + (edge - forward - start) * max(highest - start, 1e-3) / max(end - start, 1e-3)


@njit(cache=True)
def flat_to_feather(a, table, side, width, x, y):  # type: ignore[no-untyped-def]
    """The point of the feather, in shaft lengths, `x` >= 0 away from the shaft and `y` along it in the flat vane."""
    u = share_of_edge(a, side, y)
    wide = max(width, 1e-6)
    s = x / wide
    z = a[CAMBER + side] * x * max(1.0 - s, 0.0) * 4.0
    if a[RUFFLE + side] != 0.0:
        turns = a[RUFFLE_COUNT + side] * u + a[RUFFLE_PHASE + side]
        z += a[RUFFLE + side] * x * s * math.sin(2.0 * math.pi * turns)
    cup = (a[CUP + side] + (a[CUP_TIP + side] - a[CUP + side]) * u) / max(a[WIDTH + side], 1e-3)  # curvature
    flat = x
    beyond = x - a[CURL_START + side] * wide
    if a[CURL + side] != 0.0 and beyond > 0.0:  # an arc that leaves the vane without a kink
        turn = a[CURL + side] / max((1.0 - a[CURL_START + side]) * wide, 1e-6)
        arc = turn * beyond
        flat = x - beyond + (math.sin(arc) / turn if abs(arc) > 1e-6 else beyond)
        z += (1.0 - math.cos(arc)) / turn if abs(arc) > 1e-6 else 0.5 * arc * beyond
    arc = cup * flat
    if abs(arc) > 1e-6:
        flat, z = math.sin(arc) / cup + z * math.sin(arc), z * math.cos(arc) - (1.0 - math.cos(arc)) / cup
    down = a[ANGLE + side] + (a[ANGLE_TIP + side] - a[ANGLE + side]) * u
    cos_d, sin_d = math.cos(down), math.sin(down)
    flat, z = flat * cos_d + z * sin_d, z * cos_d - flat * sin_d
    return on_shaft(table, y, (2.0 * side - 1.0) * flat, z)


@njit(cache=True, inline="always")
def along_barb(a, side, root, edge, s):  # type: ignore[no-untyped-def]
    """How far along the feather a barb has come at `s` 0 .. 1 of its way out."""
    return root + (edge - root) * (s + a[BARB_CURVE + side] * (s * s - s))
