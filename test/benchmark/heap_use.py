#!/usr/bin/env python3
"""How much of a process's heap is in use, and how much glibc holds free between it: whether a process that grows
leaks or is only fragmented. Reads /proc/PID/mem without stopping the process (as root or the same user).

usage: heap_use.py PID
Prints two numbers [kB]: in use, free.
"""

import re
import struct
import sys

ARENA_BYTES = 64 << 20  # HEAP_MAX_SIZE of glibc on 64 bits: arenas begin at multiples of it


def chunks(memory, at):
    """Sizes and flags of the chunks from here on, and where they end."""
    found = []
    while at + 16 <= len(memory):
        size = struct.unpack_from("<Q", memory, at + 8)[0]
        flags, size = size & 7, size & ~7
        if size < 32 or size % 16 or at + size > len(memory):
            break
        found.append((size, flags))
        at += size
    return found, at


def use(memory):
    """Bytes in use and free of one heap; None while it is being changed."""
    best, end = [], 0
    for start in range(0, 0x1000, 16):  # the arena's own state is before the first chunk
        found, stop = chunks(memory, start)
        if stop > end or (stop == end and len(found) > len(best)):
            best, end = found, stop
        if len(best) > 1000:
            break
    if end < len(memory) - 64:
        return None
    # Whether a chunk is in use, the next one says; the last one is the top.
    used = sum(size for (size, _), (_, after) in zip(best, best[1:]) if after & 1)
    return used, len(memory) - used


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    pid = int(sys.argv[1])
    used = free = 0
    with open(f"/proc/{pid}/maps", encoding="ascii") as maps, open(f"/proc/{pid}/mem", "rb", 0) as mem:
        for line in maps:
            match = re.match(r"([0-9a-f]+)-([0-9a-f]+) rw-p 00000000 00:00 0 *(\S*)", line)
            if not match:
                continue
            begin, end = int(match[1], 16), int(match[2], 16)
            if match[3] != "[heap]" and (match[3] or begin % ARENA_BYTES):
                continue
            for _ in range(20):
                mem.seek(begin)
                memory = mem.read(end - begin)
                if match[3] != "[heap]":  # heap_info: arena, previous heap, size; the rest of the mapping is not used
                    memory = memory[: struct.unpack_from("<3Q", memory)[2]]
                result = use(memory)
                if result:
                    break
            else:
                print(f"heap at {begin:x}: changes too fast, left out", file=sys.stderr)
                continue
            used += result[0]
            free += result[1]
    print(used // 1024, free // 1024)


if __name__ == "__main__":
    main()
