"""Columns to and from Arrow, without a detour through pandas.

`pyarrow.array` imports pandas on its first call, a second during which nothing else in the process
runs; beside a control loop that must not happen. So arrays are put together from their buffers.
"""

import numpy as np
import pyarrow as pa

from app.recording.columns import Column, Columns


def to_table(columns: Columns, metadata: dict[bytes, bytes] | None = None) -> pa.Table:
    """Columns as an Arrow table.

    Text becomes a dictionary, a list a fixed-size list. Columns of lists without an element are
    left out: Parquet has no lists of length 0.
    """
    kept = {name: column for name, column in columns.items() if column.ndim == 1 or column.size}
    table = pa.Table.from_arrays([_to_arrow(c) for c in kept.values()], names=list(kept))
    return table.replace_schema_metadata(metadata)


def from_table(table: pa.Table, name: str) -> Column:
    """One column of a table: shape (n_rows,), or (n_rows, length) for a list."""
    array = table[name].combine_chunks()
    if pa.types.is_dictionary(array.type):
        words = np.array([str(word) for word in array.dictionary.to_pylist()], dtype=np.str_)
        return words[_from_numbers(array.indices)] if len(words) else words
    if pa.types.is_fixed_size_list(array.type):
        return _from_numbers(array.flatten()).reshape(len(array), -1)
    return _from_numbers(array)


def _from_numbers(array: pa.Array) -> Column:
    data = array.buffers()[1]
    rows = slice(array.offset, array.offset + len(array))
    if pa.types.is_boolean(array.type):
        bits = np.frombuffer(data, dtype=np.uint8)
        return np.unpackbits(bits, bitorder="little")[rows].astype(bool)
    return np.frombuffer(data, dtype=array.type.to_pandas_dtype())[rows]


def _to_arrow(column: Column) -> pa.Array:
    if column.ndim == 2:
        return pa.FixedSizeListArray.from_arrays(_to_arrow(column.reshape(-1)), column.shape[1])
    if column.dtype.kind == "U":
        words, codes = np.unique(column, return_inverse=True)
        return pa.DictionaryArray.from_arrays(_numbers(codes.astype(np.int32)), _text(words))
    return _numbers(column)


def _numbers(column: Column) -> pa.Array:
    if column.dtype.kind == "b":
        bits = np.packbits(column, bitorder="little")
        return pa.Array.from_buffers(pa.bool_(), len(column), [None, pa.py_buffer(bits)])
    kind = pa.from_numpy_dtype(column.dtype)
    data = pa.py_buffer(np.ascontiguousarray(column))
    return pa.Array.from_buffers(kind, len(column), [None, data])


def _text(words: Column) -> pa.Array:
    encoded = [str(word).encode() for word in words]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(pa.string(), len(encoded), buffers)
