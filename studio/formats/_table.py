"""Tables of numbers in text files, whatever their encoding, separator and decimal sign."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, counted, say

if TYPE_CHECKING:
    import pyarrow as pa

_SAVE_AGAIN = "Save it again as UTF-8 CSV, with a header line and numbers below."
# No time and no channel is larger; the square of it still fits into a float64.
LARGEST = 1e30
_ENCODINGS = {
    "utf-8": "",
    "utf-16": "UTF-16",
    "utf-16-le": "UTF-16",
    "utf-16-be": "UTF-16",
    "cp932": "Shift-JIS",
}


@dataclass(frozen=True, eq=False)
class Table:
    """Numbers under names.

    Args:
        names: column names in order, blank columns left out.
        values: float64 (rows, columns), NaN where a cell was empty.
        texts: the columns asked for as text, by name.
        notes: what was guessed while reading.
    """

    names: tuple[str, ...]
    values: NDArray[np.float64]
    texts: dict[str, list[str]]
    notes: tuple[str, ...]


def header(path: Path) -> tuple[str, ...]:
    """The names in the first line of a table; () where the file cannot be read as one."""
    try:
        text, _ = _first_lines(path)
    except (OSError, StudioError):
        return ()
    return _split(text.splitlines()[0], _separator(text)) if text.strip() else ()


def read_table(path: Path, text_columns: Sequence[str] = (), empty_row: int = 0) -> Table:
    """Read a table of numbers.

    Args:
        path: a CSV file: UTF-8, UTF-16 or Shift-JIS; separated by commas, semicolons or tabs; decimal points
            or commas.
        text_columns: names (any case) of columns that hold text.
        empty_row: rows of just this many cells are known to say nothing and are left out, with a note.

    Raises:
        StudioError: it is missing, empty, holds no table, or a cell is no number.
    """
    if not path.is_file():
        raise StudioError(
            say("{name} is missing.", name=path.name), say("Put it back into {folder}.", folder=path.parent)
        )
    start, encoding = _first_lines(path)
    lines = start.splitlines()
    if not start.strip() or len(lines) < 2 or not lines[1].strip():
        raise StudioError(
            say("{name} holds no rows.", name=path.name),
            "Choose a file with a header line and numbers below.",
        )
    separator = _separator(start)
    names = _split(lines[0], separator)
    if empty_row:
        _must_decode(path, encoding)
    # Only whole lines: the last one may be cut at the end of what was looked at.
    # Found out from the file itself: spreadsheets of some countries write 1,5 for one and a half.
    form = _Form(path, encoding, separator, names, _is_doubled(lines[1:-1] or lines[1:], names, separator))
    form.decimal_comma = separator != "," and _has_decimal_commas(start, separator)
    form.decimal_comma |= separator == "," and not form.doubled and '"' in "".join(lines[1:3])
    return _read(form, {name.lower() for name in text_columns}, empty_row)


def _must_decode(path: Path, encoding: str) -> None:
    """StudioError where a file is no text: pyarrow prints a traceback for a row it cannot hand over."""
    decoder = codecs.getincrementaldecoder(encoding)()
    with path.open("rb") as file:
        try:
            while part := file.read(1 << 20):
                decoder.decode(part)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError as error:
            raise StudioError(
                say("{name} is damaged: not all of it is text.", name=path.name), _SAVE_AGAIN
            ) from error


class _Form:
    def __init__(
        self, path: Path, encoding: str, separator: str, names: tuple[str, ...], doubled: bool
    ) -> None:
        self.path, self.encoding, self.separator = path, encoding, separator
        self.names, self.doubled, self.decimal_comma = names, doubled, False

    def notes(self) -> tuple[str, ...]:
        notes = []
        if self.decimal_comma or self.doubled:
            notes.append(
                say("{name} is written with decimal commas; they were read as such.", name=self.path.name)
            )
        if _ENCODINGS[self.encoding]:
            notes.append(
                say(
                    "{name} is encoded in {encoding}.",
                    name=self.path.name,
                    encoding=_ENCODINGS[self.encoding],
                )
            )
        return tuple(notes)


def _read(form: _Form, text_columns: set[str], empty_row: int) -> Table:
    import pyarrow as pa

    width = len(form.names) * (2 if form.doubled else 1)
    unique = [f"c{i}" for i in range(width)]
    is_text = [name.lower() in text_columns for name in form.names]
    types = {
        column: pa.string() if form.doubled or is_text[i] else pa.float64() for i, column in enumerate(unique)
    }
    skipped: list[int] = []
    try:
        try:
            table = _arrow_table(form, types, empty_row, skipped)
        except pa.ArrowInvalid:
            skipped.clear()
            # One thread knows the row.
            table = _arrow_table(form, types, empty_row, skipped, threads=False)
        columns = _joined(table) if form.doubled else [table.column(name) for name in unique]
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        raise _sentence(form, error) from error
    if not table.num_rows:
        raise _no_rows(form.path)
    notes = form.notes()
    if skipped:
        notes = (
            *notes,
            say(
                "{name}: {rows} without values left out.",
                name=form.path.name,
                rows=counted(len(skipped), "row"),
            ),
        )
    texts = {
        n: [str(text) for text in columns[i].to_pylist()] for i, n in enumerate(form.names) if is_text[i]
    }
    kept = [
        i
        for i, name in enumerate(form.names)
        if not is_text[i] and (name or columns[i].null_count < len(columns[i]))
    ]
    values = np.empty((table.num_rows, len(kept)), dtype=np.float64)
    for place, i in enumerate(kept):
        values[:, place] = columns[i].to_numpy()
    # No time and no channel is; it would overflow further on.
    values[np.abs(values) > LARGEST] = np.nan
    return Table(tuple(form.names[i] for i in kept), values, texts, notes)


def _arrow_table(
    form: _Form, types: dict[str, Any], empty_row: int, skipped: list[int], threads: bool = True
) -> pa.Table:
    from pyarrow import csv as arrow_csv

    def on_bad_row(row: Any) -> Any:
        if row.actual_columns != empty_row:
            return "error"
        skipped.append(1)
        return "skip"

    return arrow_csv.read_csv(
        str(form.path),
        read_options=arrow_csv.ReadOptions(
            column_names=list(types), skip_rows=1, encoding=form.encoding, use_threads=threads
        ),
        parse_options=arrow_csv.ParseOptions(
            delimiter=form.separator, invalid_row_handler=on_bad_row if empty_row else None
        ),
        convert_options=arrow_csv.ConvertOptions(
            column_types=types,
            decimal_point="," if form.decimal_comma else ".",
            null_values=["", "nan", "NaN", "NAN", "null", "None"],
            strings_can_be_null=form.doubled,
        ),
    )


def _no_rows(path: Path) -> StudioError:
    return StudioError(
        say("{name} holds no rows.", name=path.name), "Choose a file with a header line and numbers below."
    )


def _joined(table: pa.Table) -> list[Any]:
    """Numbers whose decimal comma also separates: two neighbours make one."""
    import pyarrow as pa
    from pyarrow import compute

    columns = []
    # Its types do not know the separator as a str.
    join: Any = compute.binary_join_element_wise
    for i in range(0, table.num_columns, 2):
        text = join(table.column(i), table.column(i + 1), ".")
        columns.append(compute.cast(text, pa.float64()))
    return columns


def _sentence(form: _Form, error: Exception) -> StudioError:
    text, name = str(error), form.path.name
    if found := re.search(r"Expected (\d+) columns, got (\d+)", text):
        row = re.search(r"Row #(\d+)", text)
        where = say("A row of {name}", name=name)
        if row:
            where = say("Row {row} of {name}", row=row[1], name=name)
        what = say(
            "{where} has {values} values where the header names {columns} columns.",
            where=where,
            values=found[2],
            columns=len(form.names),
        )
        if form.separator == "," and int(found[2]) > int(found[1]):
            return StudioError(what, "If it has decimal commas, save it with semicolons or decimal points.")
        return StudioError(what, "Fix the row, or export the file again.")
    if found := re.search(
        r"column #(\d+): (?:Row #(\d+): )?CSV conversion error .*invalid value '(.*)'", text
    ):
        column = form.names[min(int(found[1]), len(form.names) - 1)]
        place = say("column {column}", column=column)
        if found[2]:
            place = say("column {column}, row {row}", column=column, row=found[2])
        return StudioError(
            say(
                "{name} has {value} where a number should be, in {place}.",
                name=name,
                value=repr(found[3][:30]),
                place=place,
            ),
            "Fix the value, or export the file again.",
        )
    return StudioError(say("{name} cannot be read as a table.", name=name), _SAVE_AGAIN)


def _first_lines(path: Path) -> tuple[str, str]:
    """The beginning of a text file (up to 1 MiB) and the encoding of all of it."""
    with path.open("rb") as file:
        start = file.read(1 << 20)
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return start[: len(start) // 2 * 2].decode("utf-16", errors="replace"), "utf-16"
    for encoding, zeros in (("utf-16-le", start[1::2]), ("utf-16-be", start[0::2])):
        # Without a mark at its head, every other byte of a table of numbers is zero.
        if len(zeros) > 8 and zeros.count(0) > 0.8 * len(zeros):
            return start[: len(start) // 2 * 2].decode(encoding, errors="replace"), encoding
    if b"\0" in start:
        raise StudioError(say("{name} is not a text file.", name=path.name), _SAVE_AGAIN)
    for encoding in ("utf-8", "cp932"):
        decoder = codecs.getincrementaldecoder(encoding)()
        try:
            text = decoder.decode(start)
        except UnicodeDecodeError:
            continue
        return text.removeprefix("\ufeff"), encoding
    raise StudioError(say("{name} has an unknown text encoding.", name=path.name), _SAVE_AGAIN)


def _separator(text: str) -> str:
    first = text.splitlines()[0]
    return max(",;\t", key=first.count)


def _split(line: str, separator: str) -> tuple[str, ...]:
    try:
        cells = next(csv.reader(io.StringIO(line), delimiter=separator), [])
    except csv.Error:
        # A cell of more than 131072 letters.
        return (line,)
    return tuple(cell.strip() for cell in cells)


def _has_decimal_commas(text: str, separator: str) -> bool:
    rows = text.splitlines()[1:20]
    return any(re.fullmatch(r"\s*-?\d+,\d+(e-?\d+)?\s*", c) for r in rows for c in _split(r, separator))


def _is_doubled(rows: list[str], names: tuple[str, ...], separator: str) -> bool:
    """Whether each row has twice as many cells as the header has names: decimal commas between commas."""
    if separator != "," or '"' in rows[0]:
        return False
    counts = {len(_split(row, separator)) for row in rows[:20] if row.strip()}
    return counts == {2 * len(names)}


def why_unknown(path: Path) -> StudioError:
    """What to say of a table that no format recognises."""
    try:
        _first_lines(path)
    except StudioError as error:
        return error
    what = say("{name} is not a recording: its first column is neither Time nor Timecode.", name=path.name)
    return StudioError(what, "Choose a SAIA or Live Link Face CSV, or name the first column Time.")


def check_suffix(path: Path, suffix: str) -> None:
    """Refuse to write under a name that says something else."""
    if not path.name.lower().endswith(suffix) or len(path.name) == len(suffix):
        raise StudioError(
            say("{name} does not end in {suffix}.", name=path.name, suffix=suffix),
            say("Choose a name that ends in {suffix}.", suffix=suffix),
        )


def write_table(path: Path, names: Sequence[str], values: Sequence[NDArray[np.floating]]) -> None:
    """Write columns of numbers as CSV; every number reads back exactly.

    Args:
        path: where to.
        names: of the columns.
        values: one array (rows,) a column.
    """
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    table = pa.table({f"c{i}": pa.array(np.ascontiguousarray(v)) for i, v in enumerate(values)})
    options = arrow_csv.WriteOptions(include_header=False, batch_size=8192)
    with path.open("wb") as file:
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(names)
        file.write(line.getvalue().encode())
        arrow_csv.write_csv(table, file, options)


def sanitized_note(path: Path, frames: int) -> str:
    """What to say of frames whose values could not be."""
    return say(
        "{name}: {frames} with values that are not numbers repaired or left out.",
        name=path.name,
        frames=counted(frames, "frame"),
    )
