"""Followed contacts, kept beside the recordings that an export has read before.

An entry belongs to a recording's contents, to how its contacts were followed, and to the
code that followed them: what differs in any of these is followed again.
"""

import hashlib
import json
import logging
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import edge
from edge.arrays import Array
from edge.errors import InputError
from edge.record.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.writing import write_whole

LOG = logging.getLogger(__name__)
FOLDER = ".edge-classify-cache"
DAMAGED = (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error)
"""Errors of an entry that is missing or damaged."""
Contacts = list[tuple[float, FeatureSeries]]
"""The onset in seconds and the series of every contact of a recording."""


@cache
def _version() -> str:
    """Digest of the code that contacts are followed by."""
    sha = hashlib.sha256(np.__version__.encode())
    rooms = Path(edge.__file__).parent, Path(__file__).parent
    for path in sorted(path for room in rooms for path in room.rglob("*.py")):
        sha.update(path.read_bytes())
    return sha.hexdigest()[:16]


def prepared(folders: Iterable[Path]) -> dict[Path, Path]:
    """{folder: where its entries lie} of those that can be written to. Entries of other
    versions are deleted."""
    places = {}
    for folder in dict.fromkeys(folders):
        place = folder / FOLDER / _version()
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            LOG.debug(
                "%s: nothing is kept for the next export: %s", folder, error.strerror
            )
            continue
        places[folder] = place
        for other in place.parent.iterdir():
            if other != place:
                shutil.rmtree(other, ignore_errors=True)
    return places


def contacts_of(
    place: Path | None,
    recording: Recording,
    layout: SkinLayout,
    how: object,
    follow: Callable[[], Contacts],
) -> Contacts:
    """The contacts of a recording: those of its entry, or else followed and kept.

    Args:
        place: of the entries; None where nothing can be kept.
        recording: with its contents.
        layout: of the skin.
        how: contacts are followed otherwise, as text has it.
        follow: gives the contacts.
    """
    if place is None:
        return follow()
    path = place / _name(recording, layout, how)
    with suppress(*DAMAGED):
        return _read(path, layout)
    contacts = follow()
    with (
        suppress(InputError),
        write_whole(path, lasting=False) as file,
        # The usual level of NumPy takes three times as long for 5 % less.
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as entry,
    ):
        for name, value in _arrays(contacts).items():
            with entry.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, value, allow_pickle=False)
    return contacts


def _name(recording: Recording, layout: SkinLayout, how: object) -> str:
    """The digest of all that contacts follow from."""
    meta = json.dumps(recording.meta, sort_keys=True, default=repr)
    sha = hashlib.sha256(f"{meta} {layout} {how}".encode())
    for name, value in vars(recording).items():
        if isinstance(value, np.ndarray):
            sha.update(f"{name} {value.dtype} {value.shape}".encode())
            sha.update(value.tobytes())
    return sha.hexdigest()


def _arrays(contacts: Contacts) -> dict[str, Array]:
    """The contacts as arrays."""
    arrays = {"onsets": np.array([onset_s for onset_s, _ in contacts])}
    for number, (_, series) in enumerate(contacts):
        fields = {**vars(series), **series.zones}
        for name, value in fields.items():
            if name not in ("layout", "zones") and value is not None:
                kind = "zones" if name in series.zones else "fields"
                arrays[f"{number} {kind} {name}"] = np.asarray(value)
    return arrays


def _read(path: Path, layout: SkinLayout) -> Contacts:
    """The contacts of an entry.

    Raises:
        any of `DAMAGED`: there is none, or it is damaged.
    """
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    onsets = arrays.pop("onsets").tolist()
    fields: list[dict[str, Any]] = [{"zones": {}} for _ in onsets]
    for key, value in arrays.items():
        number, kind, name = key.split(" ", 2)
        of_contact = fields[int(number)]
        of_kind = of_contact["zones"] if kind == "zones" else of_contact
        of_kind[name] = value if value.ndim else value.item()
    return [
        (onset_s, FeatureSeries(layout=layout, **of_contact))
        for onset_s, of_contact in zip(onsets, fields, strict=True)
    ]
