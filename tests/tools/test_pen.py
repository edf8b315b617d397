"""What a pen's samples go through."""

import numpy as np
import pytest

from core.errors import UserError
from tools.ground import Pointer
from tools.pen import SETTLING, Pen, PenSettings

RAW = PenSettings(spikes=False, smoothing=0.0)


def stroke(settings, samples):
    pen = Pen(settings)
    return [pen.filtered((sample,))[0] for sample in samples]


def test_without_settings_a_sample_passes_to_the_bit():
    samples = [Pointer(0.1 * i, 3.7 / (i + 1), 1.0 / (i + 3), 0.2, -0.1, time=0.01 * i) for i in range(20)]
    assert stroke(RAW, samples) == samples


def test_a_burst_at_the_first_touch_is_ignored():
    pressures = [0.9, 0.8, 0.05, 0.08, 0.1, 0.2, 0.5]
    samples = [Pointer(0.0, 0.0, p, time=0.008 * i) for i, p in enumerate(pressures)]
    out = [p.pressure for p in stroke(PenSettings(smoothing=0.0), samples)]
    assert max(out[2:5]) <= 0.05  # while the pen settles the lightest touch counts
    assert out[5:] == pressures[5:]  # then it presses as it presses
    assert [p.pressure for p in stroke(RAW, samples)] == pressures


def test_a_mouse_has_no_spikes_to_filter():
    samples = [Pointer(0.0, 0.0, time=0.001 * i) for i in range(5)]
    assert [p.pressure for p in stroke(PenSettings(smoothing=0.0), samples)] == [1.0] * 5
    assert SETTLING < 0.1, "a hand must not feel it"


def test_the_curve_bends_pressure_and_holds_it_in_its_range():
    soft = PenSettings(curve=((0.0, 0.0), (0.5, 0.9), (1.0, 1.0)), spikes=False, smoothing=0.0)
    out = stroke(soft, [Pointer(0, 0, p) for p in (-1.0, 0.0, 0.25, 0.5, 0.75, 1.0, 7.0)])
    np.testing.assert_allclose([p.pressure for p in out], [0.0, 0.0, 0.45, 0.9, 0.95, 1.0, 1.0])


def test_smoothing_calms_a_tremor_and_follows_the_hand():
    rng = np.random.default_rng(3)
    samples = [Pointer(4.0 * i, 100.0 + rng.normal(0.0, 3.0)) for i in range(200)]
    shake = []
    for smoothing in (0.0, 0.5, 1.0):
        out = stroke(PenSettings(smoothing=smoothing, spikes=False), samples)
        shake.append(np.abs(np.diff([p.y for p in out])).mean())
        lag = np.array([a.x - b.x for a, b in zip(samples[50:], out[50:])])
        assert (lag >= 0.0).all()
        assert lag.max() < 30.0
    assert shake[0] > 1.5 * shake[1] > 3.0 * shake[2]


def test_smoothing_does_not_depend_on_how_samples_come_together():
    samples = tuple(Pointer(3.0 * i, float(i * i % 17)) for i in range(12))
    one, many = Pen(PenSettings()), Pen(PenSettings())
    assert list(one.filtered(samples)) == [many.filtered((s,))[0] for s in samples]


@pytest.mark.parametrize("field", ["x", "y", "pressure", "time"])
def test_what_is_no_number_is_refused(field):
    with pytest.raises(UserError):
        stroke(RAW, [Pointer(0.0, 0.0)._replace(**{field: float("nan")})])


NO_CURVES = (
    ((0.0, 0.0),), ((0.0, 0.0), (0.0, 1.0)), ((1.0, 0.0), (0.0, 1.0)), ((0.0, 2.0), (1.0, 1.0)),
)  # fmt: skip


@pytest.mark.parametrize("curve", NO_CURVES)
def test_a_curve_must_be_a_curve(curve):
    with pytest.raises(ValueError, match="curve"):
        PenSettings(curve=curve)
