"""The tree of records as JSON whose arrays are named by their hash, and back, trusting nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

import msgspec
import numpy as np

from core.document import Document
from core.errors import UserError
from core.formats.arrays import ArrayHashes, ArraySpec, spec_of
from core.formats.upgrade import FORMAT, upgrade
from core.workspace import Workspace

LARGEST_TREE = 16 << 20  # bytes of JSON
DEEPEST_TREE = 48
LONGEST_TEXT = 65_536
MOST_ARRAYS = 20_000

T = TypeVar("T")


class Encoded(NamedTuple):
    """`json` bytes of the tree, and the arrays it names by hash."""

    json: bytes
    arrays: dict[str, np.ndarray]


class Envelope(NamedTuple):
    """The plain, upgraded dictionary of a tree and the table of its arrays."""

    raw: dict[str, Any]
    table: dict[str, ArraySpec]


def encode_tree(document: Document, workspace: Workspace, hashes: ArrayHashes, **extra: Any) -> Encoded:
    """The JSON of a document and its workspace (and whatever is in `extra`, plain values) and its arrays."""
    arrays: dict[str, np.ndarray] = {}

    def name(value: Any) -> str:
        if not isinstance(value, np.ndarray):
            raise TypeError(f"a {type(value).__name__} cannot be stored in a document")
        digest = hashes.of(value)
        arrays.setdefault(digest, value)
        return digest

    parts = {
        key: msgspec.Raw(msgspec.json.encode(value, enc_hook=name))
        for key, value in (("document", document), ("workspace", workspace))
    }
    table = {digest: spec_of(array) for digest, array in arrays.items()}
    return Encoded(msgspec.json.encode({"format": FORMAT, **extra, "arrays": table, **parts}), arrays)


def decode_envelope(data: bytes) -> Envelope:
    """Parse the JSON of a tree as far as can be done without its arrays.

    Raises
    ------
    ValueError
        One clause that says what is wrong with it (msgspec's, with the path of the field, where it is one field).
    """
    if len(data) > LARGEST_TREE:
        raise ValueError(f"its description is larger than {LARGEST_TREE >> 20} MB")
    try:
        raw = msgspec.json.decode(data)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise ValueError(f"its description is not valid JSON ({error})") from None
    if not isinstance(raw, dict):
        raise ValueError("its description is not a JSON object")
    _check_limits(raw)
    raw = upgrade(raw)
    try:
        table = msgspec.convert(raw.get("arrays"), dict[str, ArraySpec])
    except msgspec.ValidationError as error:
        raise ValueError(f"arrays: {error}") from None
    if len(table) > MOST_ARRAYS:
        raise ValueError(f"it has more than {MOST_ARRAYS} arrays")
    return Envelope(raw, table)


def decode_part(envelope: Envelope, key: str, kind: type[T], arrays: Mapping[str, np.ndarray]) -> T:
    """The record `kind` under `key`, with its arrays; one object for every hash.

    Raises
    ------
    ValueError
        What is wrong, with the path of the field.
    """

    def leaf(wanted: type, value: Any) -> Any:
        if wanted is not np.ndarray:
            raise ValueError(f"a {wanted.__name__} cannot be read")
        if not isinstance(value, str) or value not in arrays:
            raise ValueError("names an array that is not in the file")
        return arrays[value]

    if key not in envelope.raw:
        raise ValueError(f"its {key} is missing")
    try:
        return msgspec.convert(envelope.raw[key], kind, dec_hook=leaf, strict=True)
    except msgspec.ValidationError as error:
        raise ValueError(f"{key}: {error}") from None
    except (UserError, RecursionError, OverflowError) as error:
        raise ValueError(f"{key}: {error}") from None


def _check_limits(raw: Any) -> None:
    """Refuse what is nested too deep or holds over-long texts, before any of it is used."""
    level = [raw]
    for _ in range(DEEPEST_TREE):
        below: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                if any(len(key) > 255 for key in value):
                    raise ValueError("it holds a name longer than 255 characters")
                below.extend(value.values())
            elif isinstance(value, list):
                below.extend(value)
            elif isinstance(value, str) and len(value) > LONGEST_TEXT:
                raise ValueError(f"it holds a text longer than {LONGEST_TEXT} characters")
        level = below
        if not level:
            return
    raise ValueError(f"it is nested more than {DEEPEST_TREE} deep")
