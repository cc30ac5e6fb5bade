#!/usr/bin/env python3
"""The parts of pocd_core depend downwards only: a folder includes itself and those before it in LAYERS.

usage: check_layers.py POCD_CORE_FOLDER
"""
import pathlib
import re
import sys

LAYERS = ["common", "config", "input", "segmentation", "state", "map", "association", "change",
          "pipeline", "output", "datasets", "recording", "sim", "eval"]

# What still points upwards. An entry that nothing needs any more is an error, too.
KNOWN = {
    "include/pocd/map/object_library.hpp -> association/icp_target.hpp",
    "include/pocd/map/object_library.hpp -> pipeline/frame_result.hpp",
    "include/pocd/state/lifecycle.hpp -> association/visibility.hpp",
    "include/pocd/state/lifecycle.hpp -> change/change_config.hpp",
    "include/pocd/state/lifecycle.hpp -> map/object_library.hpp",
}

INCLUDE = re.compile(r'^\s*#\s*include\s+"(?:pocd/|\.\./)([a-z_]+)/([^"]+)"', re.MULTILINE)


def upward(core):
    """Includes that point upwards, and folders that LAYERS does not have."""
    found, unknown, files = set(), set(), 0
    for root in ("include/pocd", "src"):
        for file in sorted((core / root).rglob("*.[ch]pp")):
            files += 1
            folder = file.relative_to(core / root).parts[0]
            for other, name in INCLUDE.findall(file.read_text()):
                unknown.update({folder, other} - set(LAYERS))
                if not unknown and LAYERS.index(other) > LAYERS.index(folder):
                    found.add(f"{file.relative_to(core)} -> {other}/{name}")
    return found, unknown, files


def main():
    found, unknown, files = upward(pathlib.Path(sys.argv[1]))
    problems = [f"folder '{name}' has no place in LAYERS" for name in sorted(unknown)]
    problems += [f"points upwards: {line}" for line in sorted(found - KNOWN)]
    problems += [f"is mended, take it out of KNOWN: {line}" for line in sorted(KNOWN - found)]
    if files < 100:
        problems.append(f"only {files} files found: wrong folder?")
    print("\n".join(problems) or f"{files} files, {len(KNOWN)} known includes point upwards")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
