"""Settings of tools and actions as anybody might set them."""

from core.field import fields_of


def some_params(rng, kind):
    """Any settings within the soft ranges."""
    out = {}
    for name, known in fields_of(kind.Params).items():
        value = getattr(kind.Params(), name)
        if rng.random() < 0.5:
            continue
        if isinstance(value, bool):
            out[name] = bool(rng.integers(2))
        elif known.choices:
            out[name] = str(rng.choice(known.choices))
        elif isinstance(value, int):
            out[name] = int(rng.integers(max(known.soft[0], known.hard[0]), min(known.soft[1], 60)))
        elif isinstance(value, float):
            out[name] = float(rng.uniform(*known.soft))
        else:
            out[name] = "half"
    return out
