"""Reads a shard of a dataset (docs/reference/model-file.md): `python shard.py data/small/shard-00000.bin`"""

import struct
import sys
from collections.abc import Iterator
from pathlib import Path


def varint(data: bytes, at: int) -> tuple[int, int]:
    """A number of postcard, and where the next one begins."""
    value = shift = 0
    while True:
        value, shift, at = value | (data[at] & 127) << shift, shift + 7, at + 1
        if data[at - 1] < 128:
            return value, at


def records(shard: bytes) -> Iterator[tuple[int, int, float, tuple[float, ...]]]:
    """Scenario, iterations and cost of Stage 2, and the rows of the trajectory, one after the other."""
    at, head = 12 + 1 + 16, []
    for _ in range(4):  # first scenario, tried, records, bytes
        number, at = varint(shard, at)
        head.append(number)
    for _ in range(head[2]):
        scenario, at = varint(shard, at)
        iterations, at = varint(shard, at)
        (cost,) = struct.unpack_from("<d", shard, at)
        count, at = varint(shard, at + 8)
        yield scenario, iterations, cost, struct.unpack_from(f"<{count}f", shard, at)
        at += 4 * count


if __name__ == "__main__":
    for scenario, iterations, cost, rows in records(Path(sys.argv[1]).read_bytes()):
        print(f"scenario {scenario}: {iterations} iterations, cost {cost:.4f}, {len(rows)} numbers")
