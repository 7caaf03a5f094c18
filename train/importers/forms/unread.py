"""Forms that are seen and not read, each with the way out."""

from collections.abc import Iterator

from edge.errors import InputError
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table

LOG = "a robot's log: give `python -m train import rosbag FILE`"
PICTURE = "a picture, which is not read: save the sensor's values as numbers, a table or array"
SHEET = "a spreadsheet, which is not read: save each sheet as CSV"
OBJECTS = "objects of a program, which are not read, as they may run code: save .npz"
MOVIE = (
    "a movie, which is not read: export it as text (in Tekscan's programs: Save ASCII)"
)
UNREAD = {
    PICTURE: (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp"),
    SHEET: (".xlsx", ".xls", ".xlsm", ".ods"),
    LOG: (".bag", ".mcap", ".db3"),
    OBJECTS: (".pkl", ".pickle", ".pt", ".pth", ".joblib"),
    MOVIE: (".asf", ".fsx", ".mov", ".mp4", ".avi", ".mkv"),
    "CBOR, which is not read: export the samples as JSON or CSV": (".cbor",),
    "sound, which is not read: save the values as a table": (".wav", ".flac", ".mp3"),
    "TFRecord, which is not read: save the arrays as .npz": (".tfrecord",),
    "a grasp of an SDH-2 hand: give `python -m train import sdh2 FOLDER`": (".dsa",),
}
"""{what a file is: its suffixes}."""
KINDS = {suffix: kind for kind, suffixes in UNREAD.items() for suffix in suffixes}


def is_form(file: File) -> bool:
    """Whether a file has such a suffix, or is no text. Tekscan exports both as .asf."""
    suffix = file.path.suffix.lower()
    return (suffix in KINDS and suffix != ".asf") or not file.encoding


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """Refuse the file.

    Raises:
        InputError: always.
    """
    raise InputError(f"{file.path}: is {kind_of(file.path.suffix)}")


def kind_of(suffix: str) -> str:
    """What a file of a suffix is."""
    unknown = "data of no known form: save its values as a text, .npy or .mat"
    return KINDS.get(suffix.lower(), unknown)
