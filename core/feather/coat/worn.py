"""What the feathers of a coat are made of: the preset of their part, the attributes of the coat, its dials."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes import COLUMNS, limits
from core.feather.coat.coat import AttributeValue, FeatherCoat
from core.feather.dials import turned
from core.feather.presets import load_bird, preset_values
from core.value import Constant


def for_all(item: AttributeValue) -> bool:
    """True when an attribute is one number for all feathers and frames."""
    return isinstance(item.value.base, Constant) and item.value.map is None


# what a part of a wing wears where the bird does not say: as another part of it
LIKE = {
    "tertials": "secondaries", "alula": "primary coverts", "primary coverts": "greater coverts",
    "greater coverts": "median coverts", "median coverts": "lesser coverts", "lesser coverts": "back",
    "scapulars": "back", "tail coverts": "back", "under tail coverts": "body",
}


def parts_of(coat: FeatherCoat) -> tuple[str, ...]:
    """Parts of the bird by the number that the column ``tract`` of a laid coat has: body, tracts, parts of wings."""
    parts = sorted({row.part for wing in coat.wings for row in wing.rows})
    return ("body", *(tract.part for tract in coat.tracts), *parts)


def worn_preset(coat: FeatherCoat, part: str = "body") -> str:
    """The preset of the coat's bird on a part of it; that of its body where it has no such part, nor one it is like."""
    worn = load_bird(coat.preset).feathers
    while part not in worn and part in LIKE:
        part = LIKE[part]
    return worn.get(part, worn["body"])


def worn_values(coat: FeatherCoat, preset: str) -> NDArray[np.float32]:
    """All attributes (K,) float32 of the feathers of a coat that wear a preset, as far as they are the same for all.

    Attributes that are keyed, mapped or follow an expression are those of the preset here.
    """
    given = [item for item in coat.attributes if item.name in COLUMNS and for_all(item)]
    if not given and not coat.dials:
        return preset_values(preset)
    values = preset_values(preset).copy()
    for item in given:
        assert isinstance(item.value.base, Constant)
        values[COLUMNS[item.name]] = item.value.base.number
    return turned(np.clip(values, *limits()), **{dial.name: dial.position for dial in coat.dials})
