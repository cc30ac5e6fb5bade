#!/usr/bin/env python3
"""Parts of pocd_core depend downwards only.

A folder includes itself and folders before it in FOLDERS, and of these only what the library of the
folder links: a library of NEEDS, and what that one needs.
usage: check_layers.py SOURCE_FOLDER
"""
import pathlib
import re
import sys

# Libraries as pocd_core/CMakeLists.txt makes them, each with its folders from the bottom.
FOLDERS = {
    "core": ["common", "input", "registration", "segmentation", "belief", "objects", "map", "observe", "track",
             "pipeline"],
    "memory": ["memory"],
    "io": ["recording", "output"],
    "config": ["config"],
    "sim": ["sim"],
    "datasets": ["datasets"],
    "eval": ["eval"],
    "network": ["network"],
}
NEEDS = {"core": [], "memory": ["core"], "io": ["core"], "config": ["core"], "sim": ["config"],
         "datasets": ["io", "sim"], "eval": ["datasets"], "network": ["config"]}
# Tracking tells what becomes of the map, and the pipeline does it: it sees none of the map itself.
ALONE_OF = {("track", "map"): {"map/map_edits.hpp", "map/tsdf_config.hpp"}}
# A header of parameters alone may be asked for by who reads them, without the code behind it.
HEADERS_ALONE = {("config", "memory/memory_config.hpp")}


def below(library):
    """The library and all that it links."""
    found = {library}
    for needed in NEEDS[library]:
        found |= below(needed)
    return found


def allowed_of(library, folder):
    own = FOLDERS[library]
    allowed = set(own[:own.index(folder) + 1])
    for other in below(library) - {library}:
        allowed |= set(FOLDERS[other])
    return allowed


def main():
    core = pathlib.Path(sys.argv[1]) / "pocd_core"
    allowed = {f: allowed_of(library, f) for library, folders in FOLDERS.items() for f in folders}
    problems, checked = [], 0
    cmake = (core / "CMakeLists.txt").read_text()
    for library, folders in FOLDERS.items():
        if f"pocd_part({library} {' '.join(folders)})" not in cmake:
            problems.append(f"pocd_core/CMakeLists.txt: has no pocd_part({library} {' '.join(folders)})")
    for root in ("include/pocd", "src"):
        for file in sorted((core / root).rglob("*.[hc]pp")):
            folder = file.relative_to(core / root).parts[0]
            name = file.relative_to(core.parent)
            if folder not in allowed:
                problems.append(f"{name}: the folder {folder} is of no library")
                continue
            checked += 1
            for number, line in enumerate(file.read_text().splitlines(), 1):
                match = re.match(r'\s*#\s*include\s+["<](?:pocd|\.\.)/((\w+)/[\w.]+)', line)
                if not match:
                    continue
                if match[1] not in ALONE_OF.get((folder, match[2]), {match[1]}):
                    problems.append(f"{name}:{number}: {folder} includes {match[1]}, which it does not need")
                if match[2] not in allowed[folder] and (folder, match[1]) not in HEADERS_ALONE:
                    problems.append(f"{name}:{number}: {folder} includes {match[1]}, which is above it or beside it")
    if checked < 200:
        problems.append(f"only {checked} files found: wrong folder?")
    print("\n".join(problems) if problems else f"{checked} files include downwards only")
    return 1 if problems else 0


sys.exit(main())
