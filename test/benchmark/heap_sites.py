#!/usr/bin/env python3
"""What each call site of a process holds at several times, of one recording by heaptrack 1.4 (also of one that still
runs): what grows. heaptrack_print compares two recordings only.

usage: heap_sites.py FILE.zst SECONDS...
Prints, for the sites that grew most between the first and the last time, kB (and pieces) at each time and the stack.
"""

import collections
import subprocess
import sys

SITES = 15
FRAMES = 8  # of a stack
# Of the allocator and the standard library: not where somebody wanted memory.
SKIPPED = ("operator new", "malloc", "std::", "__gnu_cxx", "void std::")


class Recording:
    """Lines of text, numbers in hexadecimal: s string, i instruction, t trace, a allocation, + made, - freed, c time."""

    def __init__(self):
        self.strings, self.instructions, self.traces, self.allocations = [""], [[]], [(0, 0)], []
        self.live = []  # pieces, per allocation

    def read(self, lines, times_ms):
        """Yields the counts of pieces at each of the times, or at the end."""
        for line in lines:
            kind, rest = line[:1], line[2:].rstrip("\n")
            if kind == "+":
                self.live[int(rest, 16)] += 1
            elif kind == "-":
                self.live[int(rest, 16)] -= 1
            elif kind == "s":
                self.strings.append(rest.partition(" ")[2])
            elif kind in "ita" and kind:
                numbers = [int(word, 16) for word in rest.split()]
                if kind == "a":
                    self.live.append(0)
                {"i": self.instructions, "t": self.traces, "a": self.allocations}[kind].append(numbers)
            elif kind == "c":
                while times_ms and int(rest, 16) >= times_ms[0]:
                    times_ms.pop(0)
                    yield list(self.live)
        for _ in times_ms:
            yield list(self.live)

    def stack(self, trace):
        names = []
        while trace:
            instruction, trace = self.traces[trace]
            module, *function = self.instructions[instruction][1:]
            name = self.strings[function[0]] if function else "?"
            names.append(f"{name[:110]} [{self.strings[module].rpartition('/')[2]}]")
        wanted = [name for name in names if not name.startswith(SKIPPED)]
        return tuple((wanted or names)[:FRAMES])


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    times = sorted(float(word) for word in sys.argv[2:])
    recording = Recording()
    unpack = subprocess.Popen(["zstd", "-dcq", sys.argv[1]], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    text = (line.decode("utf-8", "replace") for line in unpack.stdout)
    held = []
    for live in recording.read(text, [1000 * t for t in times]):
        sites = collections.defaultdict(lambda: [0, 0])
        for (size, trace), count in zip(recording.allocations, live):
            if count:
                sites[trace][0] += size * count
                sites[trace][1] += count
        held.append(sites)
    grouped = []
    stacks = {}
    for time, sites in zip(times, held):
        groups = collections.defaultdict(lambda: [0, 0])
        for trace, (size, count) in sites.items():
            stack = stacks.setdefault(trace, recording.stack(trace))
            groups[stack][0] += size
            groups[stack][1] += count
        grouped.append(groups)
        total = sum(size for size, _ in groups.values())
        print(f"after {time:g} s: {total / 1e6:.2f} MB in {sum(n for _, n in groups.values())} pieces")
    every = set().union(*grouped)
    growth = {stack: grouped[-1][stack][0] - grouped[0][stack][0] for stack in every}
    for stack in sorted(every, key=lambda s: -growth[s])[:SITES]:
        columns = "  ".join(f"{g[stack][0] / 1e3:.1f} ({g[stack][1]})" for g in grouped)
        print(f"{growth[stack] / 1e3:+.1f} kB: {columns}")
        for name in stack:
            print("   ", name)


if __name__ == "__main__":
    main()
